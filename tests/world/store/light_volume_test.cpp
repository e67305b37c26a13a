#include "world/store/light_volume.h"

#include <vector>

#include <gtest/gtest.h>

namespace world {
namespace {

int level_at(uint64_t seed, int leaf, int voxel) {
  return static_cast<int>(random_bits(seed, leaf, voxel, 0) % (kMaxLight + 1));
}

LightLeaf random_leaf(uint64_t seed, int leaf) {
  LightLeaf made;
  for (int i = 0; i < kLeafVoxels; ++i) made.set(i, level_at(seed, leaf, i));
  return made;
}

TEST(LightVolume, ALeafHoldsAnyLevelsAndSaysWhichVoxelsHaveOne) {
  const LightLeaf leaf = random_leaf(1, 0);
  for (int i = 0; i < kLeafVoxels; ++i) {
    ASSERT_EQ(leaf.get(i), level_at(1, 0, i)) << i;
    for (int level = 0; level <= kMaxLight; ++level)
      ASSERT_EQ(leaf.equal(i >> 6, level) >> (i & 63) & 1, level == level_at(1, 0, i)) << i;
  }
}

TEST(LightVolume, RegionsKeepTheirLeavesWhileOthersComeAndGo) {
  LightRegion region;
  region.set_tile(3);
  std::vector<int> tile(kLeavesPerRegion, 3);  // -1: mixed, seeded by `version`
  std::vector<uint64_t> version(kLeavesPerRegion, 0);
  for (uint64_t round = 1; round <= 6; ++round) {
    region.split();
    for (int n = 0; n < 900; ++n) {
      const int i = static_cast<int>(random_bits(round, n, 1, 0) % kLeavesPerRegion);
      if (random_bits(round, n, 2, 0) % 3) {
        tile[static_cast<size_t>(i)] = static_cast<int>(random_bits(round, n, 3, 0) % 16);
        region.set_leaf(i, tile[static_cast<size_t>(i)]);
        EXPECT_FALSE(region.set_leaf(i, tile[static_cast<size_t>(i)])) << "nothing changed";
      } else {
        tile[static_cast<size_t>(i)] = -1, version[static_cast<size_t>(i)] = round;
        region.set_leaf(i, random_leaf(round, i));
        EXPECT_FALSE(region.set_leaf(i, random_leaf(round, i))) << "nothing changed";
      }
    }
    region.join();
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const size_t at = static_cast<size_t>(i);
      const LightLeafView leaf = region.leaf(i);
      if (tile[at] >= 0)
        ASSERT_TRUE(!leaf.leaf && leaf.tile == tile[at]) << i;
      else
        ASSERT_TRUE(leaf.leaf && *leaf.leaf == random_leaf(version[at], i)) << i;
    }
  }
}

TEST(LightVolume, ARegionOfOneLevelCostsNoLeaves) {
  LightRegion region;
  const size_t empty = region.bytes();
  region.split();
  for (int i = 0; i < kLeavesPerRegion; ++i) region.set_leaf(i, random_leaf(1, i));
  EXPECT_GE(region.bytes(), size_t{kLeavesPerRegion} * sizeof(LightLeaf));
  region.join();
  // Holes are given back once there are many.
  for (int i = 0; i < kLeavesPerRegion; ++i)
    if (i % 16) region.set_leaf(i, 7);
  region.join();
  EXPECT_LE(region.bytes(), (size_t{kLeavesPerRegion} / 16 + 64) * sizeof(LightLeaf) + empty + 16384);
  EXPECT_TRUE(*region.leaf(32).leaf == random_leaf(1, 32));
  for (int i = 0; i < kLeavesPerRegion; ++i) region.set_leaf(i, 7);
  region.join();
  EXPECT_TRUE(region.is_tile());
  EXPECT_EQ(region.bytes(), empty);
  EXPECT_EQ(region.leaf(99).tile, 7);
}

TEST(LightVolume, ItsHashKnowsLevelsAndPlacesOnly) {
  LightVolume a(LightModel::flood4, 15, false), b(LightModel::flood4, 15, false);
  EXPECT_EQ(a.content_hash(), b.content_hash());
  LightRegion& left = a.sky().regions().insert({1, 2, 3});
  LightRegion& right = b.sky().regions().insert({1, 2, 3});
  EXPECT_EQ(a.content_hash(), b.content_hash());
  left.set_tile(9);
  EXPECT_NE(a.content_hash(), b.content_hash());
  right.split();
  for (int i = 0; i < kLeavesPerRegion; ++i) right.set_leaf(i, LightLeaf::of(9));  // the same levels, voxel by voxel
  EXPECT_EQ(a.content_hash(), b.content_hash());
  b.sky().regions().insert({1, 2, 4}).set_tile(0);
  EXPECT_NE(a.content_hash(), b.content_hash());
  EXPECT_NE(LightVolume(LightModel::flood_rgb, 15, false).content_hash(),
            LightVolume(LightModel::flood4, 15, false).content_hash());
}

TEST(LightVolume, OutsideOfItsRegionsTheSkyIsOpenAndNoLampShines) {
  const LightVolume volume(LightModel::flood_rgb, 14, true);
  EXPECT_EQ(volume.fields().size(), 6u);
  const LightSample sample = volume.sample({1 << 29, -(1 << 29), 0});
  for (size_t band = 0; band < 3; ++band) {
    EXPECT_EQ(sample.sky[band], 14);
    EXPECT_EQ(sample.block[band], 0);
  }
  const LightVolume none(LightModel::none, 15, false);
  EXPECT_EQ(none.fields().size(), 0u);
  EXPECT_EQ(none.sample({0, 0, 0}).sky[0], 0);
}

TEST(RegionTable, FindsWhatWasPutInAlsoWhereRegionsLieFarApart) {
  RegionTable<int> table;
  for (int i = 0; i < 50; ++i) table.insert_later({i, -i, i % 7}) = i;
  table.finish();
  for (int i = 0; i < 50; ++i) EXPECT_EQ(*table.find({i, -i, i % 7}), i);
  EXPECT_EQ(table.find({0, 1, 0}), nullptr);
  EXPECT_EQ(table.find({1 << 23, 0, 0}), nullptr);
  table.insert({8'000'000, -8'000'000, 5}) = 77;  // too wide for a dense table
  EXPECT_EQ(*table.find({8'000'000, -8'000'000, 5}), 77);
  EXPECT_EQ(*table.find({49, -49, 0}), 49);
  table.erase({8'000'000, -8'000'000, 5});
  EXPECT_EQ(table.find({8'000'000, -8'000'000, 5}), nullptr);
  EXPECT_EQ(*table.find({3, -3, 3}), 3);
  EXPECT_EQ(table.positions().front(), (RegionPos{0, 0, 0}));
  for (const RegionPos& r : table.positions()) table.erase_later(r);
  table.finish();
  EXPECT_TRUE(table.empty());
  EXPECT_EQ(table.find({0, 0, 0}), nullptr);
}

}  // namespace
}  // namespace world
