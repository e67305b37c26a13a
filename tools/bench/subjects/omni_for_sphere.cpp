/// What an omni in place of a ball of light gets wrong, by distance in radii.
///
/// Wholly above a plane's horizon both give the same irradiance, exactly (hard case L2); they differ while the ball
/// sets: the omni is there or not, the ball goes down bit by bit. 64 planes tilt from facing the ball until it has set;
/// errors are those of the irradiance over that of a plane that faces it. (They also differ in shadows' borders, as
/// much as the ball is seen wide: the same angle.)
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"
#include "world/base/random.h"
#include "world/luminaires/luminaire.h"

namespace tools {

namespace {

using world::Luminaire;
using world::LuminaireSampler;
using world::Vec3d;

constexpr double kPi = 3.14159265358979323846;
constexpr int kTilts = 64, kTimedEstimates = 64;

/// Over pi L / h^2, at h radii, h > 1; the horizon may cut the ball. source: Inigo Quilez. Sphere - ambient occlusion
double exact_irradiance(double h, double cosine) {
  const double k = 1 - h * h * cosine * cosine;
  if (k <= 0) return std::max(cosine, 0.0);
  const double root = std::sqrt((h - 1) * (h + 1)), sine = std::sqrt((1 - cosine) * (1 + cosine));
  const double factor =
      (cosine * std::acos(std::clamp(-cosine * root / sine, -1.0, 1.0)) - std::sqrt(k) * root) / (h * h) +
      std::atan(std::sqrt(k) / root);
  return factor * h * h / kPi;
}

double estimate(const LuminaireSampler& lamp, double h, double tilt, int count, uint64_t seed) {
  const Vec3d receiver(0, -h, 0), normal(std::sin(tilt), std::cos(tilt), 0);
  const double shift[2] = {world::uniform01_double(world::random_bits(seed, 0, 0, 0)),
                           world::uniform01_double(world::random_bits(seed, 1, 0, 0))};
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    // source: Martin Roberts. The Unreasonable Effectiveness of Quasirandom Sequences. 2018
    const double x = shift[0] + 0.75487766624669276 * i, y = shift[1] + 0.56984029099805327 * i;
    const auto wrapped = [](double v) { return static_cast<float>(std::min(v - std::floor(v), 1 - 0x1p-24)); };
    const world::LuminaireSample s = lamp.sample(receiver, {wrapped(x), wrapped(y)});
    sum += s.biradiance.g * std::max(glm::dot(Vec3d(s.direction), normal), 0.0);
  }
  return sum / count * h * h / kPi;
}

ErrorSample errors_of(const LuminaireSampler& lamp, double h, int count, uint64_t seed) {
  double squares = 0, worst = 0, sum = 0;
  for (int i = 0; i < kTilts; ++i) {
    const double tilt = (i + 0.5) / kTilts * (kPi / 2 + std::asin(1 / h));
    const double error = estimate(lamp, h, tilt, count, world::hash_combine(seed, static_cast<uint64_t>(i))) -
                         exact_irradiance(h, std::cos(tilt));
    squares += error * error, worst = std::max(worst, std::abs(error)), sum += error;
  }
  return {{std::sqrt(squares / kTilts), worst}, sum / kTilts};
}

}  // namespace

void add_subject_omni_for_sphere(Registry& registry) {
  Subject subject{.question = "from which distance on may a ball of light be a point?",
                  .reference = "irradiance of a sphere that the horizon cuts, closed form",
                  .metrics = {"RMS error of irradiance (of a facing plane's)", "worst error"},
                  .work_unit = "samples; a call makes 64 estimates"};
  subject.settings = [](BenchContext&) -> Result<std::vector<Setting>> {
    Luminaire l;
    l.radius = 1, l.power = world::Power3{1, 1, 1} * static_cast<float>(4 * kPi * kPi);  // radiance 1
    std::vector<Setting> settings;
    for (const char* kind : {"omni", "sphere"}) {
      l.kind = kind;
      TRY(LuminaireSampler sampler, LuminaireSampler::make(l));
      const auto lamp = std::make_shared<const LuminaireSampler>(std::move(sampler));
      for (const double h : {1.5, 3.0, 10.0, 100.0})
        for (int count = 1; count <= (l.kind == "omni" ? 1 : 256); count *= 4) {
          Setting s{.method = kind, .setting = fmt::format("{}@{} from {} radii", kind, count, h)};
          s.problem = fmt::format("{} radii", h), s.knob = count;
          s.is_default = l.kind == "sphere" && count == 16, s.stochastic = l.kind == "sphere";
          s.measure = [lamp, h, count](uint64_t seed) { return errors_of(*lamp, h, count, seed); };
          s.run = [lamp, h, count] {
            for (int i = 0; i < kTimedEstimates; ++i) keep(estimate(*lamp, h, 0.5, count, 1));
            return double(kTimedEstimates) * count;
          };
          settings.push_back(std::move(s));
        }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
