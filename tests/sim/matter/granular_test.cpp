#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/matter/matter_support.h"
#include "world/base/jobs.h"
#include "world/base/simd.h"

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
  Matter matter(world, {.seed = seed});
  for (uint64_t tick = 0; tick < 60; ++tick) {
    matter.step();
    dense.step_granular(tick);
    if (tick % 7 != 0 && tick < 50) continue;
    matter.flush();
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
  std::vector<uint64_t> hashes;
  const auto run = [&] {
    World world = strewn_box(box, {"sand", "gravel"}, 9, 0.2);
    fill(world, {{-30, 30, -30}, {0, 45, 0}}, block_named(world, "sand"));
    Matter matter(world, {.seed = 9});
    for (int i = 0; i < 80; ++i) matter.step();
    hashes.push_back(matter.state_hash());
  };
  for (const int threads : {1, 2, 3, 8}) {
    const world::ThreadLimit limit(threads);
    run();
  }
  for (const world::SimdLevel& level : world::simd_levels()) {
    const world::SimdChoice choice(level);
    run();
  }
  for (const uint64_t hash : hashes) EXPECT_EQ(hash, hashes[0]);
}

TEST(Granular, KeepsEveryVoxelOfEachBlock) {
  const VoxelBox box{{0, 0, 0}, {40, 40, 40}};
  World world = strewn_box(box, {"sand", "gravel", "red_sand", "smoke"}, 12, 0.4);
  const world::Census before = world.store.census();
  Matter matter(world, {.seed = 12});
  for (int i = 0; i < 200; ++i) matter.step();
  matter.flush();
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

/// A heap poured onto a floor; its slope from the middle to the rim.
double slope_of_heap(const char* name, int* asymmetry) {
  World world(world::standard_blocks());
  const BlockId grain = block_named(world, name);
  fill(world, {{-100, -1, -100}, {100, -1, 100}}, block_named(world, "granite"));
  fill(world, {{-4, 0, -4}, {4, 250, 4}}, grain);
  Matter matter(world, {});
  for (int i = 0; i < 20000 && !matter.settled(); ++i) matter.step();
  EXPECT_TRUE(matter.settled());
  const auto height = [&](int x, int z) {
    int y = 0;
    while (world.store.get({x, y, z}) == grain) ++y;
    return y;
  };
  // Of each height the area above it, as the radius of a circle: a line through them has the slope of the heap.
  std::map<int, int> columns;
  int sums[4] = {};
  for (int x = -100; x <= 100; ++x)
    for (int z = -100; z <= 100; ++z) {
      const int h = height(x, z);
      if (h > 0) ++columns[h];
      if (x > 0) sums[0] += h;
      if (x < 0) sums[1] += h;
      if (z > 0) sums[2] += h;
      if (z < 0) sums[3] += h;
    }
  *asymmetry = *std::max_element(sums, sums + 4) - *std::min_element(sums, sums + 4);
  double n = 0, sum_r = 0, sum_h = 0, sum_rr = 0, sum_rh = 0, above = 0;
  const int top = columns.rbegin()->first;
  for (int h = top; h >= 1; --h) {
    above += columns.count(h) ? columns[h] : 0;
    if (h > top - 3 || h < 3) continue;  // the tip and the foot are rounded
    const double r = std::sqrt(above / 3.14159265358979);
    n += 1, sum_r += r, sum_h += h, sum_rr += r * r, sum_rh += r * h;
  }
  return -(n * sum_rh - sum_r * sum_h) / (n * sum_rr - sum_r * sum_r);
}

TEST(Granular, AHeapStandsAtItsAngleOfReposeAndIsTheSameAllRound) {
  for (const char* name : {"sand", "gravel"}) {
    int asymmetry = 0;
    const double slope = slope_of_heap(name, &asymmetry);
    const double asked = std::tan(35.0 / 180 * 3.14159265358979);
    std::printf("%s: slope %.3f, %.1f degrees (asked %.3f), halves differ by %d of %d\n", name, slope,
                std::atan(slope) * 180 / 3.14159265358979, asked, asymmetry, 81 * 251);
  }
}

}  // namespace
}  // namespace sim
