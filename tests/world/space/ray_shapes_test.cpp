#include "world/space/ray_shapes.h"

#include <gtest/gtest.h>

#include "world/space/world_point.h"

namespace world {

TEST(RayShapes, SphereHitsAreThoseOfOpenVdbsTestRay) {
  // Eye (2, 1, 1); the centres are subtracted.
  const Vec3d direction(-1, 2, 3);
  const auto hits = intersect_sphere<double>(Vec3d(2, 1, 1) - Vec3d(2, 3, 4), direction, 1);
  ASSERT_TRUE(hits.has_value());
  EXPECT_NEAR(hits->t0, 12.0 / 14, 1e-15);
  EXPECT_EQ(hits->t1, 1.0);
  EXPECT_FALSE(intersect_sphere<double>(Vec3d(2, 1, 1) - Vec3d(3, 3, 4), direction, 1).has_value());
}

}  // namespace world
