// Hard cases S1..S4, S7, S8: rays from a surface to the sun. S5 and S6 need lamps, S9 bodies.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "render/shading.h"
#include "world/base/random.h"
#include "world/space/grid_walk_variants.h"
#include "world/store/mask_walk.h"

namespace world {
namespace {

double uniform(uint64_t seed, int index, double low, double high) {
  return low + (high - low) * uniform01_double(random_bits(seed, index, 0, 0));
}

void fill(MaskVolume& volume, const VoxelBox& box) {
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const VoxelPos v{x, y, z};
        LeafMask mask = volume.leaf(leaf_from_voxel(v));
        mask.set(index_in_leaf(v));
        volume.set_leaf(leaf_from_voxel(v), mask);
      }
}

/// Rays at the face of a wall that begins (sign -1) or ends (sign 1) at the plane; returns how many of them find the
/// lone convex wall in their own way to the sun.
int acne(int32_t plane, int sign) {
  MaskVolume volume;
  fill(volume,
       sign < 0 ? VoxelBox{{plane, 0, 0}, {plane + 3, 31, 31}} : VoxelBox{{plane - 4, 0, 0}, {plane - 1, 31, 31}});
  const MaskWalker walker(volume);
  const Vec3d sun = glm::normalize(Vec3d(sign * 0.31, 0.72, 0.36));
  int shadowed = 0, hits = 0;
  for (int i = 0; i < 10000; ++i) {
    GridRay ray;
    ray.voxel = {plane + sign * 20, 16, 16};
    for (int a = 0; a < 3; ++a) ray.fraction[a] = uniform(1, i * 3 + a, 0, 1);
    ray.direction = glm::normalize(Vec3d(-sign, uniform(2, i, -0.5, 0.5), uniform(3, i, -0.5, 0.5)));
    const GridHit hit = walker.first_set(ray);
    if (!hit.hit() || hit.face != (sign < 0 ? kFaceNegX : kFacePosX)) continue;
    ++hits;
    shadowed += walker.any_set(ray_from_surface(ray, hit, sun));
  }
  EXPECT_GT(hits, 9000);
  return shadowed;
}

TEST(HardCaseS1, FacesHaveNoAcneAtAnyCoordinate) {
  for (const int32_t plane : {4096, 100000, 1000000, 16777216, 1000000000, -16777216})
    for (const int sign : {-1, 1}) EXPECT_EQ(acne(plane, sign), 0) << plane;
}

TEST(HardCaseS2, FacesHaveNoAcneNextToTheOrigin) {
  EXPECT_EQ(acne(1, -1), 0);
  EXPECT_EQ(acne(1, 1), 0);
  EXPECT_EQ(acne(0, -1), 0);
}

TEST(HardCaseS3, NoLightLeaksUnderAThinWall) {
  MaskVolume volume;
  fill(volume, {{0, 0, 0}, {39, 0, 39}});    // floor, its top at y = 1
  fill(volume, {{20, 1, 0}, {20, 12, 39}});  // wall of one voxel that stands on it
  const MaskWalker walker(volume);
  int dark = 0, lit = 0;
  for (const double height : {0.001, 0.05, 0.3}) {
    const Vec3d sun = glm::normalize(Vec3d(1, height, 0.01));
    for (int i = 0; i < 20000; ++i) {
      // Straight down onto the floor, many of them at the wall's very foot.
      GridRay ray;
      ray.voxel = {i % 2 ? 19 : 19 - i % 15, 5, 20};
      ray.fraction = Vec3d(i % 2 ? 1 - std::ldexp(1.0, -1 - i % 60) : uniform(4, i, 0, 1), 0.5, uniform(5, i, 0, 1));
      ray.direction = Vec3d(0, -1, 0);
      const GridHit hit = walker.first_set(ray);
      ASSERT_EQ(hit.face, kFacePosY);
      (walker.any_set(ray_from_surface(ray, hit, sun)) ? dark : lit)++;
    }
  }
  EXPECT_EQ(lit, 0);
  EXPECT_EQ(dark, 60000);
}

TEST(HardCaseS4, ALightInAFacesPlaneAddsExactlyNothing) {
  Environment environment;
  environment.sun_direction = Vec3d(1, 0, 0);
  const BlockPalette palette = standard_blocks();
  const render::Shading shading(environment, palette);
  for (const int face : {kFaceNegY, kFacePosY, kFaceNegZ, kFacePosZ}) {
    EXPECT_FALSE(shading.sun_faces[face]);
    EXPECT_EQ(shading.face_radiance(1, face, true), shading.face_radiance(1, face, false));
    EXPECT_FALSE(std::isnan(shading.face_radiance(1, face, true).r));
  }
  // A ray along the plane meets no voxel below it.
  MaskVolume floor;
  fill(floor, {{0, 0, 0}, {63, 0, 7}});
  GridRay along;
  along.voxel = {0, 1, 3};
  along.fraction = Vec3d(0.5, 0.0, 0.5);
  along.direction = environment.sun_direction;
  EXPECT_FALSE(MaskWalker(floor).any_set(along));
}

TEST(HardCaseS7, NoLightPassesBetweenSolidsThatTouchAtAnEdge) {
  // Receiver: the face x = 0 (towards +x) of a wall at x = -1. Blockers touch at the edge x = 5, y = 9.
  MaskVolume volume;
  fill(volume, {{-1, 0, 0}, {-1, 15, 7}});
  fill(volume, {{5, 0, 0}, {12, 8, 7}});
  fill(volume, {{0, 9, 0}, {4, 16, 7}});
  const MaskWalker walker(volume);
  for (const double slope : {1.0, 0.5, 2.0, 0.25}) {
    // The line through the edge meets the wall at y = 9 - 5 * slope, exactly.
    const double y = 9 - 5 * slope;
    if (y < 0) continue;
    GridRay ray;
    ray.voxel = {3, static_cast<int32_t>(std::floor(y)), 3};
    ray.fraction = Vec3d(0.5, y - std::floor(y), 0.5);
    ray.direction = Vec3d(-1, 0, 0);
    const GridHit hit = walker.first_set(ray);
    ASSERT_EQ(hit.face, kFacePosX);
    for (const double z : {0.0, 0.125, -0.125})
      EXPECT_TRUE(walker.any_set(ray_from_surface(ray, hit, Vec3d(1, slope, z)))) << "slope " << slope;
  }
}

TEST(HardCaseS8, TheSunsShadowEqualsTheExactWalkAlongItsDirection) {
  MaskVolume volume;
  fill(volume, {{0, 0, 0}, {63, 0, 63}});
  for (int i = 0; i < 300; ++i) {
    const VoxelPos v{static_cast<int>(uniform(6, i, 0, 64)), static_cast<int>(uniform(7, i, 1, 30)),
                     static_cast<int>(uniform(8, i, 0, 64))};
    fill(volume, {v, v});
  }
  const MaskWalker walker(volume);
  int lit = 0, dark = 0;
  for (int s = 0; s < 4; ++s) {
    FixedRay exact;
    for (int a = 0; a < 3; ++a)
      exact.direction[a] = static_cast<int32_t>(uniform(9, s * 3 + a, a == 1 ? 0.2 : -1, 1) * 0x1p24);
    const Vec3d sun = exact.ray().direction;
    for (int i = 0; i < 5000; ++i) {
      GridRay ray;
      ray.voxel = {static_cast<int>(uniform(10, i, 0, 64)), 40, static_cast<int>(uniform(11, i, 0, 64))};
      ray.fraction = Vec3d(std::floor(uniform(12, i, 0, 256)) / 256, 0.5, std::floor(uniform(13, i, 0, 256)) / 256);
      ray.direction = Vec3d(0, -1, 0);
      const GridHit hit = walker.first_set(ray);
      ASSERT_TRUE(hit.hit());
      const GridRay shadow = ray_from_surface(ray, hit, sun);
      for (int a = 0; a < 3; ++a)
        exact.origin[a] = (int64_t{shadow.voxel[a]} << 32) + static_cast<int64_t>(shadow.fraction[a] * 0x1p32);
      ExactWalk walk(exact);
      bool blocked = false;
      while (!blocked && walk.cell(1) < 32) {
        blocked = volume.test({walk.cell(0), walk.cell(1), walk.cell(2)});
        walk.step();
      }
      ASSERT_EQ(walker.any_set(shadow), blocked) << "sun " << s << " ray " << i;
      (blocked ? dark : lit)++;
    }
  }
  EXPECT_GT(dark, 1000);
  EXPECT_GT(lit, 1000);
}

}  // namespace
}  // namespace world
