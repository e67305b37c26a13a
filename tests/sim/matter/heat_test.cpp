#include <gtest/gtest.h>

#include "tests/sim/matter/heat_support.h"

namespace sim {
namespace {

using world::BlockId;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

constexpr VoxelBox kBox{{0, 0, 0}, {31, 31, 31}};

/// A box filled by a function of the place; around it 30 m of the same air as everywhere.
World world_of(const VoxelBox& box, const std::function<const char*(VoxelPos)>& block) {
  World world(world::standard_blocks());
  world::EditBatch batch;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) batch.set({x, y, z}, block_named(world, block({x, y, z})));
  CHECK(world.store.apply(batch).ok());
  return world;
}

SimKnobs knobs_of(HeatScheme scheme, double dt, int substeps = 0) {
  SimKnobs knobs;
  knobs.heat_scheme = scheme;
  knobs.heat_speed = static_cast<float>(dt * kHeatTicksPerSecond);
  knobs.heat_substeps = substeps;
  knobs.heat_interval = 1;
  return knobs;
}

/// Diffusivity of a block, m^2/s.
double diffusivity(const World& world, const char* name) {
  const world::Block& b = (*world.palette)[block_named(world, name)];
  return b.heat_conductivity.value / (b.density.value * b.heat_capacity.value);
}

const char* patchwork(VoxelPos v) {
  constexpr const char* kNames[] = {"granite", "copper_block", "water", "air", "oak_log", "ice", "lava", "steam"};
  return kNames[world::random_bits(5, v.x >> 1, v.y >> 1, v.z >> 1) % 8];
}

// ---- the kernel --------------------------------------------------------------------------------------------------

void expect_conduction_voxel_by_voxel(const std::function<const char*(VoxelPos)>& block, int side = 16) {
  // Closed all around: what is outside is air, which the dense box must hold too.
  const int all = side + 16;
  const VoxelBox inner{{8, 8, 8}, {side + 7, side + 7, side + 7}};
  World world = world_of(inner, block);
  MatterOptions options;
  options.knobs = knobs_of(HeatScheme::explicit_steps, 400);
  RuleAlone rule(world, "heat", options);
  DenseHeat dense(world, {{0, 0, 0}, {all - 1, all - 1, all - 1}});
  const auto within = [side](uint64_t r) { return static_cast<int>(8 + r % 256 % static_cast<uint64_t>(side)); };
  for (int i = 0; i < 200; ++i) {
    const uint64_t r = world::random_bits(7, i, 0, 0);
    const VoxelPos v{within(r), within(r >> 8), within(r >> 16)};
    const auto heat = static_cast<int32_t>(r >> 40) - (1 << 22);
    rule.set_heat(v, heat);
    dense.heat(v) = heat;
  }
  for (int tick = 0; tick < 8; ++tick) {
    rule.step();
    dense.step(400, static_cast<uint64_t>(tick));
    for (int x = 0; x < all; ++x)
      for (int y = 0; y < all; ++y)
        for (int z = 0; z < all; ++z)
          ASSERT_EQ(rule.heat({x, y, z}), dense.heat({x, y, z})) << tick << ' ' << x << ' ' << y << ' ' << z;
  }
}

TEST(Heat, EqualsConductionVoxelByVoxel) { expect_conduction_voxel_by_voxel(patchwork); }

TEST(Heat, EqualsItHoweverPagesAreSharedOut) {
  // Some 150 pages, in one chunk or several: of two blocks for vectors, and of many.
  const auto layers = [](VoxelPos v) { return v.y % 4 < 2 ? "granite" : "copper_block"; };
  for (const int threads : {1, 2, 8}) {
    const world::ThreadLimit limit(threads);
    for (const world::SimdLevel& level : world::simd_levels()) {
      const world::SimdChoice choice(level);
      SCOPED_TRACE(level.name);
      expect_conduction_voxel_by_voxel(layers, 32);
      expect_conduction_voxel_by_voxel(patchwork, 32);
    }
  }
}

TEST(Heat, EqualsItInPagesOfOneToFourKindsBesideOthers) {
  // Each page has its own choice: what meets at a side are three kinds, or more.
  for (int seed = 0; seed < 6; ++seed)
    expect_conduction_voxel_by_voxel([&](VoxelPos v) {
      constexpr const char* kNames[] = {"granite", "copper_block", "air", "ice"};
      const uint64_t page = world::random_bits(static_cast<uint64_t>(seed), v.x >> 3, v.y >> 3, v.z >> 3);
      const uint64_t pick = world::random_bits(9, v.x, v.y, v.z) % (1 + page % 4);
      return kNames[(page >> 8 >> pick * 8) % 4];
    });
}

TEST(Heat, EnergyIsExactForEveryScheme) {
  for (const HeatScheme scheme : {HeatScheme::limited, HeatScheme::explicit_steps, HeatScheme::implicit}) {
    World world = world_of({{0, 0, 0}, {15, 15, 15}}, patchwork);
    MatterOptions options;
    options.knobs = knobs_of(scheme, scheme == HeatScheme::explicit_steps ? 900 : 20000);
    RuleAlone rule(world, "heat", options);
    rule.set_heat({3, 9, 4}, 123456789);
    rule.set_heat({7, 8, 8}, -2345678);
    const int64_t before = rule.total();
    for (int i = 0; i < 30; ++i) rule.step();
    EXPECT_EQ(rule.total(), before) << static_cast<int>(scheme);
    EXPECT_NE(rule.heat({3, 9, 4}), 123456789);
  }
}

TEST(Heat, AStepForSeveralTicksIsThatOfTheirTime) {
  // Eight ticks of 50 s against one of 400 s, in which nothing happens before the last; bit for bit.
  const auto heats = [](SimKnobs knobs, int interval, int ticks) {
    knobs.heat_interval = interval;
    World world = world_of({{0, 0, 0}, {15, 15, 15}}, patchwork);
    MatterOptions options;
    options.knobs = knobs;
    RuleAlone rule(world, "heat", options);
    rule.set_heat({3, 9, 4}, 123456789);
    rule.set_heat({7, 8, 8}, -2345678);
    for (int i = 0; i < ticks; ++i) rule.step();
    std::vector<int32_t> all;
    for (int x = 0; x < 16; ++x)
      for (int y = 0; y < 16; ++y)
        for (int z = 0; z < 16; ++z) all.push_back(rule.heat({x, y, z}));
    return all;
  };
  for (const HeatScheme scheme : {HeatScheme::limited, HeatScheme::explicit_steps, HeatScheme::implicit}) {
    const SimKnobs often = knobs_of(scheme, 50), seldom = knobs_of(scheme, 400);
    EXPECT_EQ(heats(often, 8, 8), heats(seldom, 1, 1)) << static_cast<int>(scheme);
    EXPECT_EQ(heats(often, 8, 29), heats(seldom, 1, 3)) << static_cast<int>(scheme);
    EXPECT_EQ(heats(often, 8, 7), heats(often, 1, 0)) << static_cast<int>(scheme);
  }
}

TEST(Heat, TheIntervalStopsAtWhatOneStepCanDo) {
  SimKnobs knobs = knobs_of(HeatScheme::explicit_steps, 50);
  for (const double ratio : {0.001, 0.01, 0.05, 0.084, 0.1, 1.0 / 6, 0.5})
    for (const int interval : {1, 2, 8, kMostHeatInterval}) {
      knobs.heat_interval = interval;
      const auto plan = plan_heat(knobs, ratio / 50);
      ASSERT_TRUE(plan.ok());
      EXPECT_GE(plan->interval, 1);
      EXPECT_LE(plan->interval, interval);
      EXPECT_LE(plan->ratio, kLargestStableRatio * (1 + 1e-9));
      EXPECT_NEAR(plan->dt * plan->substeps, 50.0 * plan->interval, 1e-9);
      EXPECT_TRUE(plan->interval == 1 || plan->substeps == 1);
      EXPECT_TRUE(plan->interval == interval || ratio * (plan->interval + 1) > kLargestStableRatio);
    }
  for (const int interval : {0, -1, kMostHeatInterval + 1}) {
    knobs.heat_interval = interval;
    EXPECT_FALSE(plan_heat(knobs, 1e-4).ok());
  }
}

TEST(Heat, TheStateIsTheSameForAnyThreadsAndInstructions) {
  for (const HeatScheme scheme : {HeatScheme::explicit_steps, HeatScheme::implicit}) {
    expect_the_same_for_any_threads_and_instructions([&] {
      World world = world_of({{0, 0, 0}, {23, 23, 23}}, patchwork);
      MatterOptions options;
      options.knobs = knobs_of(scheme, 450);
      RuleAlone rule(world, "heat", options);
      rule.set_heat({12, 12, 12}, 500000000);
      for (int i = 0; i < 12; ++i) rule.step();
      uint64_t hash = 0;
      for (int x = -8; x < 32; ++x)
        for (int y = 0; y < 32; ++y)
          for (int z = -8; z < 32; ++z) hash = world::hash_combine(hash, static_cast<uint64_t>(rule.heat({x, y, z})));
      return hash;
    });
  }
}

TEST(Heat, PrefersNoDirection) {
  // All 48 rotations and mirrors of a cube, about the middle of the box.
  constexpr int kSide = 16;
  const auto run = [&](const std::function<VoxelPos(VoxelPos)>& turn) {
    World world(world::standard_blocks());
    world::EditBatch batch;
    std::map<VoxelPos, int32_t> heats;
    for (int x = 0; x < kSide; ++x)
      for (int y = 0; y < kSide; ++y)
        for (int z = 0; z < kSide; ++z) batch.set(turn({x, y, z}), block_named(world, patchwork({x, y, z})));
    CHECK(world.store.apply(batch).ok());
    MatterOptions options;
    options.knobs = knobs_of(HeatScheme::explicit_steps, 450);
    RuleAlone rule(world, "heat", options);
    for (int i = 0; i < 40; ++i) {
      const uint64_t r = world::random_bits(3, i, 1, 1);
      rule.set_heat(turn({static_cast<int>(r & 15), static_cast<int>(r >> 8 & 15), static_cast<int>(r >> 16 & 15)}),
                    static_cast<int32_t>(r >> 36));
    }
    for (int i = 0; i < 5; ++i) rule.step();
    std::vector<int32_t> all;
    for (int x = 0; x < kSide; ++x)
      for (int y = 0; y < kSide; ++y)
        for (int z = 0; z < kSide; ++z) all.push_back(rule.heat(turn({x, y, z})));
    return all;
  };
  // The floor of the world is 8 below, as the sides are far: the box lies two leaves above it.
  const VoxelPos up{0, 64, 0};
  const std::vector<int32_t> plain = run([&](VoxelPos v) { return v + up; });
  constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (const auto& order : kOrders)
    for (int mirrors = 0; mirrors < 8; ++mirrors) {
      const auto turn = [&](VoxelPos v) {
        const int from[3] = {v.x, v.y, v.z};
        int to[3];
        for (int k = 0; k < 3; ++k) to[k] = mirrors >> k & 1 ? kSide - 1 - from[order[k]] : from[order[k]];
        return VoxelPos{to[0], to[1], to[2]} + up;
      };
      ASSERT_EQ(run(turn), plain) << order[0] << order[1] << order[2] << ' ' << mirrors;
    }
}

TEST(Heat, SleepsOnceNothingFlowsAndWakesForAnEdit) {
  World world = world_of(kBox, [](VoxelPos) { return "granite"; });
  MatterOptions options;
  options.knobs = knobs_of(HeatScheme::explicit_steps, 500);
  RuleAlone rule(world, "heat", options);
  for (int i = 0; i < 4 && !rule.settled(); ++i) rule.step();
  ASSERT_TRUE(rule.settled()) << "nothing is out of rest";
  // 600 units are 5 mK of granite: 100 units a face may still flow to a voxel as warm as rest.
  rule.set_heat({12, 12, 12}, 60000);
  int ticks = 0;
  while (!rule.settled() && ticks < 100000) rule.step(), ++ticks;
  EXPECT_TRUE(rule.settled());
  EXPECT_EQ(rule.total(), 60000);
  EXPECT_EQ(rule.step().leaves_visited, 0u);
  fill(world, {{20, 20, 20}, {20, 20, 20}}, block_named(world, "lava"));
  EXPECT_GT(rule.step().voxels_changed, 0u);
}

TEST(Heat, WhatSleepsEqualsAFullSweep) {
  // Everything awake in every tick, against what finds out by itself; with edits.
  const auto run = [](bool sweep) {
    World world = world_of({{0, 0, 0}, {23, 15, 23}}, [](VoxelPos v) { return v.y < 8 ? "granite" : "air"; });
    MatterOptions options;
    options.knobs = knobs_of(HeatScheme::explicit_steps, 300);
    RuleAlone rule(world, "heat", options);
    for (int i = 0; i < 60; ++i) {
      const uint64_t r = world::random_bits(11, i, 0, 0);
      if (i % 3 == 0)
        fill(world,
             {{static_cast<int>(r % 24), 7, static_cast<int>(r >> 8) & 15},
              {static_cast<int>(r % 24), 7, static_cast<int>(r >> 8) & 15}},
             block_named(world, i % 2 ? "lava" : "iron_block"));
      if (sweep) rule.wake({-1, -1, -1}, {4, 3, 4});
      rule.step();
    }
    std::vector<int32_t> all;
    for (int x = 0; x < 24; ++x)
      for (int y = 0; y < 24; ++y)
        for (int z = 0; z < 24; ++z) all.push_back(rule.heat({x, y, z}));
    return all;
  };
  EXPECT_EQ(run(false), run(true));
}

TEST(Heat, AWorldWithNothingHotRunsNothing) {
  World world = world_of({{0, 0, 0}, {7, 7, 7}}, [](VoxelPos v) { return v.y < 4 ? "sand" : "ice"; });
  Matter matter(world, {});
  for (int i = 0; i < 5; ++i) matter.step();
  for (const EffectReport& e : matter.effects()) {
    if (e.name != "heat" && e.name != "fire" && e.name != "reactions") continue;
    EXPECT_FALSE(e.called_for) << e.name;
    EXPECT_EQ(e.leaves_visited, 0u) << e.name;
    EXPECT_EQ(e.bytes, 0u) << e.name;
  }
}

TEST(Heat, EveryBlockHoldsSixThousandKelvin) {
  ThermalTraits thermal(world::standard_blocks(), {});
  for (size_t id = 0; id < world::standard_blocks().size(); ++id)
    EXPECT_LT(thermal.heat_at(static_cast<BlockId>(id), kFullVoxel, 6000), INT32_MAX)
        << world::standard_blocks()[static_cast<BlockId>(id)].name;
}

// ---- closed forms ------------------------------------------------------------------------------------------------

/// A bar of copper, 8 x 8 voxels thick, in a block that conducts nothing.
World insulated_bar(int length) {
  World world(world::standard_blocks());
  world::Block nothing;
  nothing.name = "insulator";
  nothing.heat_conductivity = world::HeatConductivity{1e-12};
  CHECK(world.palette->add(nothing).ok());
  fill(world, {{-1, -1, -1}, {length, 8, 8}}, block_named(world, "insulator"));
  fill(world, {{0, 0, 0}, {length - 1, 7, 7}}, block_named(world, "copper_block"));
  return world;
}

/// A warm plane in a rod of copper that is `n` voxels long and one leaf wide: worst error against the Gaussian that has
/// spread to `sigma` voxels, relative to its peak.
double gaussian_error(HeatScheme scheme, double ratio, int sigma, int n) {
  World world = insulated_bar(n);
  const double alpha = diffusivity(world, "copper_block"), dt = ratio / alpha;
  MatterOptions options;
  options.knobs = knobs_of(scheme, dt);
  RuleAlone rule(world, "heat", options);
  // Starts as a Gaussian of a third of sigma, so that no error is that of a single warm voxel.
  const double start = sigma / 3.0, peak = 1e8;
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        const double d = x + 0.5 - n / 2;
        rule.set_heat({x, y, z}, static_cast<int32_t>(std::llround(peak * std::exp(-d * d / (2 * start * start)))));
      }
  const int steps = static_cast<int>(std::llround((sigma * sigma - start * start) / (2 * ratio)));
  for (int i = 0; i < steps; ++i) rule.step();
  const double variance = start * start + 2 * ratio * steps;
  double worst = 0;
  for (int x = 0; x < n; ++x) {
    const double d = x + 0.5 - n / 2, expected = peak * start / std::sqrt(variance) * std::exp(-d * d / (2 * variance));
    worst = std::max(worst, std::abs(rule.heat({x, 3, 3}) - expected));
  }
  return worst / (peak * start / std::sqrt(variance));
}

TEST(Heat, AGaussianSpreadsInSecondOrder) {
  // At a fixed r space and time are refined together: the error of explicit Euler with central differences falls by
  // four where the width doubles.
  const double coarse = gaussian_error(HeatScheme::explicit_steps, 0.1, 4, 48);
  const double middle = gaussian_error(HeatScheme::explicit_steps, 0.1, 8, 96);
  const double fine = gaussian_error(HeatScheme::explicit_steps, 0.1, 16, 192);
  std::cout << "gaussian " << coarse << ' ' << middle << ' ' << fine << '\n';
  EXPECT_LT(coarse, 0.02);
  EXPECT_NEAR(std::log2(coarse / middle), 2, 0.25);
  EXPECT_NEAR(std::log2(middle / fine), 2, 0.35);
}

TEST(Heat, ImplicitStepsConvergeInFirstOrderOfTheirLength) {
  const double long_steps = gaussian_error(HeatScheme::implicit, 4, 12, 96);
  const double short_steps = gaussian_error(HeatScheme::implicit, 2, 12, 96);
  std::cout << "implicit " << long_steps << ' ' << short_steps << '\n';
  EXPECT_NEAR(std::log2(long_steps / short_steps), 1, 0.3);
  EXPECT_LT(short_steps, 0.05);
}

TEST(Heat, TwoHalfSpacesMeetAsTheErrorFunction) {
  constexpr int kLength = 128;
  World world = insulated_bar(kLength);
  constexpr double kRatio = 0.125;
  MatterOptions options;
  options.knobs = knobs_of(HeatScheme::explicit_steps, kRatio / diffusivity(world, "copper_block"));
  RuleAlone rule(world, "heat", options);
  constexpr int32_t kHot = 100000000;
  for (int x = 0; x < kLength / 2; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) rule.set_heat({x, y, z}, kHot);
  constexpr int kSteps = 800;
  for (int i = 0; i < kSteps; ++i) rule.step();
  double worst = 0;
  for (int x = 0; x < kLength; ++x) {
    const double d = x + 0.5 - kLength / 2;
    const double expected = kHot / 2.0 * std::erfc(d / std::sqrt(4 * kRatio * kSteps));
    worst = std::max(worst, std::abs(rule.heat({x, 3, 3}) - expected) / kHot);
  }
  std::cout << "erf " << worst << '\n';
  // The scheme's truncation error, h^2 (1 - 6 r) / 24 of the fourth derivative over the time: below
  // (1/4) / (24 * 2 * r * steps) = 1e-4 of the step; half of a voxel's own width beside it.
  EXPECT_LT(worst, 2e-4);
}

TEST(Heat, ABlockThatMeltsStaysAtItsTemperature) {
  ThermalTraits thermal(world::standard_blocks(), {});
  const BlockId ice = world::standard_blocks().find("ice").value();
  const ThermalVoxel v = thermal.voxel(ice);
  const auto at = [&](double kelvin, double mj) {
    return temperature(
        v, static_cast<int32_t>(thermal.heat_at(ice, kFullVoxel, kelvin) + std::llround(mj * 1e6 / kHeatUnitJ)));
  };
  EXPECT_NEAR(static_cast<double>(at(270, 0)), 270 - kRestKelvin, 1e-3);
  EXPECT_NEAR(static_cast<double>(at(273.15, 100)), 273.15 - kRestKelvin, 1e-3);
  EXPECT_NEAR(static_cast<double>(at(273.15, 300)), 273.15 - kRestKelvin, 1e-3);
}

// Each way through the kernel finds the same flows: pages of one to four kinds, beside such pages, walls, and cold
// ones.
TEST(HeatKernel, APageIsTheSameOnAllInstructions) {
  const auto random = [](int n, int k, int what) { return world::random_bits(7, n, k, what); };
  const auto voxel = [](uint64_t k) {
    const ThermalVoxel voxels[] = {{1e-5f, 0, -1e9f, 1e9f, 0.2f, 1e4f},
                                   {3e-5f, 0, -1e9f, 1e9f, 0.004f, 8e3f},
                                   {2e-3f, 5, -40, 700, 3.0f, 60},
                                   {7e-6f, 0, -1e9f, 1e9f, 0.05f, 2e4f}};
    return voxels[k % 4];
  };
  for (int n = 0; n < 300; ++n) {
    struct Page {
      Cells::Heats heats;
      ThermalKinds kinds;
      HeatSource source;
    };
    std::array<Page, 7> pages;
    for (int k = 0; k < 7; ++k) {
      Page& page = pages[static_cast<size_t>(k)];
      const uint64_t what = random(n, k, 0);
      page.source.all = voxel(n % 3 == 0 ? 0 : what >> 8);
      page.source.closed = k > 0 && what % 5 == 0;
      for (size_t i = 0; i < page.heats.size(); ++i)
        page.heats[i] = static_cast<int32_t>(random(n, k, 100 + static_cast<int>(i)) % 2000000) - 500000;
      if (what % 7 != 1) page.source.heat = page.heats.data();
      const uint64_t kinds = n % 3 == 0 ? 1 : what >> 16 & 3;
      if (kinds < 2) continue;
      for (uint64_t m = 0; m < kinds + (n % 10 == 9); ++m) page.kinds.all.push_back(voxel(what >> 8 >> m));
      for (int i = 0; i < world::kLeafVoxels; ++i)
        page.kinds.kind[i] = static_cast<uint16_t>(random(n, k, 1000 + i) % page.kinds.all.size());
      page.kinds.finish();
      page.source.kinds = &page.kinds;
    }
    HeatSource sides[6];
    for (size_t f = 0; f < 6; ++f) sides[f] = pages[f + 1].source;
    const HeatStep step{.scale = n % 4 == 3 ? 1e-7f : 0.5f, .phase = static_cast<float>(n % 64) / 64};
    std::vector<Cells::Heats> after;
    std::vector<HeatResult> results;
    for (const world::SimdLevel& level : world::simd_levels()) {
      const world::SimdChoice choice(level);
      Cells::Heats& heats = after.emplace_back();
      results.push_back(conduct(pages[0].source, sides, step, heats.data()));
      if (!results.back().flows) heats.fill(0);
      EXPECT_EQ(after.back(), after.front()) << level.name << ", page " << n;
      EXPECT_EQ(results.back().flows, results.front().flows) << level.name << ", page " << n;
      EXPECT_EQ(results.back().live, results.front().live) << level.name << ", page " << n;
      EXPECT_EQ(results.back().sides_changed, results.front().sides_changed) << level.name << ", page " << n;
      EXPECT_EQ(results.back().changed, results.front().changed) << level.name << ", page " << n;
    }
  }
}

}  // namespace
}  // namespace sim
