#include "world/store/store.h"

#include <random>

#include <gtest/gtest.h>

#include "world/base/jobs.h"
#include "world/world.h"

namespace world {
namespace {

BlockId id(const World& world, const char* name) { return *world.palette->find(name); }

/// The naive store that claims are held against.
struct DenseWorld {
  std::map<VoxelPos, BlockId> blocks;
  BlockId get(VoxelPos v) const {
    const auto found = blocks.find(v);
    return found == blocks.end() ? kAir : found->second;
  }
  void set(VoxelPos v, BlockId b) {
    if (b == kAir)
      blocks.erase(v);
    else
      blocks[v] = b;
  }
  void fill(const VoxelBox& box, BlockId b) {
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z) set({x, y, z}, b);
  }
  VoxelBox bounds() const {
    VoxelBox box;
    for (const auto& [v, b] : blocks) box.include(v);
    return box;
  }
};

/// Random voxels and boxes around a centre, on the store and on the dense world alike.
EditBatch random_edits(std::mt19937& rng, const World& world, VoxelPos centre, DenseWorld& dense, int count) {
  EditBatch batch;
  const BlockId palette[] = {kAir, id(world, "stone"), id(world, "water"), id(world, "glass"), id(world, "lamp_warm")};
  const auto pos = [&] {
    const auto c = [&] { return static_cast<int>(rng() % 40) - 20; };
    return VoxelPos{centre.x + c(), centre.y + c(), centre.z + c()};
  };
  for (int i = 0; i < count; ++i) {
    const BlockId block = palette[rng() % 5];
    if (rng() % 8) {
      const VoxelPos v = pos();
      batch.set(v, block);
      dense.set(v, block);
    } else {
      VoxelBox box;
      box.include(pos());
      box.include(pos());
      batch.fill(box, block);
      dense.fill(box, block);
    }
  }
  return batch;
}

void expect_equal(const World& world, const DenseWorld& dense, VoxelPos centre) {
  for (int x = -24; x < 24; ++x)
    for (int y = -24; y < 24; ++y)
      for (int z = -24; z < 24; ++z) {
        const VoxelPos v = centre + VoxelPos{x, y, z};
        ASSERT_EQ(world.store.get(v), dense.get(v)) << v.x << ' ' << v.y << ' ' << v.z;
        ASSERT_EQ(world.store.masks(MaskKind::liquid).test(v), dense.get(v) == id(world, "water"));
        ASSERT_EQ(world.store.masks(MaskKind::occupied).test(v), dense.get(v) != kAir);
      }
  Census census;
  for (const auto& [v, b] : dense.blocks) ++census[b];
  ASSERT_EQ(world.store.census(), census);
  ASSERT_EQ(world.store.bounds(), dense.bounds());
}

TEST(Store, EqualsADenseMapAfterRandomEditsAnywhereInTheWorld) {
  for (const VoxelPos centre :
       {VoxelPos{0, 0, 0}, VoxelPos{-128, 127, 5}, VoxelPos{10'000'000, -10'000'000, 16'777'216},
        VoxelPos{kWorldBorder - 40, 1 - kWorldBorder + 40, 0}}) {
    std::mt19937 rng(7);
    World world(standard_blocks());
    DenseWorld dense;
    // Built before the edits, so that edits must keep them up to date.
    (void)world.store.masks(MaskKind::occupied);
    (void)world.store.masks(MaskKind::liquid);
    for (int round = 0; round < 4; ++round) {
      ASSERT_TRUE(world.store.apply(random_edits(rng, world, centre, dense, 60)).ok());
      expect_equal(world, dense, centre);
    }
  }
}

TEST(Store, UndoAndRedoReturnToTheSameContentHash) {
  std::mt19937 rng(11);
  World world(standard_blocks());
  DenseWorld dense;
  UndoLog log;
  std::vector<uint64_t> hashes{world.store.content_hash()};
  for (int step = 0; step < 10; ++step) {
    ASSERT_TRUE(world.store.apply(random_edits(rng, world, {0, 0, 0}, dense, 30), &log).ok());
    hashes.push_back(world.store.content_hash());
  }
  for (int step = 10; step > 0; --step) {
    ASSERT_EQ(world.store.content_hash(), hashes[static_cast<size_t>(step)]);
    ASSERT_TRUE(log.undo(world.store));
  }
  EXPECT_EQ(world.store.content_hash(), hashes[0]);
  EXPECT_EQ(world.store.voxel_count(), 0u);
  EXPECT_FALSE(log.undo(world.store));
  while (log.redo(world.store)) {
  }
  EXPECT_EQ(world.store.content_hash(), hashes.back());
  expect_equal(world, dense, {0, 0, 0});
}

TEST(Store, DirtyLeavesAreExactlyThoseWhoseBlocksChanged) {
  World world(standard_blocks());
  const int first = world.store.subscribe(), second = world.store.subscribe();
  EditBatch batch;
  batch.set({0, 0, 0}, id(world, "stone"));
  batch.set({-1, 0, 0}, id(world, "stone"));
  batch.set({100, 0, 0}, kAir);  // already air: no change
  ASSERT_TRUE(world.store.apply(batch).ok());
  EXPECT_EQ(world.store.take_dirty(first), (std::vector<LeafPos>{{-1, 0, 0}, {0, 0, 0}}));
  EXPECT_TRUE(world.store.take_dirty(first).empty());
  ASSERT_TRUE(world.store.apply(batch).ok());  // the same again changes nothing
  EXPECT_TRUE(world.store.take_dirty(first).empty());
  EXPECT_EQ(world.store.take_dirty(second).size(), 2u);
}

TEST(Store, ASettledFillCostsTilesNotLeaves) {
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {127, 127, 127}}, id(world, "stone"));
  ASSERT_TRUE(world.store.apply(batch).ok());
  EXPECT_TRUE(world.store.mixed_leaves().empty());
  EXPECT_EQ(world.store.voxel_count(), 128u * 128 * 128);
  // One voxel out and in again: the leaf becomes a tile again.
  EditBatch out, in;
  out.set({5, 5, 5}, kAir);
  in.set({5, 5, 5}, id(world, "stone"));
  ASSERT_TRUE(world.store.apply(out).ok());
  EXPECT_EQ(world.store.mixed_leaves().size(), 1u);
  ASSERT_TRUE(world.store.apply(in).ok());
  EXPECT_TRUE(world.store.mixed_leaves().empty());
}

TEST(Store, ContentHashDependsOnContentNotOnTilesOrHistory) {
  World by_fill(standard_blocks()), by_voxels(standard_blocks());
  const BlockId stone = id(by_fill, "stone");
  EditBatch fill, voxels;
  fill.fill({{-8, 0, 0}, {7, 7, 7}}, stone);
  for (int i = 511; i >= 0; --i) {
    voxels.set(offset_in_leaf(i), stone);
    voxels.set(offset_in_leaf(i) + VoxelPos{-8, 0, 0}, stone);
  }
  ASSERT_TRUE(by_fill.store.apply(fill).ok());
  ASSERT_TRUE(by_voxels.store.apply(voxels).ok());
  EXPECT_EQ(by_fill.store.content_hash(), by_voxels.store.content_hash());
  EditBatch one;
  one.set({0, 0, 0}, id(by_fill, "granite"));
  ASSERT_TRUE(by_fill.store.apply(one).ok());
  EXPECT_NE(by_fill.store.content_hash(), by_voxels.store.content_hash());
}

TEST(HardCaseT15, EditsOutsideTheWorldsBorderAreRefusedAndChangeNothing) {
  World world(standard_blocks());
  EditBatch batch;
  batch.set({0, 0, 0}, id(world, "stone"));
  batch.set({kWorldBorder, 0, 0}, id(world, "stone"));
  const auto result = world.store.apply(batch);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("border"), std::string::npos);
  EXPECT_EQ(world.store.voxel_count(), 0u);
}

TEST(HardCaseN21, AFillTooLargeForMemoryIsRefusedBeforeAnyAllocation) {
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{-kWorldBorder, -kWorldBorder, -kWorldBorder}, {kWorldBorder - 1, kWorldBorder - 1, kWorldBorder - 1}},
             id(world, "stone"));
  const auto result = world.store.apply(batch);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(world.store.voxel_count(), 0u);
}

TEST(Store, BuiltRegionsAreAdoptedWithCensusAndMasks) {
  World world(standard_blocks());
  const BlockId stone = id(world, "stone"), water = id(world, "water");
  (void)world.store.masks(MaskKind::liquid);
  const int follower = world.store.subscribe();
  RegionBuilder builder({-1, 0, 2});
  builder.set_uniform(0, stone);
  std::array<BlockId, kLeafVoxels> values{};
  values[9] = water;
  builder.set_leaf(4095, values);
  world.store.adopt(std::move(builder));
  EXPECT_EQ(world.store.get({-128, 0, 256}), stone);
  EXPECT_EQ(world.store.get({-8, 121, 377}), water);  // leaf 4095's corner is (-8, 120, 376); index 9 is (0, 1, 1)
  EXPECT_EQ(world.store.census(), (Census{{stone, 512}, {water, 1}}));
  EXPECT_EQ(world.store.region_census({-1, 0, 2}), world.store.census());
  EXPECT_TRUE(world.store.masks(MaskKind::liquid).test({-8, 121, 377}));
  EXPECT_EQ(world.store.masks(MaskKind::liquid).count(), 1u);
  EXPECT_EQ(world.store.take_dirty(follower).size(), 2u);
}

TEST(Store, ReadersOnManyThreadsSeeWhatOneSees) {
  World world(standard_blocks());
  std::mt19937 rng(3);
  DenseWorld dense;
  ASSERT_TRUE(world.store.apply(random_edits(rng, world, {0, 0, 0}, dense, 200)).ok());
  const WorldView view(world);
  std::atomic<int> wrong{0};
  parallel_for(64, [&](size_t) {
    StoreReader reader(view.store());
    for (int x = -24; x < 24; ++x)
      for (int y = -24; y < 24; ++y)
        for (int z = -24; z < 24; ++z) wrong += reader.get({x, y, z}) != dense.get({x, y, z});
  });
  EXPECT_EQ(wrong.load(), 0);
}

TEST(StoreDeathTest, AnEditWhileAViewLivesIsABug) {
  World world(standard_blocks());
  const WorldView view(world);
  EditBatch batch;
  batch.set({0, 0, 0}, 1);
  EXPECT_DEATH((void)world.store.apply(batch), "views");
}

}  // namespace
}  // namespace world
