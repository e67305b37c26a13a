#include <gtest/gtest.h>

#include <map>

#include "sim/matter/plants.h"
#include "tests/sim/matter/heat_support.h"

namespace sim {
namespace {

using world::BlockId;
using world::kAir;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

MatterOptions growing(uint64_t seed = 1) {
  MatterOptions options;
  options.seed = seed;
  options.effects = {"growth"};
  return options;
}
uint64_t count(const World& world, const char* block) {
  const world::Census census = world.store.census();
  const auto found = census.find(block_named(world, block));
  return found == census.end() ? 0 : found->second;
}
template <class Visit>
void for_each_in(const VoxelBox& box, Visit visit) {
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) visit(VoxelPos{x, y, z});
}
int settle(Matter& matter, int most) {
  int ticks = 0;
  while (!matter.settled() && ticks < most) matter.step(), ++ticks;
  EXPECT_TRUE(matter.settled()) << "within " << most << " ticks";
  return ticks;
}
void expect_exact(Matter& matter) {
  for (const LedgerRow& row : matter.ledger()) EXPECT_TRUE(row.exact()) << row.substance;
}

// ---- leaves ------------------------------------------------------------------------------------------------------

const VoxelBox kCanopy{{-14, 3, -9}, {12, 20, 15}};

World canopy() {
  World world(world::standard_blocks());
  world::EditBatch batch;
  for_each_in(kCanopy, [&](VoxelPos v) {
    const uint64_t r = world::random_bits(5, v.x, v.y, v.z);
    if (r % 1000 < 3)
      batch.set(v, block_named(world, (r >> 32) & 1 ? "oak_log" : "pine_log"));
    else if (r % 1000 < 480)
      batch.set(v, block_named(world, (r >> 32) & 1 ? "oak_leaves" : "pine_needles"));
  });
  CHECK(world.store.apply(batch).ok());
  return world;
}

/// Leaves within six steps of a log, found voxel by voxel, with how many.
using Steps = std::map<std::array<int, 3>, int>;
Steps held_leaves(const World& world) {
  Steps steps;
  world::StoreReader reader(world.store);
  std::vector<VoxelPos> front, next;
  for_each_in(kCanopy, [&](VoxelPos v) {
    if (plant_bits((*world.palette)[reader.get(v)]) & plant::log) front.push_back(v);
  });
  for (int step = 1; step <= 6; ++step, front.swap(next), next.clear())
    for (const VoxelPos v : front)
      for (int face = 0; face < 6; ++face) {
        const VoxelPos w = v + world::face_step(face);
        if ((plant_bits((*world.palette)[reader.get(w)]) & plant::leaves) &&
            steps.emplace(std::array{w.x, w.y, w.z}, step).second)
          next.push_back(w);
      }
  return steps;
}

TEST(Growth, ExactlyTheLeavesDecayThatNoLogHolds) {
  World world = canopy();
  const auto held = held_leaves(world);
  const uint64_t before = count(world, "oak_leaves") + count(world, "pine_needles");
  Matter matter(world, growing());
  settle(matter, 5000);
  EXPECT_LT(held.size(), before);
  EXPECT_GT(held.size(), 200u);
  world::StoreReader reader(world.store);
  for_each_in(kCanopy, [&](VoxelPos v) {
    const bool leaves = (plant_bits((*world.palette)[reader.get(v)]) & plant::leaves) != 0;
    EXPECT_EQ(leaves, held.contains({v.x, v.y, v.z})) << v.x << ", " << v.y << ", " << v.z;
  });
  expect_exact(matter);
  // A log is felled: what it alone held goes too.
  VoxelPos felled{};
  for_each_in(kCanopy, [&](VoxelPos v) {
    if (plant_bits((*world.palette)[reader.get(v)]) & plant::log) felled = v;
  });
  fill(world, {felled, felled}, kAir);
  const size_t now_held = held_leaves(world).size();
  EXPECT_LT(now_held, held.size());
  matter.step();
  settle(matter, 5000);
  EXPECT_EQ(count(world, "oak_leaves") + count(world, "pine_needles"), now_held);
}

// ---- trees -------------------------------------------------------------------------------------------------------

/// A field with saplings in it.
World nursery() {
  World world(world::standard_blocks());
  fill(world, {{-20, -2, -20}, {19, -1, 19}}, block_named(world, "dirt"));
  int n = 0;
  for (int x = -15; x <= 15; x += 10)
    for (int z = -15; z <= 15; z += 10) {
      constexpr const char* kSaplings[] = {"oak_sapling", "birch_sapling", "spruce_sapling"};
      fill(world, {{x, 0, z}, {x, 0, z}}, block_named(world, kSaplings[n++ % 3]));
    }
  return world;
}

TEST(Growth, SaplingsBecomeTreesByThemselvesAndNothingElseGrows) {
  World world = nursery();
  fill(world, {{0, -1, 0}, {0, -1, 0}}, block_named(world, "grass"));
  fill(world, {{2, 5, -2}, {4, 6, 4}}, block_named(world, "maple_leaves"));
  Matter matter(world, {});  // nobody asks: the saplings do
  const int ticks = settle(matter, 20000);
  std::printf("16 saplings are trees after %d ticks\n", ticks);
  for (const char* tree : {"oak", "birch", "spruce"})
    EXPECT_EQ(count(world, (std::string(tree) + "_sapling").c_str()), 0u) << tree;
  const auto trees = [&](int k) { return k == 0 ? 6u : 5u; };
  constexpr const char* kLogs[] = {"oak_log", "birch_log", "spruce_log"};
  constexpr uint64_t kLeast[] = {4, 5, 7}, kMost[] = {6, 7, 11};
  for (int k = 0; k < 3; ++k) {
    EXPECT_GE(count(world, kLogs[k]), kLeast[k] * trees(k)) << kLogs[k];
    EXPECT_LE(count(world, kLogs[k]), kMost[k] * trees(k)) << kLogs[k];
  }
  EXPECT_GT(count(world, "oak_leaves"), 100u);
  EXPECT_GT(count(world, "spruce_needles"), 100u);
  EXPECT_EQ(count(world, "grass"), 1u);
  EXPECT_EQ(count(world, "maple_leaves"), 42u);
  expect_exact(matter);
  // Their own leaves hold.
  Matter again(world, growing());
  const uint64_t leaves = count(world, "oak_leaves") + count(world, "spruce_needles") + count(world, "birch_leaves");
  for (int i = 0; i < 400; ++i) again.step();
  again.flush();
  EXPECT_EQ(count(world, "oak_leaves") + count(world, "spruce_needles") + count(world, "birch_leaves"), leaves);
}

TEST(Growth, TheStateIsTheSameForAnyThreadsAndInstructions) {
  expect_the_same_for_any_threads_and_instructions([] {
    World world = nursery();
    fill(world, {{-20, -1, -20}, {-18, -1, 19}}, block_named(world, "grass"));
    Matter matter(world, growing(7));
    for (int i = 0; i < 400; ++i) matter.step();
    const uint64_t hash = matter.state_hash();
    EXPECT_GT(count(world, "oak_log") + count(world, "birch_log"), 5u);
    return hash;
  });
}

// CM11: a run in which all leaves are woken in each tick is the same, with edits under way too.
TEST(Growth, SleepChangesNothing) {
  const auto hash_of = [](bool sweep) {
    World world = canopy();
    fill(world, {{-20, -2, -20}, {19, -1, 19}}, block_named(world, "dirt"));
    fill(world, {{-20, -1, -20}, {-20, -1, -20}}, block_named(world, "grass"));
    RuleAlone rule(world, "growth", growing(9));
    uint64_t hash = 0;
    for (int i = 0; i < 600; ++i) {
      if (sweep) rule.wake({-3, -1, -3}, {3, 3, 3});
      if (i == 250) {
        rule.cells().flush();
        fill(world, {{-14, 3, -9}, {-2, 20, 3}}, kAir);
      }
      rule.step();
      if (i % 100 != 99) continue;
      rule.cells().flush();
      hash = world::hash_combine(hash, world.store.content_hash());
    }
    return hash;
  };
  EXPECT_EQ(hash_of(false), hash_of(true));
}

// ---- light and water ---------------------------------------------------------------------------------------------

World garden(bool roof) {
  World world(world::standard_blocks());
  fill(world, {{-12, -3, -12}, {11, -1, 11}}, block_named(world, "dirt"));
  fill(world, {{-12, -1, -12}, {-12, -1, -12}}, block_named(world, "grass"));
  fill(world, {{-4, -1, 0}, {3, -1, 0}}, block_named(world, "water"));
  fill(world, {{0, 0, 1}, {0, 0, 1}}, block_named(world, "reed"));
  fill(world, {{6, 0, 6}, {6, 0, 6}}, block_named(world, "reed"));  // dry
  fill(world, {{-3, -1, 1}, {-3, -1, 8}}, block_named(world, "farmland"));
  fill(world, {{-3, 0, 1}, {-3, 0, 1}}, block_named(world, "wheat"));
  fill(world, {{9, 0, -9}, {9, 0, -9}}, block_named(world, "birch_sapling"));
  if (roof) fill(world, {{-12, 30, -12}, {11, 30, 11}}, block_named(world, "granite"));
  return world;
}

TEST(Growth, InLightGrassCoversTheDirtAndReedsAndWheatGrowWhereWaterIsNear) {
  World world = garden(false);
  Matter matter(world, growing());
  const int ticks = settle(matter, 60000);
  std::printf("a garden has grown after %d ticks\n", ticks);
  EXPECT_EQ(count(world, "reed"), 4u) << "three by the water, and the dry one";
  EXPECT_EQ(world.store.get({0, 2, 1}), block_named(world, "reed"));
  EXPECT_EQ(count(world, "wheat"), 4u) << "up to four voxels from the water";
  int dirt_under_air = 0;
  for_each_in({{-12, -1, -12}, {11, -1, 11}}, [&](VoxelPos v) {
    dirt_under_air +=
        world.store.get(v) == block_named(world, "dirt") && world.store.get(v + VoxelPos{0, 1, 0}) == kAir;
  });
  EXPECT_EQ(dirt_under_air, 0);
  EXPECT_GT(count(world, "birch_log"), 4u);
  expect_exact(matter);
}

TEST(Growth, NothingGrowsInTheDark) {
  World world = garden(true);
  Matter matter(world, growing());
  for (int i = 0; i < 200; ++i) matter.step();  // the water settles
  matter.flush();
  const world::Census before = world.store.census();
  for (int i = 0; i < 3000; ++i) matter.step();
  matter.flush();
  EXPECT_EQ(world.store.census(), before);
  // A hole in the roof lets it go on.
  fill(world, {{-12, 30, -12}, {-8, 30, -8}}, kAir);
  for (int i = 0; i < 3000; ++i) matter.step();
  matter.flush();
  EXPECT_GT(count(world, "grass"), 15u);
  EXPECT_LE(count(world, "grass"), 25u) << "5 x 5 under the hole";
}

// X2.
TEST(Growth, WhereNobodyAsksNoLeafIsVisited) {
  World world = garden(false);
  fill(world, {{9, 0, -9}, {9, 0, -9}}, kAir);  // the sapling
  fill(world, {{-9, 5, -9}, {9, 7, 9}}, block_named(world, "oak_leaves"));
  Matter matter(world, {});
  for (int i = 0; i < 400; ++i) matter.step();
  for (const EffectReport& effect : matter.effects())
    if (effect.name == "growth" || effect.name == "evaporation") {
      EXPECT_FALSE(effect.called_for);
      EXPECT_EQ(effect.leaves_visited + effect.bytes, 0u);
    }
  EXPECT_TRUE(matter.settled());
}

// ---- evaporation -------------------------------------------------------------------------------------------------

TEST(Evaporation, APondLosesFiveMillimetresADayAndEveryUnitIsBooked) {
  World world = basin({{0, 0, 0}, {19, 3, 19}});
  const BlockId water = block_named(world, "water");
  fill(world, {{0, 0, 0}, {19, 0, 19}}, water);
  MatterOptions options;
  options.effects = {"evaporation"};
  Matter matter(world, options);
  const int64_t before = matter.amount(water);
  constexpr int kTicks = 4320;  // three days, of 1200 s in a second
  for (int i = 0; i < kTicks; ++i) matter.step();
  const auto lost_m = static_cast<double>(before - matter.amount(water)) / kFullVoxel / 400;
  // Drawn: 61 units a voxel, of 400 voxels; 4 standard deviations are under a percent.
  EXPECT_NEAR(lost_m, 0.015, 0.0002);
  expect_exact(matter);
}

TEST(Evaporation, WarmWaterSteamsAndPaysForIt) {
  World world = basin({{0, 0, 0}, {7, 7, 7}});
  const BlockId water = block_named(world, "water"), steam = block_named(world, "steam");
  fill(world, {{0, 0, 0}, {7, 0, 7}}, water);
  RuleAlone rule(world, "evaporation");
  const ThermalTraits thermal(*world.palette, {});
  for (int x = 0; x < 8; ++x)
    for (int z = 0; z < 8; ++z) rule.set_heat({x, 0, z}, static_cast<int32_t>(thermal.heat_at(water, kFullVoxel, 353)));
  const int64_t before = rule.total();
  for (int i = 0; i < 16; ++i) rule.step();
  const Cells::Booked out = rule.cells().booked(water), in = rule.cells().booked(steam);
  EXPECT_GT(out.out, 64);
  EXPECT_NEAR(static_cast<double>(in.in) / static_cast<double>(out.out), 998.0 / 0.6, 2);
  // The latent heat of what went, and what the steam holds beyond air at rest.
  double steams = 0;
  for (int x = 0; x < 8; ++x)
    for (int z = 0; z < 8; ++z) {
      const PageId p = rule.cells().find({0, 0, 0});
      const Cell cell = rule.cells().cell(p, world::index_in_leaf({x, 1, z}));
      if (cell.block == steam)
        steams += static_cast<double>(thermal[steam].born) * thermal.capacity(steam, cell.amount) -
                  static_cast<double>(thermal[kAir].born);
    }
  const double latent = 2252.486e6 / kHeatUnitJ * static_cast<double>(out.out) / kFullVoxel;
  EXPECT_NEAR(static_cast<double>(before - rule.total()), latent + steams, 64 * 2);
}

TEST(Evaporation, NoPondDriesWhereNobodyAsks) {
  World world = basin({{0, 0, 0}, {7, 3, 7}});
  fill(world, {{0, 0, 0}, {7, 0, 7}}, block_named(world, "water"));
  Matter matter(world, {});
  for (int i = 0; i < 600; ++i) matter.step();
  EXPECT_EQ(matter.amount(block_named(world, "water")), 64 * kFullVoxel);
}

}  // namespace
}  // namespace sim
