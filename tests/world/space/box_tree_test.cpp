#include "world/space/box_tree.h"

#include <cmath>

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace world {
namespace {

struct Ball {
  Vec3d centre;
  double radius;
};

/// Where a ray of unit direction meets it first from outside; negative: nowhere.
double meet(const Ball& b, const Vec3d& origin, const Vec3d& direction) {
  const Vec3d to = b.centre - origin;
  const double along = dot(to, direction), h = b.radius * b.radius - (dot(to, to) - along * along);
  return h > 0 && along - std::sqrt(h) > 0 ? along - std::sqrt(h) : -1;
}

TEST(BoxTree, FindsWhatALoopFindsNearestWithinTheLimit) {
  const auto u = [](int64_t i, int salt) { return uniform01_double(random_bits(3, i, salt, 0)); };
  for (const int count : {0, 1, 3, 4, 5, 100, 3000}) {
    std::vector<Ball> balls;
    std::vector<Box> boxes;
    for (int i = 0; i < count; ++i) {
      // Some twice: the first of the list counts.
      const Ball ball =
          i % 7 == 6 ? balls.back() : Ball{{100 * u(i, 0), 20 * u(i, 1), 100 * u(i, 2)}, 0.2 + 3 * u(i, 3) * u(i, 4)};
      balls.push_back(ball);
      boxes.push_back({ball.centre - ball.radius, ball.centre + ball.radius});
    }
    const BoxTree tree(boxes);
    int met = 0;
    for (int ray = 0; ray < 2000; ++ray) {
      const double z = 2 * u(ray, 5) - 1, phi = 6.283185307 * u(ray, 6), r = std::sqrt(1 - z * z);
      Vec3d direction(r * std::cos(phi), z, r * std::sin(phi));
      if (ray % 10 == 0) direction = Vec3d(ray % 3 == 0, ray % 3 == 1, ray % 3 == 2);  // along axes
      const Vec3d origin(100 * u(ray, 7), 20 * u(ray, 8), 100 * u(ray, 9));
      const double limit = ray % 4 == 0 ? 20 : std::numeric_limits<double>::infinity();
      int expected = -1;
      double nearest = limit;
      for (int i = 0; i < count; ++i) {
        const double t = meet(balls[static_cast<size_t>(i)], origin, direction);
        if (t >= 0 && (expected < 0 ? t <= nearest : t < nearest)) nearest = t, expected = i;
      }
      const auto test = [&](int i) { return meet(balls[static_cast<size_t>(i)], origin, direction); };
      ASSERT_EQ(tree.nearest(origin, direction, test, limit), expected) << count << ' ' << ray;
      met += expected >= 0;
    }
    if (count >= 100) {
      EXPECT_GT(met, 50);
    }
  }
}

}  // namespace
}  // namespace world
