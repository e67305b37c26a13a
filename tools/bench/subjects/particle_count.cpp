/// How many particles rain needs to look even: the density in each square of 8 m against that of endless drops.
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "sim/bodies/particles.h"
#include "tools/bench/benchmark.h"

namespace tools {

namespace {

using sim::Particles;
using world::Vec3d;

constexpr int kSide = 256, kSquare = 8, kSquares = kSide / kSquare;

std::shared_ptr<Particles> rain_of(const world::Store& store, int count, uint64_t seed) {
  auto rain = std::make_shared<Particles>(store, sim::particle_kinds(), static_cast<size_t>(count), seed);
  const int kind = *sim::find_particle_kind(sim::particle_kinds(), "rain");
  rain->spawn_in(kind, {{0, 0, 0}, {kSide - 1, 63, kSide - 1}}, count, {0, -6.5, 0}, 0, {});
  return rain;
}

/// What a call goes on with.
struct Shower {
  std::shared_ptr<Particles> rain;
  int calls = 0;
};

/// Root mean square and mean of the relative error of the density; the worst square's.
ErrorSample unevenness(const Particles& rain) {
  std::array<int, kSquares * kSquares> drops{};
  for (size_t k = 0; k < rain.kinds().size(); ++k)
    for (const uint32_t b : rain.blocks(static_cast<int>(k))) {
      const sim::ParticleBlock& block = rain.block(b);
      for (int i = 0; i < block.count; ++i) {
        const int x = (block.at[0][i] >> sim::kParticleFixedLog2) / kSquare;
        const int z = (block.at[2][i] >> sim::kParticleFixedLog2) / kSquare;
        ++drops[static_cast<size_t>(x * kSquares + z)];
      }
    }
  const double mean = static_cast<double>(rain.size()) / drops.size();
  double squares = 0, sum = 0, worst = 0;
  for (const int n : drops) {
    const double error = n / mean - 1;
    squares += error * error, sum += error, worst = std::max(worst, std::abs(error));
  }
  return {{std::sqrt(squares / drops.size()), worst}, sum / drops.size()};
}

}  // namespace

void add_subject_particle_count(Registry& registry) {
  Subject subject{.question = "how many drops make rain even?",
                  .reference = "closed form: the same density everywhere, of endless drops",
                  .metrics = {"density of a square of 8 m (RMS of relative error)", "the worst square"},
                  .work_unit = "particle steps; a call is 10 steps",
                  .knob_unit = "particles"};
  subject.threads = 0;
  subject.expected_slopes = {{"rain over 256 m x 256 m", {-0.5, 1000}}};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    const auto air =
        context.shared<world::World>("particle_count/air", [] { return std::make_shared<world::World>(); });
    std::vector<Setting> settings;
    for (const int count : {4096, 16384, 65536, 262144, 1048576}) {
      if (context.quick() && count > 65536) continue;
      Setting s{.method = "rain over 256 m x 256 m", .setting = fmt::format("rain@{}", count)};
      s.knob = count, s.stochastic = true;
      s.is_default = count == (context.quick() ? 65536 : 1048576);
      s.measure = [=](uint64_t seed) { return unevenness(*rain_of(air->store, count, seed)); };
      const auto shower = std::make_shared<Shower>();
      s.run = [=] {
        // Made at the first call; drops live for 20 s at least, and are made anew after 15 s.
        constexpr int kSteps = 10;
        if (shower->calls++ % 90 == 0) shower->rain = rain_of(air->store, count, 1);
        for (int i = 0; i < kSteps; ++i) shower->rain->step({});
        return static_cast<double>(count) * kSteps;
      };
      settings.push_back(std::move(s));
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
