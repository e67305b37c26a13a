/// How well N samples of a square lamp give the light of a floor under it, by how the samples are chosen.
///
/// The lamp is 1 m wide, 1 m above the floor, which it faces; the point lies under its centre. By area: uniform points
/// of the lamp, the chapter's randomPoint. By solid angle: uniform directions, what Loam samples. The omni in its stead
/// has the lamp's radiant intensity along its axis.
#include <algorithm>
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
using world::Vec2f;
using world::Vec3d;

constexpr double kPi = 3.14159265358979323846;
constexpr int kRepeats = 64;  // estimates whose mean square is one measurement: its own noise is 9 %
constexpr int kTimedEstimates = 64;

enum class Points { random, stratified, r2, midpoint };

/// Point `i` of `count`, a square number; `seed` moves it, but not a midpoint.
Vec2f point(Points points, int i, int count, uint64_t seed) {
  constexpr double kLast = 1 - 0x1p-24;
  const auto random = [&](uint64_t salt) {
    return world::uniform01_double(world::random_bits(seed, points == Points::r2 ? 0 : i, 0, 0, 0, salt));
  };
  const int side = static_cast<int>(std::lround(std::sqrt(count)));
  double x = random(0), y = random(1);
  if (points == Points::stratified) x = (i % side + x) / side, y = (i / side + y) / side;
  if (points == Points::midpoint) x = (i % side + 0.5) / side, y = (i / side + 0.5) / side;
  // source: Martin Roberts. The Unreasonable Effectiveness of Quasirandom Sequences. 2018; moved as a whole by the seed
  if (points == Points::r2) x += 0.75487766624669276 * i, y += 0.56984029099805327 * i;
  return {static_cast<float>(std::min(x - std::floor(x), kLast)),
          static_cast<float>(std::min(y - std::floor(y), kLast))};
}

double estimate(const LuminaireSampler& lamp, Points points, int count, uint64_t seed) {
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    const world::LuminaireSample s = lamp.sample({0, -1, 0}, point(points, i, count, seed));
    sum += s.biradiance.g * std::max(double{s.direction.y}, 0.0);
  }
  return sum / count;
}

ErrorSample error_of(const LuminaireSampler& lamp, Points points, int count, uint64_t seed, double exact) {
  double squares = 0, sum = 0, largest = 0;
  for (int i = 0; i < kRepeats; ++i) {
    const double error = estimate(lamp, points, count, world::hash_combine(seed, static_cast<uint64_t>(i))) / exact - 1;
    squares += error * error, sum += error, largest = std::max(largest, std::abs(error));
  }
  return {{std::sqrt(squares / kRepeats), largest}, sum / kRepeats};
}

Result<std::shared_ptr<const LuminaireSampler>> made(const Luminaire& luminaire) {
  TRY(LuminaireSampler sampler, LuminaireSampler::make(luminaire));
  return std::shared_ptr<const LuminaireSampler>(std::make_shared<LuminaireSampler>(std::move(sampler)));
}

}  // namespace

void add_subject_area_light_samples(Registry& registry) {
  Subject subject{.question = "how many samples of an area light does a point need, and chosen how?",
                  .reference = "form factor of a square over a parallel plane, closed form (0.23946)",
                  .metrics = {"RMS error of irradiance (relative)", "largest error (relative)"},
                  .work_unit = "samples; a call makes 64 estimates"};
  for (const char* by : {"area", "solid angle"}) {
    subject.expected_slopes[fmt::format("random by {}", by)] = {-0.5, 4};
    for (const char* points : {"stratified", "R2", "midpoint"})
      subject.expected_slopes[fmt::format("{} by {}", points, by)] = {-1, 16};
  }
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    const double a = 0.5 / std::sqrt(1.25), exact = 4 * a * std::atan(a);  // of radiance 1
    std::vector<Setting> settings;
    for (const bool by_area : {true, false}) {
      Luminaire lamp;
      lamp.kind = "rectangle", lamp.radiance = {1, 1, 1}, lamp.uniform_area = by_area;
      TRY(const std::shared_ptr<const LuminaireSampler> sampler, made(lamp));
      for (const auto& [points, name] : {std::pair{Points::random, "random"},
                                         {Points::stratified, "stratified"},
                                         {Points::r2, "R2"},
                                         {Points::midpoint, "midpoint"}})
        for (int count = 1; count <= (context.quick() ? 1024 : 4096); count *= 4) {
          const std::string method = fmt::format("{} by {}", name, by_area ? "area" : "solid angle");
          Setting s{.method = method, .setting = fmt::format("{}@{}", method, count)};
          s.knob = count;
          s.is_default = points == Points::r2 && !by_area && count == 16;
          s.stochastic = points != Points::midpoint;
          s.measure = [sampler, points = points, count, exact](uint64_t seed) {
            return error_of(*sampler, points, count, seed, exact);
          };
          s.run = [sampler, points = points, count] {
            for (int i = 0; i < kTimedEstimates; ++i) keep(estimate(*sampler, points, count, static_cast<uint64_t>(i)));
            return double(kTimedEstimates) * count;
          };
          settings.push_back(std::move(s));
        }
    }
    Luminaire omni;
    omni.kind = "omni", omni.radius = 0.01f, omni.power = world::Power3{1, 1, 1} * static_cast<float>(4 * kPi);
    TRY(const std::shared_ptr<const LuminaireSampler> sampler, made(omni));
    Setting s{.method = "omni", .setting = "omni@1"};
    s.knob = 1;
    s.measure = [sampler, exact](uint64_t seed) { return error_of(*sampler, Points::midpoint, 1, seed, exact); };
    s.run = [sampler] {
      for (int i = 0; i < kTimedEstimates; ++i) keep(estimate(*sampler, Points::midpoint, 1, 0));
      return double(kTimedEstimates);
    };
    settings.push_back(std::move(s));
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
