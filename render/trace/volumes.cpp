#include "render/trace/volumes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace render {

using world::kInfinity;

namespace {

constexpr double kPi = 3.14159265358979323846;
/// Of a ratio of probabilities, so that its product with 0 is 0.
constexpr double kLargestRatio = 1e200;

/// exp(-sigma * depth), where 0 * infinity is 0.
double attenuation(double sigma, double depth) { return sigma > 0 && depth > 0 ? std::exp(-sigma * depth) : 1; }
Vec3d attenuation(const Vec3d& sigma, double depth) {
  return {attenuation(sigma.x, depth), attenuation(sigma.y, depth), attenuation(sigma.z, depth)};
}
/// exp(-(sigma - hero's) * depth): a ratio of transmittances that doesn't underflow in both.
Vec3d relative_attenuation(const Vec3d& sigma, int hero, double depth) {
  Vec3d r(1);
  for (int b = 0; b < 3; ++b) {
    const double difference = sigma[b] - sigma[hero];
    if (b != hero && difference != 0 && depth > 0) r[b] = std::min(std::exp(-difference * depth), kLargestRatio);
  }
  return r;
}

double depth_to(const MediumStretch& s, const Vec3d& direction, double t) {
  return world::medium_depth(*s.medium->medium, s.origin, direction, s.t0, t);
}

}  // namespace

void basis_around(const Vec3d& n, Vec3d& a, Vec3d& b) {
  const double sign = std::copysign(1.0, n.z), k = -1 / (sign + n.z), xy = n.x * n.y * k;
  a = {1 + sign * n.x * n.x * k, sign * xy, -sign * n.x};
  b = {xy, sign + n.y * n.y * k, -n.y};
}

void media_along(Tracer& tracer, const TraceRay& ray, const std::vector<Crossing>& crossings, double t_end,
                 std::vector<MediumStretch>& out) {
  out.clear();
  const TraceScene& scene = tracer.scene();
  if (!scene.has_media()) return;
  const auto add = [&](const SceneMedium& m, double t0, double t1) {
    if (!(t0 < t1)) return;
    const Vec3d origin = ray.start() - m.medium->position;
    const world::MediumInterval in = world::medium_interval(*m.medium, origin, ray.ray.direction, t1);
    const double begin = std::max(in.t0, t0), end = std::min(in.t1, t1);
    if (begin < end) out.push_back({&m, origin, begin, end});
  };
  const auto& media = scene.media();
  for (size_t i = 0; i < media.size(); ++i) {
    if (media[i].everywhere) {
      add(media[i], 0, t_end);
      continue;
    }
    // Within meshes: from where the count of those around that hold it leaves 0 to where it comes back.
    const auto holds = [&](uint32_t instance) { return scene.instances()[instance].medium == static_cast<int>(i); };
    int count = 0;
    for (int k = 0; k < ray.around.count(); ++k) count += holds(ray.around[k]);
    double since = 0;
    for (const Crossing& c : crossings) {
      if (c.t > t_end) break;
      if (!holds(c.instance)) continue;
      if (c.enters && count++ == 0) since = c.t;
      if (!c.enters && count > 0 && --count == 0) add(media[i], since, c.t);
    }
    if (count > 0) add(media[i], since, t_end);
  }
  tracer.counts.media_intervals += out.size();
}

ScatterEvent follow_media(const std::vector<MediumStretch>& stretches, const Vec3d& direction, double t_end,
                          RandomStream& random, Bands& bands, Vec3d& emitted) {
  ScatterEvent event;
  event.t = t_end;
  const int hero = bands.hero;
  // The first collision in a medium that scatters or shines.
  for (const MediumStretch& s : stretches) {
    const SceneMedium& m = *s.medium;
    if (!(m.scatters || m.emits)) continue;
    const double wanted = -std::log1p(-random.next_double()), sigma = m.extinction[hero];
    if (!(sigma > 0) || s.t0 >= event.t) continue;
    const double t = world::medium_reach(*m.medium, s.origin, direction, s.t0, std::min(s.t1, event.t), wanted / sigma);
    if (t < event.t) event = {true, t, &m};
  }
  // What lets light through up to there: media that only absorb are a weight; in others, to pass was a choice.
  for (const MediumStretch& s : stretches) {
    if (s.t0 >= event.t) continue;
    const SceneMedium& m = *s.medium;
    const double depth = depth_to(s, direction, std::min(s.t1, event.t));
    if (!(m.scatters || m.emits)) {
      bands.beta *= attenuation(m.extinction, depth);
      continue;
    }
    const Vec3d ratio = relative_attenuation(m.extinction, hero, depth);
    bands.beta *= ratio, bands.made *= ratio;
    bands.lit *= std::min(1 / attenuation(m.extinction[hero], depth), kLargestRatio);
  }
  if (!event.scatters) return event;

  const SceneMedium& m = *event.medium;
  const Vec3d rate = m.extinction / m.extinction[hero];  // of collisions, over the hero's
  bands.made *= rate;
  if (m.emits) emitted += bands.beta * rate * m.emission / Bands::mean(bands.made);
  bands.beta *= m.scattering / m.extinction[hero];
  bands.lit = bands.made;
  return event;
}

Transmittance transmittance(const std::vector<MediumStretch>& stretches, const Vec3d& direction) {
  Transmittance t;
  for (const MediumStretch& s : stretches) {
    const SceneMedium& m = *s.medium;
    const Vec3d passed = attenuation(m.extinction, depth_to(s, direction, s.t1));
    t.value *= passed;
    if (m.scatters || m.emits) t.made *= passed;
  }
  return t;
}

FogView fog_along(const std::vector<MediumStretch>& stretches, const Vec3d& direction) {
  FogView view;
  if (stretches.empty()) return view;
  // Between the ends of stretches the set of media is the same; within such a part each shines in proportion to its
  // depth, which is exact for one medium and for constant densities.
  std::vector<double> ends;
  for (const MediumStretch& s : stretches) ends.insert(ends.end(), {s.t0, s.t1});
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  for (size_t i = 0; i + 1 < ends.size(); ++i) {
    Vec3d depth(0), shine(0);
    for (const MediumStretch& s : stretches) {
      if (s.t0 >= ends[i + 1] || s.t1 <= ends[i]) continue;
      const double d = world::medium_depth(*s.medium->medium, s.origin, direction, ends[i], ends[i + 1]);
      for (int b = 0; b < 3; ++b) {
        if (!(s.medium->extinction[b] > 0)) continue;
        depth[b] += s.medium->extinction[b] * d;
        shine[b] += std::min(s.medium->extinction[b] * d, 1e30) * s.medium->emission[b];
      }
    }
    for (int b = 0; b < 3; ++b) {
      if (!(depth[b] > 0)) continue;
      view.added[b] += view.value[b] * (shine[b] / std::min(depth[b], 1e30)) * -std::expm1(-depth[b]);
      view.value[b] *= std::exp(-depth[b]);
    }
  }
  return view;
}

double phase_density(double g, double cosine) {
  const double d = 1 + g * g - 2 * g * cosine;
  return (1 - g * g) / (4 * kPi * d * std::sqrt(d));
}

Vec3d sample_phase(double g, const Vec3d& forward, glm::vec2 u) {
  double cosine;
  if (std::abs(g) < 1e-3) {
    cosine = 1 - 2 * double{u.x} + 1.5 * g * (1 - (1 - 2 * double{u.x}) * (1 - 2 * double{u.x}));
  } else {
    const double k = (1 - g * g) / (1 - g + 2 * g * double{u.x});
    cosine = (1 + g * g - k * k) / (2 * g);
  }
  cosine = std::clamp(cosine, -1.0, 1.0);
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine)), angle = 2 * kPi * double{u.y};
  Vec3d a, b;
  basis_around(forward, a, b);
  return glm::normalize(sine * std::cos(angle) * a + sine * std::sin(angle) * b + cosine * forward);
}

}  // namespace render
