#include "world/space/coords.h"

#include <limits>
#include <unordered_set>

#include <gtest/gtest.h>

#include "world/space/world_point.h"

namespace world {
namespace {

TEST(Coords, LeavesAndRegionsTileTheWorldAcrossZero) {
  EXPECT_EQ(leaf_from_voxel({-1, 0, 7}), (LeafPos{-1, 0, 0}));
  EXPECT_EQ(leaf_from_voxel({-8, 8, -9}), (LeafPos{-1, 1, -2}));
  EXPECT_EQ(region_from_voxel({-1, 127, 128}), (RegionPos{-1, 0, 1}));
  EXPECT_EQ(region_from_leaf({-1, 15, 16}), (RegionPos{-1, 0, 1}));
  for (int x = -300; x <= 300; ++x) {
    const VoxelPos v{x, -x, 2 * x};
    const LeafPos leaf = leaf_from_voxel(v);
    const VoxelPos origin = voxel_from_leaf(leaf);
    ASSERT_LE(origin.x, v.x);
    ASSERT_LT(v.x, origin.x + kLeafSize);
    ASSERT_EQ(origin + offset_in_leaf(index_in_leaf(v)), v);
    ASSERT_EQ(region_from_leaf(leaf), region_from_voxel(v));
    ASSERT_EQ(leaf_from_region(region_from_leaf(leaf)) + leaf_offset_in_region(index_in_region(leaf)), leaf);
  }
}

TEST(Coords, TheIndexInALeafIsOpenVdbsOrder) {
  EXPECT_EQ(index_in_leaf({1, 0, 0}), 64);
  EXPECT_EQ(index_in_leaf({0, 1, 0}), 8);
  EXPECT_EQ(index_in_leaf({0, 0, 1}), 1);
  EXPECT_EQ(index_in_leaf({-1, -1, -1}), 511);
  for (int i = 0; i < kLeafVoxels; ++i) ASSERT_EQ(index_in_leaf(offset_in_leaf(i)), i);
  for (int i = 0; i < kLeavesPerRegion; ++i) ASSERT_EQ(index_in_region(leaf_offset_in_region(i)), i);
}

TEST(Coords, TheBorderIsWhereOpenVdbsArithmeticIsStillSafe) {
  EXPECT_TRUE(inside_world({kWorldBorder - 1, -kWorldBorder, 0}));
  EXPECT_FALSE(inside_world({kWorldBorder, 0, 0}));
  EXPECT_FALSE(inside_world({0, -kWorldBorder - 1, 0}));
  EXPECT_FALSE(inside_world({0, 0, std::numeric_limits<int32_t>::min()}));
  // Whole regions only, and room for a node of 4096 beyond.
  static_assert(kWorldBorder % kRegionSize == 0 && kWorldBorder + 4096 <= 1 << 30);
}

TEST(Coords, ABoxCountsItsVoxelsWithoutOverflow) {
  EXPECT_EQ(VoxelBox{}.volume(), 0u);
  EXPECT_TRUE(VoxelBox{}.empty());
  EXPECT_EQ((VoxelBox{{0, 0, 0}, {0, 0, 0}}.volume()), 1u);
  EXPECT_EQ((VoxelBox{{-2, -3, -4}, {2, 3, 4}}.volume()), 5u * 7 * 9);
  // 65536 x 65536 x 1 does not fit into 32 bits.
  EXPECT_EQ((VoxelBox{{0, 0, 0}, {65535, 65535, 0}}.volume()), 1ull << 32);
  EXPECT_EQ((VoxelBox{{-kWorldBorder, 0, 0}, {kWorldBorder - 1, 0, 0}}.volume()), 2ull * kWorldBorder);
  const VoxelPos low{-kWorldBorder, -kWorldBorder, -kWorldBorder},
      high{kWorldBorder - 1, kWorldBorder - 1, kWorldBorder - 1};
  EXPECT_EQ((VoxelBox{low, high}.volume()), UINT64_MAX);  // 2^93: saturates
}

TEST(Coords, ABoxGrowsToWhatItIncludes) {
  VoxelBox box;
  EXPECT_FALSE(box.contains({0, 0, 0}));
  box.include(VoxelPos{5, -1, 2});
  EXPECT_EQ(box, (VoxelBox{{5, -1, 2}, {5, -1, 2}}));
  box.include(VoxelPos{-3, 4, 2});
  EXPECT_EQ(box, (VoxelBox{{-3, -1, 2}, {5, 4, 2}}));
  box.include(VoxelBox{});
  EXPECT_EQ(box.volume(), 9u * 6);
  EXPECT_TRUE(box.contains({0, 0, 2}));
  EXPECT_FALSE(box.contains({0, 0, 3}));
}

TEST(Coords, FacesComeInPairsWithOppositeSteps) {
  EXPECT_EQ(face_step(kFaceNegX), (VoxelPos{-1, 0, 0}));
  EXPECT_EQ(face_step(kFacePosZ), (VoxelPos{0, 0, 1}));
  for (int f = 0; f < kFaces; ++f) {
    EXPECT_EQ(face_step(f) + face_step(opposite_face(f)), (VoxelPos{0, 0, 0}));
    EXPECT_EQ(face_step(f)[face_axis(f)], face_sign(f));
  }
}

TEST(Coords, HashesOfNeighboursDiffer) {
  std::unordered_set<size_t> hashes;
  for (int x = -20; x < 20; ++x)
    for (int y = -20; y < 20; ++y)
      for (int z = -20; z < 20; ++z) hashes.insert(PosHash{}(LeafPos{x, y, z}));
  EXPECT_EQ(hashes.size(), 64000u);
}

TEST(WorldPoint, TheFractionIsInZeroToOneAlsoJustBelowAnInteger) {
  for (double x : {0.0, -0.0, 0.25, -0.25, -1.0, -1e-20, -0x1p-60, 1e9 + 0.5, -1e9 - 0.5, std::nextafter(1.0, 0.0)}) {
    const WorldPoint p = WorldPoint::from(x, 0, 0);
    EXPECT_GE(p.fraction.x, 0.0) << x;
    EXPECT_LT(p.fraction.x, 1.0) << x;
    EXPECT_EQ(p.voxel.x, static_cast<int32_t>(std::floor(x))) << x;
    EXPECT_NEAR(p.voxel.x + p.fraction.x, x, 0x1p-53) << x;
  }
}

TEST(WorldPoint, AMillimetreIsAMillimetreABillionMetresOut) {
  const WorldPoint far{{1'000'000'000, -1'000'000'000, 5}, {0.25, 0.5, 0.0}};
  const WorldPoint moved = far + Vec3d(0.001, -0.6, -0.001);
  EXPECT_EQ(moved.voxel, (VoxelPos{1'000'000'000, -1'000'000'001, 4}));
  const Vec3d step = moved - far;
  EXPECT_NEAR(step.x, 0.001, 1e-15);
  EXPECT_NEAR(step.y, -0.6, 1e-15);
  EXPECT_NEAR(step.z, -0.001, 1e-15);
  const WorldPoint other{{-1'000'000'000, 0, 0}, {0.25, 0.0, 0.0}};
  EXPECT_EQ((far - other).x, 2e9);
}

}  // namespace
}  // namespace world
