#include "render/trace/volumes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "render/light/fog_shafts.shared.h"
#include "render/trace/media.h"

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

bool collides(const SceneMedium& m) { return m.scatters || m.emits; }

/// Delta tracking up to `end`.
GridTracking delta_track(const MediumStretch& s, const Vec3d& direction, double end, double sigma,
                         RandomStream random) {
  GridTracking found;
  const auto numbers = [&] { return random.next_double(); };
  found.majorant =
      track_collisions(*s.medium->medium, s.origin, direction, s.t0, end, sigma, numbers, [&](double t, double share) {
        if (random.next_double() < share) {
          found.collision = t;
          return false;
        }
        ++found.nulls;
        found.missed *= 1 - share;
        return true;
      });
  return found;
}

/// Ratio tracking up to `end`: no collision is real. `weight`: 1, or what Russian roulette makes of it.
GridTracking ratio_track(const MediumStretch& s, const Vec3d& direction, double end, double sigma, RandomStream& random,
                         double& weight) {
  constexpr double kLeastMissed = 1.0 / 16;
  GridTracking found;
  const auto numbers = [&] { return random.next_double(); };
  weight = 1;
  found.majorant =
      track_collisions(*s.medium->medium, s.origin, direction, s.t0, end, sigma, numbers, [&](double, double share) {
        ++found.nulls;
        found.missed *= 1 - share;
        if (found.missed * weight < kLeastMissed) weight = random.next_double() < 0.5 ? 2 * weight : 0;
        return found.missed * weight > 0;
      });
  return found;
}

/// Each band's probability of the tentative collisions and of none between them, over the hero's.
Vec3d relative_majorant(const Vec3d& sigma, int hero, const GridTracking& found) {
  Vec3d r(1);
  for (int b = 0; b < 3; ++b) {
    if (b == hero || sigma[b] == sigma[hero]) continue;
    const double nulls = found.nulls > 0 ? found.nulls * std::log(sigma[b] / sigma[hero]) : 0;
    r[b] = std::min(std::exp(nulls - (sigma[b] - sigma[hero]) * found.majorant), kLargestRatio);
  }
  return r;
}

void pass_exactly(const MediumStretch& s, const Vec3d& direction, Transmittance& t) {
  const Vec3d passed = attenuation(s.medium->extinction, depth_to(s, direction, s.t1));
  t.value *= passed;
  if (collides(*s.medium)) t.made *= passed;
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
                          DensityTracking tracking, RandomStream& random, Bands& bands, Vec3d& emitted) {
  ScatterEvent event;
  event.t = t_end;
  const int hero = bands.hero;
  const bool tracks = tracking == DensityTracking::delta;
  const RandomStream grids = random.split();
  GridTracking tracked;  // of the stretch `of`, up to `until`
  size_t of = stretches.size();
  double until = 0;
  const auto track_grid = [&](size_t i) -> const GridTracking& {
    const MediumStretch& s = stretches[i];
    const double end = std::min(s.t1, event.t);
    if (of != i || until != end)
      tracked = delta_track(s, direction, end, s.medium->extinction[hero], grids.part(i)), of = i, until = end;
    return tracked;
  };

  // The first collision in a medium that scatters or shines.
  for (size_t i = 0; i < stretches.size(); ++i) {
    const MediumStretch& s = stretches[i];
    const SceneMedium& m = *s.medium;
    if (!collides(m)) continue;
    const double wanted = -std::log1p(-random.next_double()), sigma = m.extinction[hero];
    if (!(sigma > 0) || s.t0 >= event.t) continue;
    const double t = tracks && m.tracks ? track_grid(i).collision
                                        : world::medium_reach(*m.medium, s.origin, direction, s.t0,
                                                              std::min(s.t1, event.t), wanted / sigma);
    if (t < event.t) event = {true, t, &m}, until = of == i ? t : until;
  }
  // What lets light through up to there: media that only absorb are a weight; in others, to pass was a choice. Numbers
  // of a grid that was tracked further say the same up to there.
  for (size_t i = 0; i < stretches.size(); ++i) {
    const MediumStretch& s = stretches[i];
    if (s.t0 >= event.t) continue;
    const SceneMedium& m = *s.medium;
    const double end = std::min(s.t1, event.t);
    if (tracks && m.tracks) {
      if (collides(m)) {
        const GridTracking& found = track_grid(i);
        const Vec3d ratio = relative_majorant(m.extinction, hero, found);
        bands.beta *= ratio, bands.made *= ratio;
        bands.lit = min(bands.lit * ratio / std::max(found.missed, 1 / kLargestRatio), Vec3d(kLargestRatio));
      } else {
        double weight = 1;
        RandomStream numbers = grids.part(i);
        const GridTracking found = ratio_track(s, direction, end, m.extinction[hero], numbers, weight);
        const Vec3d ratio = relative_majorant(m.extinction, hero, found);
        bands.beta *= ratio * (found.missed * weight);
        bands.made *= ratio, bands.lit *= ratio;
      }
      continue;
    }
    const double depth = depth_to(s, direction, end);
    if (!collides(m)) {
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
  for (const MediumStretch& s : stretches) pass_exactly(s, direction, t);
  return t;
}

Transmittance tracked_transmittance(const std::vector<MediumStretch>& stretches, const Vec3d& direction, int hero,
                                    RandomStream& random) {
  Transmittance t;
  for (const MediumStretch& s : stretches) {
    if (!s.medium->tracks) {
      pass_exactly(s, direction, t);
      continue;
    }
    const Vec3d& sigma = s.medium->extinction;
    double weight = 1;
    const GridTracking found = ratio_track(s, direction, s.t1, sigma[hero], random, weight);
    const Vec3d ratio = relative_majorant(sigma, hero, found);
    t.value *= ratio * (found.missed * weight);
    t.lit *= ratio;
    t.made *= collides(*s.medium) ? ratio * found.missed : ratio;
  }
  return t;
}

namespace {

/// Goes on with a view that ends at t.
void see_fog(FogView& view, const std::vector<MediumStretch>& stretches, const Vec3d& direction, double t, double t_end,
             const Vec3d& sun) {
  // Between the ends of stretches the set of media is the same; within such a part each shines in proportion to its
  // depth, which is exact for one medium and for constant densities.
  std::vector<double> ends{t, t_end};
  for (const MediumStretch& s : stretches)
    for (const double end : {s.t0, s.t1})
      if (end > t && end < t_end) ends.push_back(end);
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  for (size_t i = 0; i + 1 < ends.size(); ++i) {
    Vec3d depth(0), shine(0);
    for (const MediumStretch& s : stretches) {
      if (s.t0 >= ends[i + 1] || s.t1 <= ends[i]) continue;
      const double d = world::medium_depth(*s.medium->medium, s.origin, direction, ends[i], ends[i + 1]);
      const Vec3d source = s.medium->emission + s.medium->scattered_in.sky +
                           sun * s.medium->scattered_in.sun *
                               phase_density(s.medium->medium->anisotropy, glm::dot(s.medium->to_sun, direction));
      for (int b = 0; b < 3; ++b) {
        if (!(s.medium->extinction[b] > 0)) continue;
        depth[b] += s.medium->extinction[b] * d;
        shine[b] += std::min(s.medium->extinction[b] * d, 1e30) * source[b];
      }
    }
    for (int b = 0; b < 3; ++b) {
      if (!(depth[b] > 0)) continue;
      view.added[b] += view.value[b] * (shine[b] / std::min(depth[b], 1e30)) * -std::expm1(-depth[b]);
      view.value[b] *= std::exp(-depth[b]);
    }
  }
}

/// All media's depth over [t0, t1], the mean of the bands: about that, in density grids, where it is asked for often.
double mean_depth(const std::vector<MediumStretch>& stretches, const Vec3d& direction, double t0, double t1) {
  double sum = 0;
  for (const MediumStretch& s : stretches) {
    const double from = std::max(t0, s.t0), to = std::min(t1, s.t1);
    if (!(from < to)) continue;
    double depth = 0;
    if (s.medium->medium->field) {
      constexpr int kSteps = shared::kFogShaftGridSteps;
      for (int i = 0; i < kSteps; ++i)
        depth +=
            world::medium_density(*s.medium->medium, s.origin + (from + (i + 0.5) / kSteps * (to - from)) * direction) *
            ((to - from) / kSteps);
    } else {
      depth = world::medium_depth(*s.medium->medium, s.origin, direction, from, to);
    }
    sum += Bands::mean(s.medium->extinction) * depth;
  }
  return sum;
}

}  // namespace

std::pair<double, double> fog_shaft_span(const std::vector<MediumStretch>& stretches, const Vec3d& direction) {
  double from = kInfinity, to = 0;
  for (const MediumStretch& s : stretches) from = std::min(from, s.t0), to = std::max(to, s.t1);
  to = std::min(to, double{shared::kFogShaftFarthest});
  if (!(from < to)) return {from, to};
  const double total = mean_depth(stretches, direction, from, to);
  if (shared::fog_shafts_go_through(mean_depth(stretches, direction, from, (from + to) / 2), total)) return {from, to};
  const double wanted = shared::fog_shaft_depth(total);
  double high = 1;
  for (int i = 0; i < shared::kFogShaftDoublings && high < to - from; ++i) {
    if (!(mean_depth(stretches, direction, from, from + high) < wanted)) break;
    high *= 2;
  }
  double low = high / 2;
  for (int i = 0; i < shared::kFogShaftHalvings; ++i) {
    const double middle = (low + high) / 2;
    (mean_depth(stretches, direction, from, from + middle) < wanted ? low : high) = middle;
  }
  return {from, from + std::min(high, to - from)};
}

FogView fog_along(const std::vector<MediumStretch>& stretches, const Vec3d& direction, double t_end,
                  const FogShafts* shafts, double before) {
  FogView view;
  if (stretches.empty()) return view;
  double t = 0;
  const int pieces = shafts && shafts->from < shafts->to ? shafts->pieces : 0;
  for (int i = 0; i < pieces && t < t_end; ++i) {
    const double end = shafts->from + (shafts->to - shafts->from) * (i + 1) / pieces - before;
    const double next = i + 1 < pieces ? std::min(end, t_end) : t_end;
    if (!(next > t)) continue;
    see_fog(view, stretches, direction, t, next, shafts->sun(i));
    t = next;
  }
  if (t < t_end) see_fog(view, stretches, direction, t, t_end, Vec3d(1));
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
