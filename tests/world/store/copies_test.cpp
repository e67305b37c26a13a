/// Stores made of others: everything is where it should be, and nothing else.
#include "world/store/copies.h"

#include <gtest/gtest.h>

#include "world/world.h"

namespace world {
namespace {

/// Blocks and a layer over several regions: single voxels, whole leaves, whole regions.
World sample() {
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{-130, 0, -5}, {140, 20, 5}}, 3);
  batch.fill({{0, 128, 0}, {127, 255, 127}}, 4);
  batch.set({500, -300, 7}, 5);
  EXPECT_TRUE(world.store.apply(batch).ok());
  FloatLayer& density = world.store.make_layer(Layer::density);
  IntLayer& heat = world.store.make_int_layer(Layer::heat);
  for (int i = 0; i < 2000; ++i) {
    density.set({i * 37 % 301 - 150, i * 53 % 97, i % 13}, static_cast<float>(i % 9));
    heat.set({i * 37 % 301 - 150, i * 53 % 97, i % 13}, i * 1'000'003 - 1'000'000'000);
  }
  return world;
}

TEST(Copies, AMovedStoreHasBlocksAndLayersElsewhere) {
  const World world = sample();
  const VoxelPos offset{1280, -128, 1 << 20};
  const Store there = moved(world.store, offset, *world.palette);
  EXPECT_EQ(there.bounds(), (VoxelBox{world.store.bounds().min + offset, world.store.bounds().max + offset}));
  EXPECT_EQ(there.census(), world.store.census());
  for (const VoxelPos v : {VoxelPos{-130, 0, -5}, {140, 20, 5}, {64, 200, 64}, {500, -300, 7}, {501, -300, 7}})
    EXPECT_EQ(there.get(v + offset), world.store.get(v));
  const FloatLayer &before = *world.store.find_layer(Layer::density), &after = *there.find_layer(Layer::density);
  EXPECT_EQ(after.active_voxels(), before.active_voxels());
  for (int i = 0; i < 2000; ++i) {
    const VoxelPos v{i * 37 % 301 - 150, i * 53 % 97, i % 13};
    ASSERT_EQ(after.get(v + offset), before.get(v));
    ASSERT_EQ(after.active(v + offset), before.active(v));
    ASSERT_EQ(there.find_int_layer(Layer::heat)->get(v + offset), world.store.find_int_layer(Layer::heat)->get(v));
  }
  EXPECT_EQ(there.find_int_layer(Layer::heat)->active_voxels(), before.active_voxels());
  EXPECT_EQ(there.find_layer(Layer::distance), nullptr);
}

TEST(Copies, AStoreWithoutABlockKeepsTheOthersAndItsLayers) {
  const World world = sample();
  for (const BlockId block : {BlockId{3}, BlockId{4}, BlockId{5}}) {
    const Store rest = without_block(world.store, block, *world.palette);
    Census expected = world.store.census();
    expected.erase(block);
    EXPECT_EQ(rest.census(), expected);
    EXPECT_EQ(rest.find_layer(Layer::density)->active_voxels(),
              world.store.find_layer(Layer::density)->active_voxels());
  }
}

}  // namespace
}  // namespace world
