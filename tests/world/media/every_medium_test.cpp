// The laws of a medium, on all members of the folder: closed forms against quadrature, for rays of all kinds.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "world/media/brick_field.h"
#include "world/media/medium.h"
#include "world/space/grid_walk.h"

namespace world {
namespace {

struct Random {
  std::mt19937_64 bits;
  explicit Random(uint64_t seed) : bits(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(bits); }
  Vec3d in_cube(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
  Vec3d direction() {
    while (true) {
      const Vec3d d = in_cube(1);
      if (length(d) > 0.1 && length(d) < 1) return normalize(d);
    }
  }
};

/// Blobs and single voxels, over several leaves and a corner of regions.
std::shared_ptr<const DensityField> some_field(FieldSampling sampling) {
  std::vector<FieldLeaf> leaves;
  for (const LeafPos at :
       {LeafPos{0, 0, 0}, LeafPos{-1, 0, 0}, LeafPos{-1, -1, 0}, LeafPos{1, -1, -1}, LeafPos{0, 0, -1}}) {
    FieldLeaf leaf{at, {}};
    Random random(static_cast<uint64_t>(at.x * 9 + at.y * 3 + at.z + 100));
    for (int i = 0; i < kLeafVoxels; ++i) {
      const VoxelPos v = voxel_from_leaf(at) + offset_in_leaf(i);
      const double r = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
      leaf.values[static_cast<size_t>(i)] =
          static_cast<float>(random.uniform(0, 1) < 0.1 ? random.uniform(0, 4) : std::max(0.0, 1 - r / 7));
    }
    leaves.push_back(leaf);
  }
  return BrickField::make(std::move(leaves), sampling, "test").value();
}

/// One of each kind, grids of both samplings.
std::vector<Medium> every_medium() {
  std::vector<Medium> all;
  for (const std::string& kind : medium_kinds()) {
    Medium m;
    m.kind = kind;
    m.name = kind;
    m.half_extent = {3, 5, 2};
    m.normal = Vec3f(normalize(Vec3d(1, 4, -2)));
    m.scale_height = 6;
    if (kind != "density_grid") {
      all.push_back(m);
      continue;
    }
    m.voxel_size = 0.5;
    for (const FieldSampling sampling : {FieldSampling::nearest, FieldSampling::trilinear}) {
      m.field = some_field(sampling);
      m.name = sampling == FieldSampling::nearest ? "nearest grid" : "trilinear grid";
      all.push_back(m);
    }
  }
  return all;
}

double quadrature(const Medium& m, const Vec3d& origin, const Vec3d& direction, double t0, double t1, int steps) {
  double sum = 0;
  for (int i = 0; i < steps; ++i) sum += medium_density(m, origin + (t0 + (i + 0.5) * (t1 - t0) / steps) * direction);
  return sum * (t1 - t0) / steps;
}

class EveryMedium : public testing::TestWithParam<int> {
 protected:
  const Medium medium = every_medium()[static_cast<size_t>(GetParam())];
};
INSTANTIATE_TEST_SUITE_P(Members, EveryMedium, testing::Range(0, static_cast<int>(every_medium().size())),
                         [](const auto& member) {
                           std::string name = every_medium()[static_cast<size_t>(member.param)].name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(Media, EachFileOfTheFolderIsAKind) {
  const std::vector<std::string> kinds = medium_kinds();
  for (const char* kind : {"homogeneous", "height_fog", "box_fog", "ellipsoid_fog", "halfspace_fog", "density_grid"})
    EXPECT_EQ(std::count(kinds.begin(), kinds.end(), kind), 1) << kind;
  EXPECT_TRUE(std::is_sorted(kinds.begin(), kinds.end()));
}

TEST_P(EveryMedium, DepthIsTheIntegralOfTheDensity) {
  Random random(1);
  constexpr int kSteps = 20000;
  for (int i = 0; i < 100; ++i) {
    const Vec3d origin = random.in_cube(8), direction = random.direction();
    const double t0 = random.uniform(0, 5), t1 = t0 + random.uniform(0, 12);
    const double depth = medium_depth(medium, origin, direction, t0, t1);
    const double expected = quadrature(medium, origin, direction, t0, t1, kSteps);
    // Smooth: the midpoint rule's (t1 - t0)^3 f'' / 24 N^2 is below 1e-7. Each jump: half a step of at most 4.
    const double largest = medium_density_max(medium, origin, direction, t0, t1);
    const double jumps = medium.name == "nearest grid" ? 60 : 2;
    EXPECT_NEAR(depth, expected, 1e-6 * largest + jumps * 0.5 * largest * (t1 - t0) / kSteps) << "ray " << i;
    EXPECT_LE(depth, largest * (t1 - t0) * (1 + 1e-12));
  }
}

TEST_P(EveryMedium, TheIntervalHoldsAllDensityAndItsEndsAreTight) {
  Random random(2);
  int inside = 0, outside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3d origin = random.in_cube(8), direction = random.direction();
    const double t_max = random.uniform(0, 30);
    const MediumInterval in = medium_interval(medium, origin, direction, t_max);
    for (int k = 0; k < 50; ++k) {
      const double t = random.uniform(0, t_max);
      const bool near_end = std::abs(t - in.t0) < 1e-9 || std::abs(t - in.t1) < 1e-9;
      const double density = medium_density(medium, origin + t * direction);
      if (near_end) continue;
      if (in.empty() || t < in.t0 || t > in.t1) {
        ++outside;
        EXPECT_EQ(density, 0) << "t " << t;
      } else if (medium.kind != "density_grid") {
        ++inside;
        EXPECT_GT(density, 0) << "t " << t << " in " << in.t0 << " .. " << in.t1;
      }
    }
    if (!in.empty()) {
      EXPECT_GE(in.t0, 0);
      EXPECT_LE(in.t1, t_max);
    }
  }
  if (medium.kind != "density_grid") {
    EXPECT_GT(inside, 1000);
  }
  if (medium.kind != "homogeneous" && medium.kind != "height_fog") {
    EXPECT_GT(outside, 1000);
  }
}

TEST_P(EveryMedium, DepthOfAWholeIsTheSumOfItsParts) {  // hard case A4
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Vec3d origin = random.in_cube(8), direction = random.direction();
    const double t1 = random.uniform(1, 20);
    const double whole = medium_depth(medium, origin, direction, 0, t1);
    double parts = 0, before = 0;
    for (int k = 1; k <= 1000; ++k) {
      const double end = k == 1000 ? t1 : t1 * k / 1000;
      parts += medium_depth(medium, origin, direction, before, end);
      before = end;
    }
    // Two ends of the interval, each right to a few ulp of t, and a sum of a thousand.
    EXPECT_NEAR(parts, whole, 1e-12 * (whole + 20));
  }
}

TEST_P(EveryMedium, DepthNeverFallsAsTheRayGrowsAndTurningItRoundChangesNothing) {
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    const Vec3d origin = random.in_cube(8), direction = random.direction();
    double before = 0;
    for (int k = 0; k <= 60; ++k) {
      const double depth = medium_depth(medium, origin, direction, 0, 0.25 * k);
      EXPECT_GE(depth, before * (1 - 1e-14));
      before = depth;
    }
    const Vec3d end = origin + 15.0 * direction;
    EXPECT_NEAR(medium_depth(medium, end, -direction, 0, 15), before, 1e-12 * (before + 15));
  }
}

TEST_P(EveryMedium, ReachIsTheInverseOfDepth) {
  Random random(5);
  int reached = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3d origin = random.in_cube(8), direction = random.direction();
    const double t0 = random.uniform(0, 4), t1 = t0 + random.uniform(0, 20);
    const double depth = std::pow(10, random.uniform(-6, 1.2)), whole = medium_depth(medium, origin, direction, t0, t1);
    const double t = medium_reach(medium, origin, direction, t0, t1, depth);
    if (t == kInfinity) {
      EXPECT_LE(whole, depth * (1 + 1e-12) + 1e-13);
      continue;
    }
    ++reached;
    EXPECT_GE(t, t0);
    EXPECT_LE(t, t1);
    // t is right to a few ulp of 30 m, across densities of at most 10.
    EXPECT_NEAR(medium_depth(medium, origin, direction, t0, t), depth, 1e-12 * depth + 1e-13);
  }
  EXPECT_GT(reached, 100);
  EXPECT_EQ(medium_reach(medium, {0, 0, 0}, {1, 0, 0}, 0.5, 2, 0), 0.5);
}

TEST_P(EveryMedium, PiecesCoverTheRayAndBoundItsDensity) {
  Random random(6);
  for (int i = 0; i < 500; ++i) {
    const Vec3d origin = random.in_cube(i % 2 ? 8 : 30), direction = i % 5 == 0 ? Vec3d(0, 0, 1) : random.direction();
    const double t0 = random.uniform(0, 4), t1 = t0 + random.uniform(0, 60);
    double before = t0, sum = 0;
    medium_pieces(medium, origin, direction, t0, t1, [&](double end, double largest) {
      EXPECT_GE(end, before);
      // Within a few ulp of a piece's ends t may lie in its neighbour.
      for (int k = 0; k < 20 && end - before > 1e-12; ++k) {
        const double t = before + (end - before) * random.uniform(1e-3, 1 - 1e-3);
        EXPECT_LE(medium_density(medium, origin + t * direction), largest * (1 + 1e-12)) << "t " << t;
      }
      sum += largest * (end - before);
      before = end;
      return true;
    });
    EXPECT_EQ(before, t1);
    EXPECT_GE(sum, medium_depth(medium, origin, direction, t0, t1) * (1 - 1e-12) - 1e-12);
    EXPECT_LE(medium_depth(medium, origin, direction, t0, t1),
              medium_density_max(medium, origin, direction, t0, t1) * (t1 - t0) * (1 + 1e-12));
    // It stops where it is told to.
    int calls = 0;
    medium_pieces(medium, origin, direction, t0, t1, [&](double, double) { return ++calls < 2; });
    EXPECT_LE(calls, 2);
  }
}

TEST_P(EveryMedium, NoRayMakesNaN) {
  const double nan = std::nan(""), inf = kInfinity;
  const double coordinates[] = {0,    -0.0, 1,     -3,    5,      2.5,     1e-300, -1e-320, 1e9, -1e9,
                                1e17, 1e30, -1e30, 1e150, -1e308, 1.7e308, inf,    -inf,    nan};
  const double components[] = {0, -0.0, 1, -1, 1e-300, -1e-308, 5e-324, 0.6, -0.8, nan, inf};
  const double ends[] = {0, 1e-300, 1, 100, 1e9, 1e300, inf, nan};
  Random random(7);
  const auto any = [&](const auto& from) { return from[random.bits() % std::size(from)]; };
  for (int i = 0; i < 200000; ++i) {
    const Vec3d origin(any(coordinates), any(coordinates), any(coordinates));
    const Vec3d direction(any(components), any(components), any(components));
    const double t0 = any(ends), t1 = any(ends), depth = any(ends);
    const auto shown = [&] {
      return testing::Message() << origin.x << ' ' << origin.y << ' ' << origin.z << " along " << direction.x << ' '
                                << direction.y << ' ' << direction.z << " from " << t0 << " to " << t1;
    };
    const MediumInterval in = medium_interval(medium, origin, direction, t1);
    ASSERT_TRUE(in.t0 == in.t0 && in.t1 == in.t1) << shown();
    const double values[] = {medium_density(medium, origin), medium_depth(medium, origin, direction, t0, t1),
                             medium_density_max(medium, origin, direction, t0, t1)};
    for (const double v : values) ASSERT_GE(v, 0) << shown();
    if (t0 <= t1) {
      const double reach = medium_reach(medium, origin, direction, t0, t1, depth);
      ASSERT_GE(reach, t0) << shown() << " depth " << depth;
    }
    int calls = 0;
    medium_pieces(medium, origin, direction, t0, t1, [&](double end, double largest) {
      EXPECT_FALSE(end != end && t1 == t1) << shown();
      EXPECT_GE(largest, 0) << shown();
      return ++calls < 3000;
    });
    ASSERT_LT(calls, 3000) << shown();
  }
}

}  // namespace
}  // namespace world
