#include "world/space/grid_walk.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "world/space/grid_walk_variants.h"

namespace world {
namespace {

TEST(GridWalk, StepsAlongEachAxisAtWholeTimes) {
  // Vectors of OpenVDB's TestRay. Downwards from fraction 0 the start is left at t = 0, by our rule, so the walk is one
  // step ahead.
  for (int axis = 0; axis < 3; ++axis)
    for (const int sign : {1, -1}) {
      Vec3d direction(0.0);
      direction[axis] = sign;
      FlatWalk walk(GridRay({{0, 0, 0}, Vec3d(0.0)}, direction));
      if (sign < 0) {
        walk.step();
        EXPECT_EQ(walk.t(), 0.0);
      }
      for (int i = 1; i <= 10; ++i) {
        walk.step();
        EXPECT_EQ(walk.t(), i);
        EXPECT_EQ(walk.face(), entered_face(axis, sign > 0));
      }
    }
}

TEST(GridWalk, MeetsThePlanesOfOpenVdbsTestRay) {
  FlatWalk along_x(GridRay(WorldPoint::from(0.5, 4.7, -9.8), Vec3d(-1, 0, 0)));
  while (along_x.voxel().x > -5) along_x.step();
  EXPECT_NEAR(along_x.t(), 4.5, 1e-6);
  FlatWalk along_y(GridRay(WorldPoint::from(4.7, 0.5, -9.8), Vec3d(0, 1, 0)));
  while (along_y.voxel().y < 4) along_y.step();
  EXPECT_NEAR(along_y.t(), 3.5, 1e-6);
}

TEST(GridWalk, BoxIntervalsAreThoseOfOpenVdbsTestRay) {
  const GridRay ray(WorldPoint::from(2, 1, 1), Vec3d(-1, 2, 3));
  const RayInterval through = intersect_box(ray, Vec3d(0, 2, 2), Vec3d(2, 4, 6));
  EXPECT_NEAR(through.t0, 0.5, 1e-6);
  EXPECT_NEAR(through.t1, 1.5, 1e-6);
  const RayInterval edge = intersect_box(ray, Vec3d(1.5, 2, 2), Vec3d(4.5, 4, 6));
  ASSERT_FALSE(edge.empty());
  EXPECT_NEAR(edge.t0, 0.5, 1e-6);
  EXPECT_NEAR(edge.t1, 0.5, 1e-6);
  EXPECT_TRUE(intersect_box(ray, Vec3d(4, 2, 2), Vec3d(6, 4, 6)).empty());
}

// The property test of Luanti's test_voxelalgorithms; its voxels are centred on integers, so all is moved by a half.
void check_line(const Vec3d& from, const Vec3d& to) {
  const WorldPoint start = WorldPoint::from(from.x + 0.5, from.y + 0.5, from.z + 0.5);
  const WorldPoint end = WorldPoint::from(to.x + 0.5, to.y + 0.5, to.z + 0.5);
  const Vec3d along = to - from;
  FlatWalk walk = FlatWalk::segment(start, end);
  VoxelPos before = walk.voxel(), last = before;
  EXPECT_EQ(walk.voxel(), start.voxel);
  for (; walk.inside(); walk.step()) {
    const VoxelPos v = walk.voxel();
    if (walk.steps() > 0) {
      EXPECT_EQ(std::abs(v.x - before.x) + std::abs(v.y - before.y) + std::abs(v.z - before.z), 1);
    }
    double low = 0, high = 1;
    for (int a = 0; a < 3; ++a) {
      const double near = v[a] - 0.5 - 1e-5 - from[a], far = v[a] + 0.5 + 1e-5 - from[a];
      if (along[a] == 0) {
        EXPECT_TRUE(near <= 0 && far >= 0);
        continue;
      }
      low = std::max(low, std::min(near / along[a], far / along[a]));
      high = std::min(high, std::max(near / along[a], far / along[a]));
    }
    EXPECT_LE(low, high) << "the line misses a visited voxel";
    before = last = v;
  }
  EXPECT_EQ(last, end.voxel);
  uint64_t manhattan = 0;
  for (int a = 0; a < 3; ++a) manhattan += static_cast<uint64_t>(std::abs(end.voxel[a] - start.voxel[a]));
  EXPECT_EQ(walk.steps(), manhattan);
}

TEST(GridWalk, LinesHaveThePropertiesThatLuantiTests) {
  check_line(Vec3d(0.0), Vec3d(0.0));
  for (double x = -9.1; x < 9; x += 3.124)
    for (double y = -9.2; y < 9; y += 3.123)
      for (double z = -9.3; z < 9; z += 3.122) check_line(-Vec3d(x, y, z), Vec3d(x, y, z));
  for (double x = -3; x <= 3; x += 0.5)
    for (double y = -3; y <= 3; y += 0.5)
      for (double z = -3; z <= 3; z += 0.5) check_line(-Vec3d(x, y, z), Vec3d(x, y, z));
}

TEST(GridWalk, SurfaceRayStartsOnTheFaceInTheVoxelInFrontOfIt) {
  const GridRay ray({{0, 0, 0}, Vec3d(0.25, 0.5, 0.75)}, Vec3d(1, 0.03125, -0.0625));
  const GridHit hit = first_hit_flat(ray, [](VoxelPos v) { return v.x == 4; });
  ASSERT_TRUE(hit.hit());
  EXPECT_EQ(hit.face, kFaceNegX);
  EXPECT_EQ(hit.t, 3.75);
  const GridRay shadow = ray_from_surface(ray, hit, Vec3d(-1, 1, 0));
  EXPECT_EQ(shadow.voxel, (VoxelPos{3, 0, 0}));
  EXPECT_EQ(shadow.fraction, Vec3d(1, 0.5 + 3.75 * 0.03125, 0.75 - 3.75 * 0.0625));
}

// The ladder's own claim: each method's walk is the exact one as long as its numbers are.
TEST(GridWalkVariants, AllAgreeWithTheExactWalkOnShortRaysNearTheOrigin) {
  FixedRay ray;
  for (int a = 0; a < 3; ++a) ray.origin[a] = (int64_t{a + 1} << 32) + (int64_t{3 * a + 5} << 28);
  ray.direction[0] = 7 << 20, ray.direction[1] = -(5 << 20), ray.direction[2] = 3 << 20;
  ExactWalk exact(ray);
  AccumulateWalk<float> accumulate(ray);
  RecomputeWalk<float> recompute(ray);
  DoubleWalk in_double(ray);
  FixedWalk fixed(ray);
  for (int i = 0; i < 60; ++i) {
    exact.step(), accumulate.step(), recompute.step(), in_double.step(), fixed.step();
    for (int a = 0; a < 3; ++a) {
      EXPECT_EQ(exact.cell(a), accumulate.cell(a));
      EXPECT_EQ(exact.cell(a), recompute.cell(a));
      EXPECT_EQ(exact.cell(a), in_double.cell(a));
      EXPECT_EQ(exact.cell(a), fixed.cell(a));
    }
  }
}

}  // namespace
}  // namespace world
