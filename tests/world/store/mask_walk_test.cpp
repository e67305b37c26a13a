#include "world/store/mask_walk.h"

#include <array>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace world {
namespace {

MaskVolume volume_of(const std::vector<VoxelPos>& voxels) {
  MaskVolume volume;
  for (const VoxelPos v : voxels) {
    LeafMask mask = volume.leaf(leaf_from_voxel(v));
    mask.set(index_in_leaf(v));
    volume.set_leaf(leaf_from_voxel(v), mask);
  }
  return volume;
}

// Each voxel and its six face neighbours.
std::vector<VoxelPos> dilated(const std::vector<VoxelPos>& voxels) {
  std::vector<VoxelPos> all = voxels;
  for (const VoxelPos v : voxels)
    for (int face = 0; face < kFaces; ++face) all.push_back(v + face_step(face));
  return all;
}

using Intervals = std::vector<std::pair<double, double>>;

// Where the ray is in leaves with any voxel set; touching intervals are joined, empty ones dropped.
Intervals leaf_intervals(const MaskVolume& volume, const GridRay& ray) {
  const GridAxes axes(ray);
  WalkPlace place{ray.voxel, 0, -1};
  Intervals found;
  for (int i = 0; i < 100; ++i) {
    const bool any = !volume.leaf(leaf_from_voxel(place.voxel)).is_none();
    const double from = place.t;
    if (!mask_walk::leave_cube(axes, place, 7, 1000)) break;
    if (!any || place.t == from) continue;
    if (!found.empty() && found.back().second == from)
      found.back().second = place.t;
    else
      found.emplace_back(from, place.t);
  }
  return found;
}

TEST(MaskWalk, LeafIntervalsAreThoseOfOpenVdbsVolumeRayIntersector) {
  const GridRay along_x(WorldPoint::from(-1, 0, 0), Vec3d(1, 0, 0));
  const std::vector<VoxelPos> corners = {{0, 0, 0}, {7, 7, 7}}, inner = {{1, 1, 1}, {7, 3, 3}};
  EXPECT_EQ(leaf_intervals(volume_of(corners), along_x), (Intervals{{1, 9}}));
  EXPECT_EQ(leaf_intervals(volume_of(dilated(corners)), along_x), (Intervals{{0, 17}}));
  EXPECT_EQ(leaf_intervals(volume_of(inner), along_x), (Intervals{{1, 9}}));
  EXPECT_EQ(leaf_intervals(volume_of(dilated(inner)), along_x), (Intervals{{1, 17}}));
  EXPECT_EQ(leaf_intervals(volume_of({{0, 0, 0}, {8, 0, 0}, {15, 7, 7}}), along_x), (Intervals{{1, 17}}));
  EXPECT_EQ(leaf_intervals(volume_of({{0, 0, 0}, {8, 0, 0}, {24, 0, 0}, {31, 7, 7}}), along_x),
            (Intervals{{1, 17}, {25, 33}}));
  MaskVolume with_tile = volume_of({{0, 0, 0}, {8, 0, 0}, {24, 0, 0}});
  with_tile.set_leaf({4, 0, 0}, kAllMask);
  EXPECT_EQ(leaf_intervals(with_tile, along_x), (Intervals{{1, 17}, {25, 41}}));
  EXPECT_EQ(leaf_intervals(volume_of({{0, 0, 0}, {8, 0, 0}, {24, 0, 0}}),
                           GridRay(WorldPoint::from(50, 0, 0), Vec3d(-1, 0, 0))),
            (Intervals{{18, 26}, {34, 50}}));
  const MaskVolume cross = volume_of(dilated({{0, 0, 0}}));
  EXPECT_TRUE(leaf_intervals(cross, GridRay(WorldPoint::from(-0.25, -0.25, 10), Vec3d(0, 0, -1))).empty());
  EXPECT_FALSE(leaf_intervals(cross, GridRay(WorldPoint::from(0.75, 0.75, 10), Vec3d(0, 0, -1))).empty());
}

TEST(MaskWalk, NodeTimesAreThoseOfOpenVdbsTestRay) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double length : {1.0, 2.0}) {
      Vec3d direction(0.0);
      direction[axis] = length;
      const GridAxes axes(GridRay({{0, 0, 0}, Vec3d(0.0)}, direction));
      WalkPlace place{{0, 0, 0}, 0, -1};
      for (int i = 1; i <= 10; ++i) {
        ASSERT_TRUE(mask_walk::leave_cube(axes, place, 7, kInfinity));
        EXPECT_EQ(place.t, 8 * i / length);
      }
    }
  const GridAxes wide(GridRay(WorldPoint::from(-1, 0, 0), Vec3d(1, 0, 0)));
  WalkPlace place{{-1, 0, 0}, 0, -1};
  ASSERT_TRUE(mask_walk::leave_cube(wide, place, 4095, kInfinity));
  EXPECT_EQ(place.t, 1);
  ASSERT_TRUE(mask_walk::leave_cube(wide, place, 4095, kInfinity));
  EXPECT_EQ(place.t, 4097);
}

TEST(MaskWalk, ZeroAndTinyComponentsLeaveNodesAtTheSameTimes) {
  for (const Vec3d& direction : {Vec3d(1, 0, 0), Vec3d(1, -0.0, -0.0), Vec3d(1, -1e-9, -1e-9)}) {
    const GridAxes axes(GridRay(WorldPoint::from(2, 0, 0), direction));
    WalkPlace place{{2, 0, 0}, 0, -1};
    while (place.t == 0) ASSERT_TRUE(mask_walk::leave_cube(axes, place, 7, kInfinity));
    EXPECT_EQ(place.t, 6);
    ASSERT_TRUE(mask_walk::leave_cube(axes, place, 7, kInfinity));
    EXPECT_EQ(place.t, 14);
  }
}

TEST(MaskWalk, EnteredHitsLeaveTheSolidAroundTheStartFirst) {
  MaskVolume volume;
  for (int x = 0; x < 4; ++x) volume.set_leaf({x, 0, 0}, kAllMask);  // solid to x = 31
  LeafMask wall;
  wall.set(index_in_leaf({3, 4, 4}));
  volume.set_leaf({5, 0, 0}, wall);  // x = 43
  const MaskWalker walker(volume);
  const GridRay ray(WorldPoint::from(2.5, 4.5, 4.5), Vec3d(1, 0, 0));
  const GridHit inside = walker.first_set(ray), entered = walker.first_entered(ray);
  EXPECT_EQ(inside.voxel, (VoxelPos{2, 4, 4}));
  EXPECT_EQ(inside.face, kNoFace);
  ASSERT_TRUE(entered.hit());
  EXPECT_EQ(entered.voxel, (VoxelPos{43, 4, 4}));
  EXPECT_EQ(entered.face, kFaceNegX);
  EXPECT_EQ(entered.t, 40.5);
  EXPECT_FALSE(walker.first_entered(GridRay(WorldPoint::from(2.5, 4.5, 4.5), Vec3d(-1, 0, 0))).hit());
}

}  // namespace
}  // namespace world
