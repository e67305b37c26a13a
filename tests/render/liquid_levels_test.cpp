/// How high liquids stand, against the rule voxel by voxel, and what it costs to follow them.
#include "render/liquid_levels.h"

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace render {
namespace {

using namespace world;

BlockId id(const World& w, const char* name) { return *w.palette->find(name); }

TEST(LiquidLevels, AreTheAmountInSixteenthsWhereNoLiquidLiesAbove) {
  World w(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {7, 0, 0}}, id(w, "water"));
  batch.set({5, 1, 0}, id(w, "oil"));
  batch.set({6, 1, 0}, id(w, "glass"));
  batch.fill({{0, 7, 3}, {0, 8, 3}}, id(w, "lava"));  // over a seam of leaves
  batch.set({1, 7, 3}, id(w, "lava"));
  CHECK(w.store.apply(batch).ok());
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  const int32_t of[] = {1, 127, 128 + 256, 2048, 4095, 2048, 2048};
  for (int x = 0; x < 7; ++x) amounts.set({x, 0, 0}, of[x]);
  amounts.set({0, 7, 3}, 1024), amounts.set({0, 8, 3}, 1024), amounts.set({1, 7, 3}, 1024);
  LiquidLevels levels;
  levels.follow(WorldView(w));
  const int expected[] = {1, 1, 2, 8, 16, 16, 8, 16};
  for (int x = 0; x < 8; ++x) EXPECT_EQ(levels.at({x, 0, 0}), expected[x]) << x;
  EXPECT_EQ(levels.at({0, 7, 3}), 16);
  EXPECT_EQ(levels.at({0, 8, 3}), 4);
  EXPECT_EQ(levels.at({1, 7, 3}), 4);
  EXPECT_TRUE(levels.above_surface(WorldPoint::from(3.5, 0.51, 0.5)));
  EXPECT_FALSE(levels.above_surface(WorldPoint::from(3.5, 0.49, 0.5)));
  EXPECT_FALSE(levels.above_surface(WorldPoint::from(4.5, 0.99, 0.5)));
}

TEST(LiquidLevels, OfAWorldWhoseLiquidsAreFullAreNone) {
  World w(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {63, 7, 63}}, id(w, "water"));
  CHECK(w.store.apply(batch).ok());
  LiquidLevels levels;
  EXPECT_TRUE(levels.follow(WorldView(w)).empty());
  EXPECT_FALSE(levels.any());
  EXPECT_EQ(levels.looked_at(), 0u);
}

TEST(LiquidLevels, FollowAmountsAndBlocksAsIfMadeAnewAndLookAtNothingThatRests) {
  World w(standard_blocks());
  const BlockId blocks[] = {kAir, id(w, "water"), id(w, "water"), id(w, "lava"), id(w, "stone")};
  LiquidLevels followed;
  for (uint64_t step = 0; step < 12; ++step) {
    EditBatch batch;
    for (uint64_t i = 0; i < (step == 0 ? 4000 : 40); ++i) {
      const uint64_t h = mix64(step * 1000 + i);
      batch.set({static_cast<int>(h % 20), static_cast<int>(h >> 8 & 15), static_cast<int>(h >> 16 & 15)},
                blocks[(h >> 32) % 5]);
    }
    CHECK(w.store.apply(batch).ok());
    for (uint64_t i = 0; i < 60; ++i) {
      const uint64_t h = mix64(step * 10000 + i + 5000);
      const VoxelPos v{static_cast<int>(h % 20), static_cast<int>(h >> 8 & 15), static_cast<int>(h >> 16 & 15)};
      w.store.make_int_layer(Layer::liquid).set(v, static_cast<int32_t>(1 + (h >> 32) % 4096));
    }
    if (step == 8) w.store.drop_layer(Layer::liquid);
    const WorldView view(w);
    LiquidLevels before, anew;
    const std::vector<LeafPos> changed = followed.follow(view);
    anew.follow(view);
    ASSERT_EQ(followed.leaves().size(), anew.leaves().size()) << step;
    for (const auto& [leaf, levels] : anew.leaves()) {
      ASSERT_NE(followed.leaf(leaf), nullptr);
      EXPECT_EQ(*followed.leaf(leaf), *levels) << step;
    }
    EXPECT_EQ(followed.any(), step != 8);
    EXPECT_FALSE(changed.empty());
    const uint64_t looked_at = followed.looked_at();
    EXPECT_TRUE(followed.follow(view).empty());
    EXPECT_EQ(followed.looked_at(), looked_at) << "nothing has changed";
  }
}

TEST(LiquidLevels, ChangeInNoLeafWhereAnAmountMovesByLessThanAStep) {
  World w(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {7, 0, 7}}, id(w, "water"));
  CHECK(w.store.apply(batch).ok());
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  for (int x = 0; x < 8; ++x)
    for (int z = 0; z < 8; ++z) amounts.set({x, 0, z}, 2000);
  LiquidLevels levels;
  levels.follow(WorldView(w));
  amounts.set({3, 0, 3}, 2100);
  EXPECT_TRUE(levels.follow(WorldView(w)).empty());
  amounts.set({3, 0, 3}, 2400);
  EXPECT_EQ(levels.follow(WorldView(w)), (std::vector<LeafPos>{{0, 0, 0}}));
}

}  // namespace
}  // namespace render
