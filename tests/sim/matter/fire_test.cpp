#include <gtest/gtest.h>

#include "sim/matter/fuels.h"
#include "tests/sim/matter/heat_support.h"
#include "world/base/jobs.h"

namespace sim {
namespace {

using world::VoxelPos;
using world::World;

/// A wall of a block on a floor, with a flame at its foot.
World wall_of(const char* block, int length) {
  World world(world::standard_blocks());
  fill(world, {{-4, -1, -4}, {length + 4, 0, 4}}, block_named(world, "granite"));
  fill(world, {{0, 1, 0}, {length - 1, 3, 0}}, block_named(world, block));
  fill(world, {{0, 1, 1}, {0, 1, 1}}, block_named(world, "fire"));
  return world;
}
uint64_t count(World& world, RuleAlone& rule, const char* block) {
  rule.cells().flush();
  const world::Census census = world.store.census();
  const auto found = census.find(block_named(world, block));
  return found == census.end() ? 0 : found->second;
}
MatterOptions by(FireModel model, uint64_t seed = 1) {
  MatterOptions options;
  options.seed = seed;
  options.knobs.fire_model = model;
  return options;
}

TEST(Fire, SpreadsAlongAWallAndBurnsItDown) {
  for (const FireModel model : {FireModel::chance, FireModel::heat}) {
    World world = wall_of("oak_planks", 8);
    RuleAlone rule(world, "fire", by(model, 3));
    uint64_t flames = 0;
    int ticks = 0;
    for (; ticks < 20000 && !rule.settled(); ++ticks) {
      rule.step();
      if (ticks % 50 == 0) flames = std::max(flames, count(world, rule, "fire"));
    }
    EXPECT_TRUE(rule.settled()) << static_cast<int>(model);
    // By chance a plank may be left that no flame touches any more.
    EXPECT_LE(count(world, rule, "oak_planks"), model == FireModel::chance ? 2u : 0u);
    EXPECT_EQ(count(world, rule, "fire"), 0u) << static_cast<int>(model);
    EXPECT_GT(flames, 4u) << static_cast<int>(model);
    std::cout << "wall of 24 planks burnt in " << ticks << " ticks, most flames " << flames << '\n';
  }
}

TEST(Fire, StoneDoesNotBurn) {
  for (const FireModel model : {FireModel::chance, FireModel::heat}) {
    World world = wall_of("granite", 8);
    RuleAlone rule(world, "fire", by(model));
    for (int i = 0; i < 2000; ++i) rule.step();
    EXPECT_EQ(count(world, rule, "fire"), 0u);
    EXPECT_TRUE(rule.settled());
  }
}

TEST(Fire, AFuelGivesTheEnergyOfItsMassAndLeavesAsh) {
  // One voxel, warm enough, in the air, on nothing that conducts here.
  World world(world::standard_blocks());
  fill(world, {{0, 0, 0}, {7, 0, 7}}, block_named(world, "granite"));
  fill(world, {{4, 1, 4}, {4, 1, 4}}, block_named(world, "oak_log"));
  fill(world, {{0, 5, 0}, {0, 5, 0}}, block_named(world, "fire"));  // calls for the rule, too far off to light it
  RuleAlone rule(world, "fire", by(FireModel::heat));
  ThermalTraits thermal(*world.palette, {});
  rule.set_heat({4, 1, 4}, static_cast<int32_t>(thermal.heat_at(block_named(world, "oak_log"), kFullVoxel, 700)));
  std::string note;
  int ticks = 0;
  while (count(world, rule, "oak_log") > 0 && ticks < 2000) {
    ++ticks;
    const RuleReport report = rule.step();
    if (!report.notes.empty()) note = report.notes[0];
  }
  EXPECT_EQ(count(world, rule, "ash"), 1u);
  // Twelve hours of 60 s a tick; 65536 parts of the fuel, of which a tick takes 91.
  EXPECT_EQ(ticks, 721);
  const double expected = 16.0 * 740;  // MJ/kg, kg
  EXPECT_NEAR(std::stod(note), expected, 0.002 * expected) << note;
}

TEST(Fire, NeedsAirBesideIt) {
  World world(world::standard_blocks());
  fill(world, {{0, 0, 0}, {15, 15, 15}}, block_named(world, "granite"));
  fill(world, {{4, 4, 4}, {6, 6, 6}}, block_named(world, "oak_log"));
  fill(world, {{12, 12, 12}, {12, 12, 12}}, block_named(world, "lava"));
  RuleAlone rule(world, "fire", by(FireModel::heat));
  ThermalTraits thermal(*world.palette, {});
  const auto hot = static_cast<int32_t>(thermal.heat_at(block_named(world, "oak_log"), kFullVoxel, 800));
  for (int x = 4; x <= 6; ++x) rule.set_heat({x, 5, 5}, hot);
  for (int i = 0; i < 900; ++i) rule.step();
  EXPECT_EQ(count(world, rule, "oak_log"), 27u);
  fill(world, {{3, 5, 5}, {3, 5, 5}}, world::kAir);
  for (int i = 0; i < 900; ++i) rule.step();
  EXPECT_LT(count(world, rule, "oak_log"), 27u);
}

TEST(Fire, FuelsBurnAlikeInALeafOfManyBlocks) {
  const char* colours[] = {"red", "orange", "yellow", "green", "blue", "purple", "white", "grey", "black"};
  const auto burn = [&](bool many) {
    World world(world::standard_blocks());
    for (int n = 0; n < 18; ++n) {
      const std::string name = std::string(n < 9 ? "concrete_" : "terracotta_") + colours[many ? n % 9 : 0];
      fill(world, {{0, n % 8, n / 8}, {0, n % 8, n / 8}}, block_named(world, many ? name : "concrete_red"));
    }
    fill(world, {{3, 0, 0}, {5, 3, 7}}, block_named(world, "oak_leaves"));
    fill(world, {{4, 0, 0}, {4, 3, 7}}, block_named(world, "birch_log"));
    fill(world, {{3, 4, 4}, {3, 4, 4}}, block_named(world, "fire"));
    RuleAlone rule(world, "fire", by(FireModel::heat, 5));
    std::vector<int64_t> state;
    for (int i = 0; i < 300; ++i) {
      rule.step();
      if (i % 20 == 0) state.push_back(rule.total());
    }
    for (const char* block : {"fire", "oak_leaves", "birch_log", "ash"})
      state.push_back(static_cast<int64_t>(count(world, rule, block)));
    return state;
  };
  const std::vector<int64_t> few = burn(false);
  EXPECT_EQ(burn(true), few);
  EXPECT_LT(few[few.size() - 3], 64);  // leaves
}

TEST(Fire, LavaLightsWhatIsBesideItAndCoolsByThat) {
  World world(world::standard_blocks());
  fill(world, {{0, 0, 0}, {7, 0, 7}}, block_named(world, "granite"));
  fill(world, {{3, 1, 3}, {3, 1, 3}}, block_named(world, "lava"));
  fill(world, {{4, 1, 3}, {4, 1, 3}}, block_named(world, "oak_planks"));
  RuleAlone rule(world, "fire", by(FireModel::heat));
  rule.step();
  EXPECT_LT(rule.heat({3, 1, 3}), 0);
  EXPECT_EQ(rule.heat({3, 1, 3}), -rule.heat({4, 1, 3}));
  for (int i = 0; i < 200; ++i) rule.step();
  EXPECT_GT(count(world, rule, "fire"), 0u);
}

TEST(Fire, TheStateIsTheSameForAnyThreadsAndSleep) {
  for (const FireModel model : {FireModel::chance, FireModel::heat}) {
    std::vector<uint64_t> hashes;
    for (const int threads : {1, 2, 3, 8, -2}) {
      const world::ThreadLimit limit(std::abs(threads));
      World world = wall_of("oak_leaves", 30);
      fill(world, {{8, 4, -3}, {22, 9, 3}}, block_named(world, "birch_leaves"));
      RuleAlone rule(world, "fire", by(model, 8));
      for (int i = 0; i < 400; ++i) {
        if (threads < 0) rule.wake({-1, -1, -1}, {4, 3, 4});
        rule.step();
      }
      rule.cells().flush();
      hashes.push_back(world::hash_combine(world.store.content_hash(), static_cast<uint64_t>(rule.total())));
    }
    for (const uint64_t hash : hashes) EXPECT_EQ(hash, hashes[0]) << static_cast<int>(model);
  }
}

TEST(Fire, AllRulesTogetherBurnAHouseAndComeToRest) {
  World world(world::standard_blocks());
  fill(world, {{-4, -2, -4}, {12, -1, 12}}, block_named(world, "granite"));
  fill(world, {{0, 0, 0}, {8, 5, 8}}, block_named(world, "oak_planks"));
  fill(world, {{1, 0, 1}, {7, 4, 7}}, world::kAir);
  fill(world, {{4, 0, 0}, {4, 1, 0}}, world::kAir);
  fill(world, {{1, 0, 4}, {1, 0, 4}}, block_named(world, "fire"));
  Matter matter(world, {});
  for (int i = 0; i < 6000; ++i) matter.step();
  matter.flush();
  const world::Census census = world.store.census();
  const auto left = census.find(block_named(world, "oak_planks"));
  EXPECT_LT(left == census.end() ? 0u : left->second, 60u);
  for (const LedgerRow& row : matter.ledger()) EXPECT_TRUE(row.exact()) << row.substance;
  // Ash falls: what rules make calls for the rules of it.
  for (const EffectReport& e : matter.effects())
    if (e.name == "granular") {
      EXPECT_GT(e.voxels_changed, 0u);
    }
  const auto ash = census.find(block_named(world, "ash"));
  EXPECT_GT(ash == census.end() ? 0u : ash->second, 100u);
}

}  // namespace
}  // namespace sim
