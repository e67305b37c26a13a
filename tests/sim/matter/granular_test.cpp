#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/matter/heat_support.h"

namespace sim {
namespace {

using world::BlockId;
using world::kAir;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

/// A box of stone, open at the top, with things strewn into it at random.
World strewn_box(const VoxelBox& box, std::initializer_list<const char*> things, uint64_t seed, double density) {
  World world(world::standard_blocks());
  const VoxelPos one{1, 1, 1};
  fill(world, {box.min - one, box.max + one}, block_named(world, "granite"));
  fill(world, box, kAir);
  std::vector<BlockId> ids;
  for (const char* name : things) ids.push_back(block_named(world, name));
  world::EditBatch batch;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const uint64_t r = world::random_bits(seed, x, y, z, 0, 77);
        if (world::uniform01(r) < density) batch.set({x, y, z}, ids[(r & 0xffff) % ids.size()]);
      }
  CHECK(world.store.apply(batch).ok());
  return world;
}

void expect_equal_to_dense(std::initializer_list<const char*> things, uint64_t seed) {
  const VoxelBox box{{-13, -9, -11}, {20, 22, 17}};
  World world = strewn_box(box, things, seed, 0.3);
  DenseMatter dense(world, box, seed);
  RuleAlone rule(world, "granular", {.seed = seed});  // gases have a rule of their own
  for (uint64_t tick = 0; tick < 60; ++tick) {
    rule.step();
    dense.step_granular(tick);
    if (tick % 7 != 0 && tick < 50) continue;
    rule.cells().flush();
    ASSERT_EQ(differences(world, dense), 0u) << "after tick " << tick;
  }
}

TEST(Granular, OneKindMovesAsTheRuleSaysVoxelByVoxel) { expect_equal_to_dense({"sand"}, 3); }
TEST(Granular, ManyKindsAndSolidsMoveAsTheRuleSays) {
  expect_equal_to_dense({"sand", "gravel", "volcanic_ash", "granite"}, 4);
}
TEST(Granular, GrainsInAirAndGasesMoveAsTheRuleSays) { expect_equal_to_dense({"sand", "smoke", "gravel"}, 5); }

TEST(Granular, TheStateIsTheSameForAnyThreadsAndInstructions) {
  const VoxelBox box{{-30, 0, -30}, {33, 60, 33}};
  expect_the_same_for_any_threads_and_instructions([&] {
    World world = strewn_box(box, {"sand", "gravel"}, 9, 0.2);
    fill(world, {{-30, 30, -30}, {0, 45, 0}}, block_named(world, "sand"));
    Matter matter(world, {.seed = 9});
    for (int i = 0; i < 80; ++i) matter.step();
    return matter.state_hash();
  });
}

TEST(Granular, KeepsEveryVoxelOfEachBlock) {
  const VoxelBox box{{0, 0, 0}, {40, 40, 40}};
  World world = strewn_box(box, {"sand", "gravel", "red_sand", "smoke"}, 12, 0.4);
  const world::Census before = world.store.census();
  RuleAlone rule(world, "granular", {.seed = 12});
  for (int i = 0; i < 200; ++i) rule.step();
  rule.cells().flush();
  EXPECT_EQ(world.store.census(), before);
}

TEST(Granular, ASettledWorldVisitsNoLeafAndHoldsNoPage) {
  const VoxelBox box{{0, 0, 0}, {30, 30, 30}};
  World world = strewn_box(box, {"sand"}, 2, 0.3);
  Matter matter(world, {});
  int ticks = 0;
  while (!matter.settled() && ticks < 2000) matter.step(), ++ticks;
  ASSERT_TRUE(matter.settled());
  EXPECT_LT(ticks, 300) << "31 voxels to fall, then slides of at most 31 more";
  for (int i = 0; i < 10; ++i) EXPECT_EQ(matter.step().leaves_visited, 0u);
  EXPECT_EQ(matter.awake_leaves(), 0u);
  // Nothing of it moves when all is looked at again.
  Matter again(world, {});
  const uint64_t hash = again.state_hash();
  again.step();
  EXPECT_EQ(again.state_hash(), hash);
}

TEST(Granular, AnEditWakesWhatRestsOnIt) {
  World world(world::standard_blocks());
  fill(world, {{-20, -30, -20}, {20, -1, 20}}, block_named(world, "granite"));
  fill(world, {{0, 0, 0}, {0, 0, 0}}, block_named(world, "sand"));
  Matter matter(world, {});
  while (!matter.settled()) matter.step();
  EXPECT_EQ(world.store.get({0, 0, 0}), block_named(world, "sand"));
  fill(world, {{0, -20, 0}, {0, -1, 0}}, kAir);
  for (int i = 0; i < 30; ++i) matter.step();
  matter.flush();
  EXPECT_EQ(world.store.get({0, -20, 0}), block_named(world, "sand"));
  EXPECT_TRUE(matter.settled());
}

struct Heap {
  double slope = 0;   // of the cone that has the same areas at each height
  double radius = 0;  // of its foot
  int asymmetry = 0;  // how many grains the fullest half has more than the emptiest
};
/// A column of 9x9x251 grains that falls apart on a floor.
Heap heap_of(double repose_deg) {
  World world(world::standard_blocks());
  world::Block block = (*world.palette)[block_named(world, "sand")];
  block.name = "test_grain";
  block.repose_deg = repose_deg;
  const BlockId grain = world.palette->add(block).value();
  fill(world, {{-100, -1, -100}, {100, -1, 100}}, block_named(world, "granite"));
  fill(world, {{-4, 0, -4}, {4, 250, 4}}, grain);
  Matter matter(world, {});
  for (int i = 0; i < 20000 && !matter.settled(); ++i) matter.step();
  EXPECT_TRUE(matter.settled());
  std::map<int, int> columns;  // by height
  int halves[4] = {};
  world::StoreReader reader(world.store);
  for (int x = -100; x <= 100; ++x)
    for (int z = -100; z <= 100; ++z) {
      int h = 0;
      while (reader.get({x, h, z}) == grain) ++h;
      if (h > 0) ++columns[h];
      if (x != 0) halves[x > 0 ? 0 : 1] += h;
      if (z != 0) halves[z > 0 ? 2 : 3] += h;
    }
  Heap heap;
  heap.asymmetry = *std::max_element(halves, halves + 4) - *std::min_element(halves, halves + 4);
  // A line through the radii at each height but those of the tip and the foot, which are rounded.
  double n = 0, sum_r = 0, sum_h = 0, sum_rr = 0, sum_rh = 0, above = 0;
  const int top = columns.rbegin()->first;
  for (int h = top; h >= 1; --h) {
    above += columns.count(h) ? columns[h] : 0;
    heap.radius = std::sqrt(above / 3.14159265358979);
    if (h > top - 3 || h < 3) continue;
    const double r = heap.radius;
    n += 1, sum_r += r, sum_h += h, sum_rr += r * r, sum_rh += r * h;
  }
  heap.slope = -(n * sum_rh - sum_r * sum_h) / (n * sum_rr - sum_r * sum_r);
  return heap;
}

// The bound is that of the grid: a line of another slope that differs by less than a voxel over the heap's radius
// can't be told from it.
TEST(Granular, AHeapStandsAtItsAngleOfReposeWithinAVoxel) {
  for (const double degrees : {30.0, 34.0, 38.0, 45.0, 52.0, 60.0}) {
    const Heap heap = heap_of(degrees);
    const double asked = std::tan(degrees / 180 * 3.14159265358979);
    EXPECT_LT(std::abs(heap.slope - asked) * heap.radius, 1) << degrees << " degrees, slope " << heap.slope;
    // Which side a grain takes is a coin: of some 20,000 the halves differ by about their root.
    EXPECT_LT(heap.asymmetry, 3 * std::sqrt(81 * 251)) << degrees;
  }
}

}  // namespace
}  // namespace sim
