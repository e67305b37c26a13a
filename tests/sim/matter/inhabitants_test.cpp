#include <gtest/gtest.h>

#include "tests/sim/matter/matter_support.h"
#include "world/base/jobs.h"
#include "world/formats/format.h"

namespace sim {
namespace {

using world::ParticleSource;
using world::World;
using world::WorldPoint;

/// A basin of granite, open at the top, whose floor is y = 0.
World walled(int size) {
  World world(world::standard_blocks());
  fill(world, {{-1, -2, -1}, {size, 12, size}}, block_named(world, "granite"));
  fill(world, {{0, 0, 0}, {size - 1, 12, size - 1}}, world::kAir);
  return world;
}
void add_crates(World& world, int count) {
  for (int i = 0; i < count; ++i)
    world.simulation.bodies.push_back({.name = "crate",
                                       .position = WorldPoint::from(4.3 + i % 3 * 2.6, 6 + i * 1.7, 5.1 + i % 2 * 2.3),
                                       .size = {1.2, 0.9, 1.1},
                                       .velocity = {i % 4 - 1.5, 0, i % 3 - 1.0},
                                       .density_kg_per_m3 = 600,
                                       .restitution = 0.2});
}
ParticleSource rain(int size, double mm_per_h) {
  return {.kind = "rain",
          .box = {{0, 30, 0}, {size - 1, 33, size - 1}},
          .per_s = 2000,
          .velocity = {0, -6.5, 0},
          .spread_mps = 0.3,
          .brings = mm_per_h > 0 ? "water" : "",
          .mm_per_h = mm_per_h};
}
const EffectReport& effect(const std::vector<EffectReport>& all, std::string_view name) {
  return *std::find_if(all.begin(), all.end(), [&](const EffectReport& e) { return e.name == name; });
}

TEST(Inhabitants, WhatIsNotAskedForIsNeverMade) {
  World world = walled(16);
  Matter matter(world, {});
  ASSERT_TRUE(matter.begin().ok());
  for (int i = 0; i < 5; ++i) matter.step();
  EXPECT_EQ(matter.bodies(), nullptr);
  EXPECT_EQ(matter.particles(), nullptr);
  const std::vector<EffectReport> effects = matter.effects();
  for (const char* name : {"bodies", "particles", "rainfall"}) {
    const EffectReport& e = effect(effects, name);
    EXPECT_FALSE(e.called_for) << name;
    EXPECT_EQ(e.moved + e.leaves_visited + e.bytes, 0u) << name;
    EXPECT_EQ(e.ms, 0) << name;
  }
}

TEST(Inhabitants, CratesFallOntoSandThatIsFallingAndComeToRest) {
  World world = walled(16);
  fill(world, {{2, 4, 2}, {12, 6, 12}}, block_named(world, "sand"));
  add_crates(world, 8);
  Matter matter(world, {});
  ASSERT_TRUE(matter.begin().ok());
  EXPECT_FALSE(matter.settled());
  int ticks = 0;
  while (!matter.settled() && ticks < 1000) matter.step(), ++ticks;
  ASSERT_TRUE(matter.settled()) << "they sleep";
  EXPECT_LT(ticks, 600);
  for (const Body& body : matter.bodies()->all()) {
    EXPECT_EQ(body.state, BodyState::asleep);
    EXPECT_GE(body.box.min.y, 0);
    EXPECT_LT(body.box.min.y, 14 * kFixedOne);
  }
  // What they stand on goes: they fall with it.
  const int64_t before = matter.bodies()->all()[0].box.min.y;
  matter.flush();
  fill(world, {{0, -1, 0}, {15, 12, 15}}, world::kAir);
  for (int i = 0; i < 200; ++i) matter.step();
  EXPECT_LT(matter.bodies()->all()[0].box.min.y, before);
  const std::vector<EffectReport> effects = matter.effects();
  EXPECT_TRUE(effect(effects, "bodies").called_for);
  EXPECT_GT(effect(effects, "bodies").moved, 100u);
}

TEST(Inhabitants, TheStateIsTheSameForAnyThreadsAndFlushes) {
  std::vector<std::pair<uint64_t, uint64_t>> hashes;
  for (const int threads : {1, 2, 3, 8, -1}) {
    const world::ThreadLimit limit(std::abs(threads));
    World world = walled(24);
    fill(world, {{2, 4, 2}, {12, 8, 12}}, block_named(world, "sand"));
    fill(world, {{14, 0, 14}, {20, 5, 20}}, block_named(world, "water"));
    add_crates(world, 10);
    world.simulation.particles = {rain(24, 30000)};
    Matter matter(world, {.seed = 4});
    ASSERT_TRUE(matter.begin().ok());
    for (int i = 0; i < 150; ++i) {
      matter.step();
      if (threads < 0 && i % 3 == 0) matter.wake_all();
    }
    hashes.emplace_back(matter.state_hash(), matter.particles()->content_hash());
    EXPECT_GT(matter.particles()->size(), 1000u);
  }
  for (const auto& hash : hashes) EXPECT_EQ(hash, hashes[0]);
}

TEST(Inhabitants, RainFillsAHollowWithWhatTheSceneSaysAndNoMore) {
  constexpr int kSize = 20, kTicks = 1000;
  constexpr double kMmPerH = 36000;  // 10 mm/s
  World world = walled(kSize);
  fill(world, {{0, 0, 0}, {kSize - 1, 3, kSize - 1}}, block_named(world, "granite"));
  fill(world, {{5, 1, 5}, {9, 3, 9}}, world::kAir);
  world.simulation.particles = {rain(kSize, kMmPerH)};
  Matter matter(world, {.seed = 2});
  ASSERT_TRUE(matter.begin().ok());
  const world::BlockId water = block_named(world, "water");
  for (int i = 0; i < kTicks; ++i) {
    matter.step();
    if (i % 50 != 0) continue;
    for (const LedgerRow& row : matter.ledger()) ASSERT_TRUE(row.exact()) << row.substance;
  }
  // Within one drop.
  EXPECT_NEAR(static_cast<double>(matter.amount(water)), 0.01 * 400 * (kTicks / 20.0) * kFullVoxel, 64);
  int full = 0;
  for (int x = 5; x <= 9; ++x)
    for (int y = 1; y <= 3; ++y)
      for (int z = 5; z <= 9; ++z) full += matter.amount_at({x, y, z}) > 3000;
  EXPECT_GT(full, 60) << "of 75";
  const auto splash = find_particle_kind(matter.particles()->kinds(), "splash");
  EXPECT_GT(matter.particles()->size(*splash), 0u);
}

// What floats is carried along by water that runs, and lies where it is in water at rest.
TEST(Inhabitants, WaterThatRunsCarriesACrate) {
  const auto way = [](bool runs) {
    World world(world::standard_blocks());
    fill(world, {{-1, -2, -1}, {40, 8, 4}}, block_named(world, "granite"));
    fill(world, {{0, 0, 0}, {39, 8, 3}}, world::kAir);
    fill(world, {{0, 0, 0}, {runs ? 12 : 39, 3, 3}}, block_named(world, "water"));
    world.simulation.bodies = {{"crate", WorldPoint::from(10, 3.6, 2), {0.8, 0.8, 0.8}, {0, 0, 0}, 500}};
    Matter matter(world, {.seed = 2});
    EXPECT_TRUE(matter.begin().ok());
    for (int i = 0; i < 100; ++i) matter.step();
    return from_fixed(matter.bodies()->all()[0].box.min).x - 9.6;
  };
  EXPECT_NEAR(way(false), 0, 1e-9) << "2^-32 voxels";
  EXPECT_GT(way(true), 1.0);
}

TEST(Inhabitants, ACrateThatSleepsInAPuddleFloatsWhenTheLevelRises) {
  World world = walled(12);
  world.simulation.particles = {rain(12, 60000)};  // 1 m in a minute, all of it within one layer of voxels
  world.simulation.bodies = {{"crate", WorldPoint::from(6, 0.2, 6), {0.5, 0.5, 0.5}, {0, 0, 0}, 500}};
  Matter matter(world, {.seed = 2});
  ASSERT_TRUE(matter.begin().ok());
  for (int i = 0; i < 1100; ++i) matter.step();
  const Body& crate = matter.bodies()->all()[0];
  EXPECT_NEAR(from_fixed(crate.box.min.y), 0.917 - 0.25, 0.05) << "half of it is under water of 0.917 m";
}

TEST(Inhabitants, TheRateOverAnyTicksIsThatAskedFor) {
  for (const double rate : {0.0, 0.3, 1.0, 17.77, 100000.5}) {
    uint64_t sum = 0;
    for (uint64_t tick = 0; tick < 5000; ++tick) {
      sum += due_in_tick(rate, tick);
      ASSERT_NEAR(static_cast<double>(sum), rate * static_cast<double>(tick + 1), 1.001);
    }
  }
}

TEST(Inhabitants, WhatCannotBeIsRefusedWithItsName) {
  const auto error_of = [](auto change) {
    World world = walled(8);
    change(world.simulation);
    MatterOptions options;
    options.effects = world.simulation.effects;
    Matter matter(world, options);
    const world::Status begun = matter.begin();
    return begun.ok() ? std::string() : begun.error().message;
  };
  const auto holds = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  holds(error_of([](auto& s) { s.particles = {rain(8, 0)}, s.particles[0].kind = "rian"; }), "mean \"rain\"");
  holds(error_of([](auto& s) { s.particles = {rain(8, 10)}, s.particles[0].brings = "granite"; }), "granite");
  holds(error_of([](auto& s) { s.effects = {"grwoth"}; }), "there is no rule \"grwoth\"");
  holds(error_of([](auto& s) { s.bodies = {{}}, s.bodies[0].name = "a", s.bodies[0].density_kg_per_m3 = -1; }),
        "[[body]] a");
  holds(error_of([](auto& s) { s.bodies = {{}}, s.state = {{"bodies", "0g"}}; }), "hexadecimal");
  holds(error_of([](auto& s) { s.bodies = {{}}, s.state = {{"bodies", "00"}}; }), "bodies");
  for (const char* text :
       {"", "ground", "ground x\n", "ground 0\npiece 1\n", "ground 0\npiece 1 70000\n", "ground 0\nleaf 0 0 0\n",
        "ground 0\npiece 1 1\nleaf 0 0 0 1 1 1 1 1 1 1\n", "ground 0\npiece 1 1\nleaf 999999999 0 0 1 1 1 1 1 1 1 1\n",
        "ground 0\npiece 1 1\nleaf 0 5 0 1 0 0 0 0 0 0 0\n",
        "ground 0\npiece 1 1\nleaf -1 -1 -1 0 0 0 0 0 0 0 8000000000000000\npiece 1 1\n"
        "leaf -1 -1 -1 0 0 0 0 0 0 0 8000000000000000\n"})
    EXPECT_FALSE(error_of([&](auto& s) { s.effects = {"support"}, s.state = {{"support", text}}; }).empty()) << text;
}

}  // namespace
}  // namespace sim
