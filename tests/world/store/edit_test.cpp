// A batch is its operations one after the other, however they lie in space and however many there are.
#include "world/store/edit.h"

#include <gtest/gtest.h>

#include "world/world.h"

namespace world {

namespace {

World two_blocks() {
  World world;
  for (const char* name : {"stone", "sand"}) {
    Block block;
    block.name = name;
    EXPECT_TRUE(world.palette->add(block).ok());
  }
  return world;
}

int32_t draw(uint64_t seed, int i, int what, int32_t below) {
  return static_cast<int32_t>(random_bits(seed, i, what, 0) % static_cast<uint64_t>(below));
}

/// Boxes that overlap, some of them whole leaves, at each of the places in turn.
EditBatch overlapping_boxes(uint64_t seed, int count, const std::vector<VoxelPos>& places) {
  EditBatch batch;
  for (int i = 0; i < count; ++i) {
    const VoxelPos place = places[static_cast<size_t>(i) % places.size()];
    VoxelPos low = place + VoxelPos{draw(seed, i, 0, 24), draw(seed, i, 1, 24), draw(seed, i, 2, 24)};
    VoxelPos high = low + VoxelPos{draw(seed, i, 3, 12), draw(seed, i, 4, 12), draw(seed, i, 5, 12)};
    if (i % 7 == 0) low = {low.x & ~7, low.y & ~7, low.z & ~7}, high = low + VoxelPos{7, 15, 7};
    batch.fill({low, high}, static_cast<BlockId>(draw(seed, i, 6, 3)));
  }
  return batch;
}

void expect_equals_one_by_one(const std::vector<VoxelPos>& places, int count) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    World at_once = two_blocks(), one_by_one = two_blocks();
    const EditBatch base = overlapping_boxes(seed + 100, 40, places);
    ASSERT_TRUE(at_once.store.apply(base).ok());
    ASSERT_TRUE(one_by_one.store.apply(base).ok());
    const uint64_t before = at_once.store.content_hash();
    const EditBatch batch = overlapping_boxes(seed, count, places);
    UndoLog log;
    ASSERT_TRUE(at_once.store.apply(batch, &log).ok());
    for (const EditBatch::Op& op : batch.ops()) {
      EditBatch one;
      one.fill(op.box, op.block);
      ASSERT_TRUE(one_by_one.store.apply(one).ok());
    }
    const uint64_t after = at_once.store.content_hash();
    EXPECT_EQ(after, one_by_one.store.content_hash());
    EXPECT_EQ(at_once.store.census(), one_by_one.store.census());
    EXPECT_EQ(at_once.store.bytes_memory(), one_by_one.store.bytes_memory());
    EXPECT_TRUE(log.undo(at_once.store));
    EXPECT_EQ(at_once.store.content_hash(), before);
    EXPECT_TRUE(log.redo(at_once.store));
    EXPECT_EQ(at_once.store.content_hash(), after);
    EXPECT_EQ(at_once.store.census(), one_by_one.store.census());
  }
}

}  // namespace

TEST(EditBatch, EqualsItsOperationsOneByOneInOnePlace) { expect_equals_one_by_one({{-13, -13, -13}}, 30); }

TEST(EditBatch, EqualsItsOperationsOneByOneWhereThereAreMany) { expect_equals_one_by_one({{-13, 100, -120}}, 400); }

TEST(EditBatch, EqualsItsOperationsOneByOneInCornersOfTheWorld) {
  const int32_t far = kWorldBorder - 64;
  expect_equals_one_by_one({{-far, -far, -far}, {0, 0, 0}, {far, far, far}, {far, -far, 0}}, 400);
}

TEST(EditBatch, CountsAVoxelThatChangedAndOneThatChangedBack) {
  World world = two_blocks();
  EditBatch there_and_back;
  there_and_back.set({1, 2, 3}, 1);
  there_and_back.set({1, 2, 4}, 1);
  there_and_back.set({1, 2, 3}, kAir);
  const auto report = world.store.apply(there_and_back);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->voxels_changed, 1u);
  EXPECT_EQ(report->leaves_changed, 1u);
  EXPECT_EQ(world.store.census(), (Census{{1, 1}}));
}

}  // namespace world
