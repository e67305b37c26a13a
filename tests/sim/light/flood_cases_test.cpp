// Hard cases of light as an automaton, each by name, and the vectors of Luanti's own test.
#include <algorithm>
#include <array>
#include <numeric>

#include "tests/sim/light/light_support.h"
#include "world/base/jobs.h"

namespace sim {
namespace {

using world::EditBatch;
using world::kAir;
using world::LightModel;
using world::RegionPos;
using world::Store;

struct Scene {
  LightBlocks blocks = every_kind_of_block();
  Store store{blocks.palette};
  FloodLight light{store, LightModel::flood4, blocks.rules};

  BlockId block(const char* name) const { return *blocks.palette.find(name); }
  LightReport fill(const VoxelBox& box, BlockId id) {
    EditBatch batch;
    batch.fill(box, id);
    EXPECT_TRUE(store.apply(batch).ok());
    return light.update();
  }
  LightReport set(VoxelPos v, BlockId id) { return fill({v, v}, id); }
  LightReport set(VoxelPos v, const char* name) { return set(v, block(name)); }
  int sky(VoxelPos v) const { return light.volume().sky().get(v); }
  int lamps(VoxelPos v) const { return light.volume().block().get(v); }
  uint64_t anew() const {
    FloodLight fresh(store, LightModel::flood4, blocks.rules);
    fresh.compute();
    return fresh.volume().content_hash();
  }
  /// A hollow box of stone.
  void hall(const VoxelBox& outside) {
    fill(outside, block("stone"));
    fill({outside.min + VoxelPos{1, 1, 1}, outside.max - VoxelPos{1, 1, 1}}, kAir);
  }
};

TEST(LightCases, LuantisTestLightingVectorsHold) {
  LightBlocks blocks;
  const BlockId stone = blocks.add("stone", {.loss = 0});
  const BlockId water = blocks.add("water", {.loss = 1});
  const BlockId torch = blocks.add("torch", {.loss = 1, .level = 13, .passes_sky = true});
  Store store(blocks.palette);
  EditBatch batch;
  batch.fill({{-10, -10, -10}, {10, 10, 10}}, stone);
  batch.fill({{-9, -9, -9}, {9, 9, 9}}, kAir);
  ASSERT_TRUE(store.apply(batch).ok());
  FloodLight light(store, LightModel::flood4, blocks.rules);
  light.update();
  EditBatch edits;
  edits.set({-10, 0, 0}, kAir);
  edits.set({9, 10, -9}, water);
  edits.set({0, 0, 0}, torch);
  edits.set({-10, 1, 0}, stone);
  ASSERT_TRUE(store.apply(edits).ok());
  light.update();
  const struct {
    VoxelPos at;
    int night, day;
  } kVectors[] = {{{9, 9, -9}, 0, 13},  {{0, 1, 0}, 12, 12},  {{-9, -1, 0}, 3, 12},
                  {{-10, 0, 0}, 3, 14}, {{-11, 0, 0}, 2, 15}, {{-10, 1, 0}, 0, 0}};  // the last: stone has none
  for (const auto& v : kVectors) {
    const int night = light.volume().block().get(v.at);
    EXPECT_EQ(night, v.night) << v.at.x << ' ' << v.at.y << ' ' << v.at.z;
    EXPECT_EQ(std::max(night, light.volume().sky().get(v.at)), v.day) << v.at.x << ' ' << v.at.y << ' ' << v.at.z;
  }
}

// CL2: Luanti's issue 2823, a pit of lava across a border of blocks of 16, which is one of leaves too.
TEST(LightCases, LightAtABorderGoesWithItsSource) {
  Scene s;
  s.hall({{0, 0, 30}, {40, 20, 70}});
  s.fill({{20, 1, 47}, {20, 1, 48}}, s.block("glowing_water"));
  EXPECT_EQ(s.lamps({20, 2, 47}), 3);
  s.set({20, 1, 47}, kAir);
  EXPECT_EQ(s.lamps({20, 2, 47}), 2);
  s.set({20, 1, 48}, kAir);
  for (int x = 1; x < 40; ++x)
    for (int y = 1; y < 20; ++y)
      for (int z = 31; z < 70; ++z) ASSERT_EQ(s.lamps({x, y, z}), 0) << x << ' ' << y << ' ' << z;
  EXPECT_EQ(s.light.volume().content_hash(), s.anew());
}

// CL5.
TEST(LightCases, OneLampInTheOpenLightsNoMoreThanItsOctahedron) {
  Scene s;
  s.fill({{0, 0, 0}, {63, 0, 63}}, s.block("stone"));
  const LightReport report = s.set({32, 40, 32}, "lantern_15");
  int lit = 0;
  for (int x = 8; x < 56; ++x)
    for (int y = 10; y < 70; ++y)
      for (int z = 8; z < 56; ++z) lit += s.lamps({x, y, z}) > 0;
  EXPECT_EQ(lit, 4089);
  // 29^3 voxels meet at most 5^3 leaves.
  EXPECT_LE(report.leaves_computed, 125u);
  EXPECT_EQ(report.windows, 1u);
}

// CL8: one step a level is the distance along the axes, not that of a straight line.
TEST(LightCases, LevelsFallByStepsAlongAxes) {
  Scene s;
  s.set({0, 0, 0}, "lamp_15");
  EXPECT_EQ(s.lamps({10, 0, 0}), 5);
  EXPECT_EQ(s.lamps({6, 6, 6}), 0);   // 10.4 away
  EXPECT_EQ(s.lamps({5, -5, 4}), 1);  // 8.1 away
}

// CL9.
TEST(LightCases, EmissionSaturatesAtFifteen) {
  world::Block block;
  block.opaque = false;
  const auto level = [&](float watts) {
    block.emission = {watts, watts, watts};
    return brightest(optics_of(block)).level;
  };
  EXPECT_EQ(level(0), 0);
  EXPECT_EQ(level(1e-30f), 0);
  EXPECT_EQ(level(3000), 15);
  EXPECT_EQ(level(2400), 14);
  EXPECT_EQ(level(1e30f), 15);
  block.absorption = {1e30f, 1e30f, 1e30f};
  EXPECT_EQ(brightest(optics_of(block)).loss, 15);
}

// CL10: a source that no light enters; one walled in; an edge that light must not pass diagonally.
TEST(LightCases, ClosedSourcesShineAndCornersDontLeak) {
  Scene s;
  s.set({0, 0, 0}, "lamp_7");
  EXPECT_EQ(s.lamps({0, 0, 0}), 7);
  EXPECT_EQ(s.lamps({1, 0, 0}), 6);
  s.set({0, 1, 0}, "lamp_15");  // light of 15 beside it doesn't enter
  EXPECT_EQ(s.lamps({0, 0, 0}), 7);
  EXPECT_EQ(s.lamps({0, -1, 0}), 11);  // round the lamp of 7

  s.fill({{-3, 17, -3}, {3, 23, 3}}, s.block("stone"));
  s.set({0, 20, 0}, "lamp_15");  // in solid stone
  EXPECT_EQ(s.lamps({0, 20, 0}), 15);
  EXPECT_EQ(s.lamps({1, 20, 0}), 0);
  EXPECT_EQ(s.lamps({0, 24, 0}), 0);

  // Two closed rooms that share an edge.
  s.fill({{-10, 40, -10}, {10, 50, 10}}, s.block("stone"));
  s.fill({{-5, 42, -5}, {-1, 46, -1}}, kAir);
  s.fill({{0, 42, 0}, {5, 46, 5}}, kAir);
  s.set({-1, 43, -1}, "torch_14");
  EXPECT_EQ(s.lamps({-2, 43, -1}), 13);
  EXPECT_EQ(s.lamps({0, 43, 0}), 0);
  s.set({-1, 43, 0}, kAir);  // now they share a face
  EXPECT_EQ(s.lamps({0, 43, 0}), 12);
  EXPECT_EQ(s.light.volume().content_hash(), s.anew());
}

TEST(LightCases, TheSkyGoesStraightDownAndSpreadsUnderRoofs) {
  Scene s;
  s.fill({{-40, 0, -40}, {40, 0, 40}}, s.block("stone"));
  s.fill({{-20, 30, -20}, {20, 30, 20}}, s.block("stone"));  // a roof on nothing
  EXPECT_EQ(s.sky({30, 1, 30}), 15);
  EXPECT_EQ(s.sky({20, 1, 0}), 14);
  EXPECT_EQ(s.sky({10, 1, 0}), 4);
  EXPECT_EQ(s.sky({0, 1, 0}), 0);
  EXPECT_EQ(s.sky({0, 31, 0}), 15);
  s.set({0, 30, 0}, kAir);  // a hole: a shaft of light down to the ground
  for (int y = 1; y <= 31; ++y) EXPECT_EQ(s.sky({0, y, 0}), 15) << y;
  EXPECT_EQ(s.sky({3, 1, 0}), 12);
  s.set({0, 30, 0}, "glass");  // takes two, and what is below gets no more than the flood
  EXPECT_EQ(s.sky({0, 30, 0}), 13);
  EXPECT_EQ(s.sky({0, 1, 0}), 0);
  s.set({0, 30, 0}, "torch_14");  // as clear as air
  EXPECT_EQ(s.sky({0, 1, 0}), 15);
  s.set({0, 30, 0}, "stone");
  EXPECT_EQ(s.sky({0, 1, 0}), 0);
  EXPECT_EQ(s.light.volume().content_hash(), s.anew());
}

// Regions between that hold nothing are not kept: columns jump over them.
TEST(LightCases, ARoofFarAboveShadesTheGroundAndGoes) {
  Scene s;
  s.fill({{0, 0, 0}, {40, 3, 40}}, s.block("stone"));
  const uint64_t bare = s.light.volume().content_hash();
  const VoxelBox roof{{5, 700, 5}, {30, 701, 30}};
  s.fill(roof, s.block("stone"));
  EXPECT_EQ(s.sky({17, 4, 17}), 2);  // 13 steps from beside its shadow
  EXPECT_EQ(s.light.volume().content_hash(), s.anew());
  s.set({17, 700, 17}, kAir);
  s.set({17, 701, 17}, kAir);
  EXPECT_EQ(s.sky({17, 4, 17}), 15);
  EXPECT_EQ(s.light.volume().content_hash(), s.anew());
  s.fill(roof, kAir);
  EXPECT_EQ(s.sky({20, 4, 20}), 15);
  EXPECT_EQ(s.light.volume().content_hash(), bare);
  s.fill({{10, 300, 10}, {12, 300, 12}}, s.block("stone"));  // in the gap
  s.fill(roof, s.block("glass"));
  EXPECT_EQ(s.light.volume().content_hash(), s.anew());
}

/// Position under one of the 48 symmetries of the cube about the origin; the first 8 keep y.
VoxelPos under_symmetry(VoxelPos v, int s) {
  static const int kAxes[6][3] = {{0, 1, 2}, {2, 1, 0}, {1, 0, 2}, {1, 2, 0}, {0, 2, 1}, {2, 0, 1}};
  const int signs = s < 8 ? (s & 1) | (s & 2) << 1 : s;  // x and z only
  const int* axes = kAxes[s < 8 ? s >> 2 : (s >> 3) % 6];
  VoxelPos r;
  for (int a = 0; a < 3; ++a) r[a] = signs >> a & 1 ? -v[axes[a]] : v[axes[a]];
  return r;
}

// CL7: of the sky the 8 that keep what is up, of lamps all 48.
TEST(LightCases, SymmetricWorldsHaveSymmetricLight) {
  const LightBlocks blocks = every_kind_of_block();
  constexpr int kHalf = 7;
  const auto block_at = [&](VoxelPos v) -> BlockId {
    const uint64_t r = bits(77, v.x * 1000 + v.y, v.z);
    return r % 3 == 0 ? static_cast<BlockId>(1 + r / 3 % (blocks.palette.size() - 1)) : kAir;
  };
  std::vector<std::unique_ptr<Store>> stores;
  std::vector<std::unique_ptr<FloodLight>> lights;
  for (int s = 0; s < 56; ++s) {
    stores.push_back(std::make_unique<Store>(blocks.palette));
    EditBatch batch;
    for (int x = -kHalf; x <= kHalf; ++x)
      for (int y = -kHalf; y <= kHalf; ++y)
        for (int z = -kHalf; z <= kHalf; ++z)
          if (const BlockId b = block_at({x, y, z})) batch.set(under_symmetry({x, y, z}, s), b);
    ASSERT_TRUE(stores.back()->apply(batch).ok());
    lights.push_back(std::make_unique<FloodLight>(*stores.back(), LightModel::flood4, blocks.rules));
    lights.back()->compute();
  }
  for (int s = 1; s < 56; ++s)
    for (int x = -kHalf - 15; x <= kHalf + 15; ++x)
      for (int y = -kHalf - 15; y <= kHalf + 15; ++y)
        for (int z = -kHalf - 15; z <= kHalf + 15; ++z) {
          const VoxelPos v{x, y, z}, w = under_symmetry(v, s);
          ASSERT_EQ(lights[0]->volume().block().get(v), lights[static_cast<size_t>(s)]->volume().block().get(w)) << s;
          if (s < 8) {
            ASSERT_EQ(lights[0]->volume().sky().get(v), lights[static_cast<size_t>(s)]->volume().sky().get(w)) << s;
          }
        }
}

/// What belongs to one of the eight regions around the origin: halls with lamps across every border.
EditBatch content_of(RegionPos r, const Scene& s) {
  EditBatch batch;
  const VoxelPos low = world::voxel_from_region(r);
  const VoxelBox region{low, low + VoxelPos{127, 127, 127}};
  const auto fill = [&](VoxelBox box, BlockId id) {
    for (int a = 0; a < 3; ++a) {
      box.min[a] = std::max(box.min[a], region.min[a]);
      box.max[a] = std::min(box.max[a], region.max[a]);
    }
    batch.fill(box, id);
  };
  fill({{-30, -30, -30}, {30, 30, 30}}, s.block("stone"));
  fill({{-20, -20, -20}, {20, 20, 20}}, kAir);
  fill({{-20, 5, -20}, {20, 5, 3}}, s.block("dirt"));
  fill({{2, 0, 2}, {2, 40, 2}}, kAir);  // a shaft
  fill({{-3, -3, -3}, {-3, -3, -3}}, s.block("lantern_15"));
  fill({{4, -9, -3}, {4, -9, -3}}, s.block("lamp_7"));
  fill({{-1, 60, -1}, {9, 60, 9}}, s.block("glass"));
  return batch;
}

// CL3, CL4: regions that come and go in any order.
TEST(LightCases, LightDependsOnWhatIsLoadedAndNotOnTheOrder) {
  std::array<RegionPos, 8> regions;
  for (int i = 0; i < 8; ++i) regions[static_cast<size_t>(i)] = {(i & 1) - 1, (i >> 1 & 1) - 1, (i >> 2) - 1};
  uint64_t whole = 0;
  for (uint64_t order = 0; order < 12; ++order) {
    Scene s;
    for (const RegionPos& r : regions) s.light.set_unloaded(r, true);
    s.light.update();
    auto shuffled = regions;
    for (size_t i = shuffled.size() - 1; i > 0; --i)
      std::swap(shuffled[i], shuffled[bits(order, static_cast<int64_t>(i)) % (i + 1)]);
    const auto load = [&](RegionPos r) {
      ASSERT_TRUE(s.store.apply(content_of(r, s)).ok());
      s.light.set_unloaded(r, false);
      s.light.update();
    };
    for (const RegionPos& r : shuffled) {
      load(r);
      // Neither dark nor glowing: what is there is as if the rest were not.
      Scene same;
      for (const RegionPos& other : regions)
        if (s.store.region_census(other).empty())
          same.light.set_unloaded(other, true);
        else
          ASSERT_TRUE(same.store.apply(content_of(other, same)).ok());
      same.light.update();
      ASSERT_EQ(s.light.volume().content_hash(), same.light.volume().content_hash()) << order;
      if (order > 2) break;
    }
    for (const RegionPos& r : shuffled)
      if (s.store.region_census(r).empty()) load(r);
    if (order == 0) whole = s.light.volume().content_hash();
    EXPECT_EQ(s.light.volume().content_hash(), whole) << order;
    // Out and in again, with an edit of a lamp meanwhile.
    const RegionPos gone = shuffled[order % 8];
    s.store.evict(gone);
    s.light.set_unloaded(gone, true);
    s.light.update();
    const RegionPos there = shuffled[(order + 1) % 8];
    const VoxelPos v = world::voxel_from_region(there) + VoxelPos{64, 64, 64};
    s.set(v, "lamp_15");
    s.set(v, kAir);
    load(gone);
    EXPECT_EQ(s.light.volume().content_hash(), whole) << order;
  }
  EXPECT_NE(whole, 0u);
}

// X5, X6.
TEST(LightCases, NothingChangedCostsNothingAndAnEditCostsTheSameInAnyWorld) {
  uint64_t first = 0;
  for (const int size : {64, 256, 1000}) {
    Scene s;
    s.fill({{0, 0, 0}, {size, 8, size}}, s.block("stone"));
    const LightReport idle = s.light.update();
    EXPECT_EQ(idle.leaves_computed + idle.windows + idle.leaves_changed, 0u);
    const LightReport report = s.set({30, 20, 30}, "lantern_15");
    if (!first) first = report.leaves_computed;
    EXPECT_EQ(report.leaves_computed, first) << size;
    EXPECT_GT(report.leaves_changed, 0u);
    const LightReport same = s.set({30, 20, 31}, kAir);  // an edit that changes no block
    EXPECT_EQ(same.leaves_computed, 0u);
  }
}

// What can reach only a few voxels is followed one by one, the rest by windows; each field by itself.
TEST(LightCases, QueuesFollowSmallChangesAndWindowsLargeOnes) {
  Scene s;
  s.fill({{0, 0, 0}, {60, 15, 60}}, s.block("stone"));
  for (const bool put : {true, false}) {
    const LightReport stone = s.set({30, 16, 30}, put ? s.block("stone") : kAir);
    EXPECT_EQ(stone.queues, 1u) << "only the sky's light changes";
    EXPECT_EQ(stone.queue_voxels, 1u);
    EXPECT_EQ(stone.windows + stone.leaves_computed, 0u);
    EXPECT_EQ(s.light.volume().content_hash(), s.anew());
  }
  // Its shadow's column gets 14 from its sides, and nobody else notices.
  const LightReport shadow = s.set({30, 25, 30}, "stone");
  EXPECT_EQ(shadow.queues, 1u);
  EXPECT_GE(shadow.queue_voxels, 10u);
  EXPECT_LE(shadow.queue_voxels, 20u) << "in each queue once";
  EXPECT_EQ(s.sky({30, 16, 30}), 14);
  EXPECT_EQ(s.light.volume().content_hash(), s.anew());
  s.fill({{10, 8, 10}, {10, 8, 30}}, kAir);
  for (const char* what : {"lantern_15", "glass"}) {
    const LightReport tunnel = s.set({10, 8, 20}, what);
    EXPECT_EQ(tunnel.windows, 0u) << "a tunnel of 21 voxels: " << what;
    EXPECT_EQ(tunnel.queues, 1u);
    EXPECT_EQ(s.light.volume().content_hash(), s.anew());
  }
  for (const bool put : {true, false}) {
    const LightReport open = s.set({40, 30, 40}, put ? s.block("lantern_15") : kAir);
    EXPECT_EQ(open.queues, 0u);
    EXPECT_EQ(open.queues_left, 1u);
    EXPECT_EQ(open.windows, 1u);
    EXPECT_EQ(s.light.volume().content_hash(), s.anew());
  }
}

TEST(LightCases, AnOpenSkyWithoutLampsCostsTiles) {
  Scene s;
  s.fill({{0, 0, 0}, {1023, 7, 1023}}, s.block("stone"));
  // 64 regions of ground and those around: 10 x 3 x 10 of two fields.
  EXPECT_LT(s.light.volume().bytes(), 64u * 3 * 16 * 1024 + 36 * 128 * 1024);
  EXPECT_EQ(s.sky({500, 8, 500}), 15);
  EXPECT_EQ(world::LightVolume(LightModel::none, 15, false).fields().size(), 0u);
}

}  // namespace
}  // namespace sim
