#include "tools/play/change_sketch.h"

#include <algorithm>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "world/blocks/block.h"

namespace tools {
namespace {

using world::Layer;
using world::VoxelPos;

/// So many voxels, each of which was `7` in one run and something else in the other.
std::set<VoxelEntry> differences(size_t voxels, std::mt19937& random) {
  std::set<VoxelEntry> all;
  const auto coordinate = [&] { return static_cast<int32_t>(random()) >> 2; };
  for (size_t n = 0; n < voxels; ++n) {
    const VoxelPos v{coordinate(), coordinate(), coordinate()};
    all.insert({Layer::liquid, v, 7}), all.insert({Layer::liquid, v, static_cast<uint32_t>(random() % 4096) + 8});
  }
  return all;
}

/// What two runs differ in, found from what each has recorded; 100 entries are in both.
std::vector<VoxelEntry> found(const std::set<VoxelEntry>& differ, std::mt19937& random) {
  ChangeSketch a, b;
  for (const VoxelEntry& entry : differences(50, random)) a.toggle(entry), b.toggle(entry);
  bool in_a = false;
  for (const VoxelEntry& entry : differ) ((in_a = !in_a) ? a : b).toggle(entry);
  auto recorded = ChangeSketch::from(a.text());
  EXPECT_TRUE(recorded);
  recorded->toggle(b);
  return recorded->entries();
}

TEST(ChangeSketch, NamesVoxelsOfAnyNumberThatDiffer) {
  std::mt19937 random(5);
  for (const size_t voxels : {1, 2, 4, 30, 1000, 20000}) {
    size_t none = 0;
    const size_t trials = voxels > 500 ? 20 : 1000;
    for (size_t n = 0; n < trials; ++n) {
      const std::set<VoxelEntry> differ = differences(voxels, random);
      const std::vector<VoxelEntry> named = found(differ, random);
      none += named.empty();
      for (const VoxelEntry& entry : named) EXPECT_TRUE(differ.contains(entry));
      EXPECT_TRUE(voxels > 1 || named.empty() || named.size() == 2);
    }
    // Of one voxel both entries are in one cell of both tables with a probability of 1/370.
    EXPECT_LE(none, trials * (voxels == 1 ? 6 : 1) / 1000) << voxels;
  }
}

TEST(ChangeSketch, WhatBothHaveCancels) {
  std::mt19937 random(6);
  ChangeSketch a, b;
  for (const VoxelEntry& entry : differences(500, random)) a.toggle(entry), b.toggle(entry);
  EXPECT_EQ(a.text(), b.text());
  a.toggle(b);
  EXPECT_TRUE(a.empty());
  EXPECT_EQ(a.text(), "");
}

TEST(ChangeSketch, TextThatIsNoneOfOursIsRefused) {
  ChangeSketch one;
  one.toggle({Layer::heat, {1, -2, 3}, 4});
  const std::string text = one.text();
  EXPECT_EQ(text.size(), 2u * 42u);
  EXPECT_TRUE(ChangeSketch::from(text));
  EXPECT_TRUE(ChangeSketch::from(""));
  EXPECT_FALSE(ChangeSketch::from(text.substr(1)));
  EXPECT_FALSE(ChangeSketch::from("ff" + text.substr(2))) << "there is no such cell";
  EXPECT_FALSE(ChangeSketch::from("0g" + text.substr(2)));
}

TEST(ChangeFollower, ASketchHoldsWhatChangedSinceTheLast) {
  world::World world{world::standard_blocks()};
  const auto id = [&](const char* name) { return *world.palette->find(name); };
  const auto set = [&](VoxelPos v, const char* name) {
    world::EditBatch batch;
    batch.set(v, id(name));
    ASSERT_TRUE(world.store.apply(batch).ok());
  };
  set({1, 2, 3}, "granite"), set({500, 2, 3}, "water");
  world.store.make_int_layer(Layer::liquid).set({500, 2, 3}, 100);
  ChangeFollower follower(world);
  EXPECT_TRUE(follower.take().empty());
  set({1, 2, 3}, "granite");
  EXPECT_TRUE(follower.take().empty()) << "the same block again";
  set({1, 2, 3}, "glass");
  const std::vector<VoxelEntry> block = follower.take().entries();
  std::vector<VoxelEntry> expected{{Layer::block, {1, 2, 3}, name_hash("granite")},
                                   {Layer::block, {1, 2, 3}, name_hash("glass")}};
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(block, expected);
  world.store.make_int_layer(Layer::liquid).set({500, 2, 3}, 90);
  EXPECT_EQ(follower.take().entries(),
            (std::vector<VoxelEntry>{{Layer::liquid, {500, 2, 3}, 90}, {Layer::liquid, {500, 2, 3}, 100}}));
  EXPECT_TRUE(follower.take().empty());
}

}  // namespace
}  // namespace tools
