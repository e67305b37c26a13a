/// How wrong a coloured pane looks when what passes it is blended instead of refracted, by its thickness, and what that
/// costs (hard case A14).
///
/// A plane-parallel pane of glass, index 1.5, absorbing 0.5, 0.1 and 0.8 1/m, seen from 0 to 75 degrees off its normal;
/// 0.5 m behind it a wall of stripes whose radiance changes as a sine along the plane of sight, with a period of 0.25
/// m. In front all is dark, so that what comes through the pane is all that is seen.
///
///   reference        every way through the pane: absorbed along its length, split by Fresnel at each face, shifted
///   constant blend   t of 14.10.3, the same for each pane: that of 0.1 m, seen straight
///   exp(-k x)        x: the way straight on through the pane, no reflection
///   thin             the BSDF of sheets: Fresnel at both faces and between them, absorbed along the refracted way, no
///                    shift
///   refracted        the one way that is refracted twice and never reflected inside, by the BSDF of clear media:
///   shifted
/// Each method's energy is checked where it is measured: none lets more through than there is.
/// source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.10.3
#include <cmath>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "render/bsdf/bsdf.h"
#include "tools/bench/benchmark.h"
#include "world/media/medium.shared.h"

namespace tools {

namespace {

using world::Vec3d;
using world::Vec3f;
using world::shared::beer_lambert;

constexpr float kIndex = 1.5f;
constexpr double kBehind = 0.5, kPeriod = 0.25, kConstantThickness = 0.1;
constexpr int kEvaluations = 100000;  // a call
const Vec3d kAbsorption(0.5, 0.1, 0.8);
const Vec3f kNormal(0, 1, 0);

/// The wall, by place along the plane of sight; in [0, 1].
double wall(double at) { return 0.5 + 0.5 * std::sin(2 * 3.14159265358979323846 * at / kPeriod); }

struct View {
  double sine, cosine;  // of the angle between the eye's direction and the normal
};
std::vector<View> views() {
  std::vector<View> all;
  for (int degrees = 0; degrees <= 75; ++degrees) {
    const double angle = degrees * 3.14159265358979323846 / 180;
    all.push_back({std::sin(angle), std::cos(angle)});
  }
  return all;
}

/// What the eye sees of a wall, by band; `lit`: a wall of radiance 1 everywhere.
using Method = Vec3d (*)(const View& view, double thickness, bool lit);

double wall_or_one(double at, bool lit) { return lit ? 1 : wall(at); }

/// Where the line of sight meets the wall if it goes straight on; the eye's side of the pane is at 0.
double straight(const View& v, double thickness) { return (thickness + kBehind) * v.sine / v.cosine; }

Vec3d reference(const View& v, double thickness, bool lit) {
  const double inside = v.sine / kIndex, cosine = std::sqrt(1 - inside * inside);
  const double across = (v.cosine - kIndex * cosine) / (v.cosine + kIndex * cosine),
               within = (kIndex * v.cosine - cosine) / (kIndex * v.cosine + cosine);
  const double r = 0.5 * (across * across + within * within);
  const double shift = thickness * inside / cosine;  // along the pane, for each crossing
  Vec3d sum(0);
  for (int band = 0; band < 3; ++band) {
    const double crossing = beer_lambert(kAbsorption[band], thickness / cosine);
    double weight = (1 - r) * (1 - r) * crossing;
    for (int k = 1; weight > 1e-17; k += 2, weight *= r * r * crossing * crossing)
      sum[band] += weight * wall_or_one(k * shift + kBehind * v.sine / v.cosine, lit);
  }
  return sum;
}

Vec3d constant_blend(const View& v, double thickness, bool lit) {
  const double seen = wall_or_one(straight(v, thickness), lit);
  Vec3d t;
  for (int band = 0; band < 3; ++band) t[band] = beer_lambert(kAbsorption[band], kConstantThickness);
  return t * seen;
}

Vec3d straight_absorption(const View& v, double thickness, bool lit) {
  const double seen = wall_or_one(straight(v, thickness), lit);
  Vec3d t;
  for (int band = 0; band < 3; ++band) t[band] = beer_lambert(kAbsorption[band], thickness / v.cosine);
  return t * seen;
}

render::BsdfParameters glass(float eta) {
  render::BsdfParameters p;
  p.eta = eta;
  return p;
}
Vec3f towards_eye(const View& v) { return {static_cast<float>(v.sine), static_cast<float>(v.cosine), 0}; }

Vec3d thin(const View& v, double thickness, bool lit) {
  static const render::Bsdf& bsdf = *render::find_bsdf("thin");
  const double inside = v.sine / kIndex, length = thickness / std::sqrt(1 - inside * inside);
  render::BsdfParameters p = glass(kIndex);
  for (int band = 0; band < 3; ++band)
    p.transmission[band] = static_cast<float>(beer_lambert(kAbsorption[band], length));
  const render::Impulses ways = bsdf.incoming_impulses(p, towards_eye(v), kNormal);
  Vec3d sum(0);
  for (int i = 0; i < ways.count; ++i)
    if (ways.impulse[i].direction.y < 0)
      sum += Vec3d(ways.impulse[i].magnitude) * wall_or_one(straight(v, thickness), lit);
  return sum;
}

/// The impulse that goes on through the face.
render::Impulse refracted(float eta, Vec3f towards) {
  static const render::Bsdf& bsdf = *render::find_bsdf("dielectric");
  const render::Impulses ways = bsdf.incoming_impulses(glass(eta), towards, kNormal);
  for (int i = 0; i < ways.count; ++i)
    if (ways.impulse[i].direction.y < 0) return ways.impulse[i];
  return {};
}

Vec3d refracted_once(const View& v, double thickness, bool lit) {
  const render::Impulse in = refracted(kIndex, towards_eye(v));
  const render::Impulse out = refracted(1 / kIndex, -in.direction);
  const Vec3d inside(in.direction), behind(out.direction);
  const double at = thickness * inside.x / inside.y + kBehind * behind.x / behind.y;
  Vec3d sum;
  for (int band = 0; band < 3; ++band)
    sum[band] = double{in.magnitude[band]} * out.magnitude[band] *
                beer_lambert(kAbsorption[band], -thickness / inside.y) * wall_or_one(at, lit);
  return sum;
}

/// Metrics: mean and largest error of radiance over views and bands, of a wall of at most 1; bias: mean signed error.
/// NaN where a method lets through more than there is.
ErrorSample errors_of(Method method, double thickness) {
  double sum = 0, signed_sum = 0, worst = 0;
  bool gains = false;
  const std::vector<View> all = views();
  for (const View& v : all) {
    const Vec3d seen = method(v, thickness, false), right = reference(v, thickness, false),
                lit = method(v, thickness, true);
    for (int band = 0; band < 3; ++band) {
      const double error = seen[band] - right[band];
      sum += std::abs(error), signed_sum += error, worst = std::max(worst, std::abs(error));
      gains |= !(lit[band] <= 1 + 1e-6);
    }
  }
  const double count = 3 * static_cast<double>(all.size());
  if (gains) sum = std::numeric_limits<double>::quiet_NaN();
  return {{sum / count, worst}, signed_sum / count};
}

}  // namespace

void add_subject_transmission(Registry& registry) {
  Subject subject{.question = "when may a pane of glass be blended instead of refracted?",
                  .reference = "every way through the pane, summed until 1e-17 of the light is left",
                  .metrics = {"error of radiance (mean; the wall's is at most 1)", "error of radiance (largest)"},
                  .work_unit = "looks through the pane; a call makes 1e5"};
  subject.settings = [](BenchContext&) -> Result<std::vector<Setting>> {
    struct Named {
      std::string name;
      Method method;
    };
    std::vector<Setting> settings;
    for (const Named& m : {Named{"constant blend", constant_blend}, Named{"exp(-k x)", straight_absorption},
                           Named{"thin", thin}, Named{"refracted", refracted_once}, Named{"all ways", reference}})
      for (const double thickness : {0.003, 0.01, 0.03, 0.1, 0.3, 1.0}) {
        Setting setting{.method = m.name, .setting = fmt::format("{}@{}m", m.name, thickness)};
        setting.problem = fmt::format("{} m", thickness), setting.knob = thickness;
        setting.is_default = m.name == "thin" || m.name == "refracted";  // sheets, and blocks
        setting.measure = [=](uint64_t) { return errors_of(m.method, thickness); };
        setting.run = [=] {
          const std::vector<View> all = views();
          Vec3d sum(0);
          int done = 0;
          while (done < kEvaluations)
            for (const View& v : all) sum += m.method(v, thickness, false), ++done;
          keep(sum);
          return static_cast<double>(done);
        };
        settings.push_back(std::move(setting));
      }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
