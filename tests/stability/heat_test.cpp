/// Hard cases of conduction and reactions: CM4, CM10, CM11, CM15, CM16. The rest of the bounds' claims:
/// tests/sim/matter.
#include <gtest/gtest.h>

#include "sim/matter/reaction_rows.h"
#include "tests/sim/matter/heat_support.h"

namespace sim {
namespace {

using world::World;

/// Worst and best temperature (K above rest) after the steps, of a warm checkerboard, which the explicit scheme drives
/// hardest.
struct Extremes {
  double lowest = 0, highest = 0;
};
Extremes checkerboard(const SimKnobs& knobs, int ticks) {
  World world(world::standard_blocks());
  fill(world, {{0, 0, 0}, {15, 15, 15}}, block_named(world, "copper_block"));
  MatterOptions options;
  options.knobs = knobs;
  RuleAlone rule(world, "heat", options);
  ThermalTraits thermal(*world.palette, {});
  const ThermalVoxel copper = thermal.voxel(block_named(world, "copper_block"));
  for (int x = 0; x < 16; ++x)
    for (int y = 0; y < 16; ++y)
      for (int z = 0; z < 16; ++z) rule.set_heat({x, y, z}, (x + y + z) & 1 ? 100000000 : 0);
  Extremes e;
  for (int i = 0; i < ticks; ++i) {
    rule.step();
    for (int x = 0; x < 16; ++x)
      for (int z = 0; z < 16; ++z) {
        const double t = static_cast<double>(temperature(copper, rule.heat({x, 7, z})));
        e.lowest = std::min(e.lowest, t), e.highest = std::max(e.highest, t);
      }
  }
  return e;
}

TEST(HardCases, CM4DiffusionKeepsTheMaximumPrincipleUpToOneSixth) {
  const double alpha = ThermalTraits(world::standard_blocks(), {}).largest_diffusivity();
  const auto knobs = [&](double ratio, HeatScheme scheme, int substeps) {
    SimKnobs k;
    k.heat_scheme = scheme;
    k.heat_speed = static_cast<float>(ratio / alpha * kHeatTicksPerSecond);
    k.heat_substeps = substeps;
    k.heat_interval = 1;
    return k;
  };
  const ThermalTraits thermal(world::standard_blocks(), {});
  const double hot =
      1e8 * static_cast<double>(thermal.voxel(world::standard_blocks().find("copper_block").value()).inverse);
  // One ulp of a float at these temperatures.
  const double ulp = hot * 0x1p-23;
  for (const double ratio : {1.0 / 6 - 1e-7, 1.0 / 6 + 1e-3, 0.17, 0.2, 5.0}) {
    for (const HeatScheme scheme : {HeatScheme::explicit_steps, HeatScheme::limited}) {
      const Extremes e = checkerboard(knobs(ratio, scheme, 0), ratio == 0.2 && scheme == HeatScheme::limited ? 2000
                                                               : ratio > 1                                   ? 20
                                                                                                             : 100);
      EXPECT_GE(e.lowest, -ulp) << ratio;
      EXPECT_LE(e.highest, hot + ulp) << ratio;
    }
  }
}

TEST(HardCases, CM4SubstepsThatAreTooFewAreRefused) {
  constexpr double kAlpha = 1e-4;
  const auto plan = [&](double ratio, int substeps, HeatScheme scheme = HeatScheme::explicit_steps) {
    SimKnobs knobs;
    knobs.heat_scheme = scheme;
    knobs.heat_speed = static_cast<float>(ratio / kAlpha * kHeatTicksPerSecond);
    knobs.heat_substeps = substeps;
    return plan_heat(knobs, kAlpha);
  };
  EXPECT_TRUE(plan(1.0 / 6 - 1e-7, 1).ok());
  for (const double ratio : {1.0 / 6 + 1e-3, 0.17, 0.2}) {
    const auto refused = plan(ratio, 1);
    ASSERT_FALSE(refused.ok()) << ratio;
    EXPECT_NE(refused.error().message.find("above 1/6"), std::string::npos);
    // Left alone, as many steps as keep r at or below it.
    const auto allowed = plan(ratio, 0);
    ASSERT_TRUE(allowed.ok());
    EXPECT_EQ(allowed->substeps, 2);
    EXPECT_LE(allowed->ratio, kLargestStableRatio);
    EXPECT_TRUE(plan(ratio, 1, HeatScheme::implicit).ok());
  }
  EXPECT_FALSE(plan(1e6, 0).ok()) << "more substeps than are allowed";
}

TEST(HardCases, CM4WithoutLimitOrSubstepsItBlowsUp) {
  // The control: the same scheme in doubles at r = 1/6 + 0.001 leaves all bounds within 2000 steps; at 1/6 it keeps
  // them. So the case can fail.
  const auto worst = [](double r) {
    constexpr int kSide = 8;
    std::vector<double> t(kSide * kSide * kSide), next(t.size());
    const auto at = [](int x, int y, int z) {
      return static_cast<size_t>(((x & 7) * kSide + (y & 7)) * kSide + (z & 7));
    };
    for (int x = 0; x < kSide; ++x)
      for (int y = 0; y < kSide; ++y)
        for (int z = 0; z < kSide; ++z) t[at(x, y, z)] = (x + y + z) & 1;
    for (int n = 0; n < 2000; ++n) {
      for (int x = 0; x < kSide; ++x)
        for (int y = 0; y < kSide; ++y)
          for (int z = 0; z < kSide; ++z)
            next[at(x, y, z)] = t[at(x, y, z)] +
                                r * (t[at(x + 1, y, z)] + t[at(x - 1, y, z)] + t[at(x, y + 1, z)] + t[at(x, y - 1, z)] +
                                     t[at(x, y, z + 1)] + t[at(x, y, z - 1)] - 6 * t[at(x, y, z)]);
      t.swap(next);
    }
    return *std::max_element(t.begin(), t.end());
  };
  EXPECT_LE(worst(1.0 / 6), 1.0 + 1e-9);
  EXPECT_GT(worst(1.0 / 6 + 1e-3), 1e6);
}

TEST(HardCases, CM15HeatThatDoesNotFitIsClampedAndAccounted) {
  ReactionRows rows(world::standard_blocks(), {});
  const auto fire = world::standard_blocks().find("fire").value(),
             water = world::standard_blocks().find("water").value();
  for (const ReactionRow& row : rows.rows()) {
    if (row.a != fire || row.b != water) continue;
    Cell c, d;
    const Cell a{.block = fire, .amount = kFullVoxel, .heat = INT32_MAX},
        b{.block = water, .amount = kFullVoxel, .heat = INT32_MAX};
    const int64_t lost = rows.react(row, a, b, 1, c, d);
    EXPECT_GT(lost, 0);
    EXPECT_GT(c.heat, 0);
    EXPECT_GT(d.heat, 0);
    const int64_t born = rows.thermal().heat_at(fire, kFullVoxel, kRestKelvin),
                  after = rows.thermal().heat_at(c.block, kFullVoxel, kRestKelvin);
    EXPECT_EQ(static_cast<int64_t>(a.heat) + b.heat - born, static_cast<int64_t>(c.heat) + d.heat - after + lost);
    return;
  }
  FAIL() << "no row of fire and water";
}

}  // namespace
}  // namespace sim
