// Hard cases A1..A7 and A15: exponentials of media at the ends of numbers, and fog marched against its closed form.
// Each case also runs the naive way where it has one, which must fail: else it would not be a hard case.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "render/trace/media.h"
#include "world/base/random.h"
#include "world/media/medium.h"
#include "world/media/medium.shared.h"

namespace render {
namespace {

using world::Medium;
using world::Vec3d;
using world::shared::beer_lambert;

constexpr double kInf = std::numeric_limits<double>::infinity();

Medium height_fog(double scale_height) {
  Medium m;
  m.kind = "height_fog";
  m.scale_height = static_cast<float>(scale_height);
  return m;
}
constexpr auto no_random = [] { return 0.5; };

TEST(HardCaseA1, TransmittanceIsBetweenZeroAndOneAndMonotoneAtAnyExtinctionAndDepth) {
  const double values[] = {0, 1e-30, 1, 87.4, 103.9, 104, 1e30, kInf};
  bool naive_made_nan = false;
  for (const double sigma : values) {
    double before = 1;
    for (const double depth : values) {
      const double t = beer_lambert(sigma, depth);
      EXPECT_TRUE(t >= 0 && t <= 1) << sigma << ' ' << depth;
      EXPECT_LE(t, before);
      EXPECT_EQ(t, beer_lambert(depth, sigma));
      if (sigma == 0 || depth == 0) {
        EXPECT_EQ(t, 1);
      }
      if (std::isinf(sigma * depth)) {
        EXPECT_EQ(t, 0);
      }
      naive_made_nan |= std::isnan(std::exp(-sigma * depth));
      before = t;
    }
  }
  EXPECT_TRUE(naive_made_nan);
}

TEST(HardCaseA2, ThinFogTakesAwayItsOpticalDepthAndNotARoundedOne) {
  for (const double x : {1e-4, 1e-6, 3e-8, 1e-9, 1e-17}) {
    const double exact = static_cast<double>(-std::expm1l(-static_cast<long double>(x)));
    EXPECT_NEAR(world::shared::opacity(x), exact, 4 * 0x1p-53 * exact * 2);
  }
  const float naive = 1 - std::exp(-3e-8f);
  EXPECT_GT(std::abs(naive - 3e-8f), 0.9f * 3e-8f);
}

TEST(HardCaseA3, MeanTransmittanceGoesToOneWhereTheDepthGoesToZero) {
  for (const double x : {0.0, 1e-320, 1e-30, 1e-8, 1e-3})
    EXPECT_NEAR(world::shared::mean_transmittance(x), 1 - x / 2, 1e-6);
  EXPECT_EQ(world::shared::mean_transmittance(0), 1);
  EXPECT_EQ(world::shared::mean_transmittance(kInf), 0);
  EXPECT_TRUE(std::isnan((1 - std::exp(-0.0)) / 0.0));
}

TEST(HardCaseA4, AThousandSegmentsInAnyOrderLetThroughWhatOneDoes) {
  for (const char* kind : {"homogeneous", "height_fog", "box_fog", "ellipsoid_fog", "halfspace_fog"}) {
    Medium m = height_fog(20);
    m.kind = kind;
    m.half_extent = {30, 20, 25};
    const Vec3d origin(-40, 2, 1), direction = normalize(Vec3d(1, -0.05, 0.02));
    const double whole = closed_transmittance(m, origin, direction, 0, 100, 0.05);
    std::vector<double> parts;
    for (int i = 0; i < 1000; ++i)
      parts.push_back(closed_transmittance(m, origin, direction, 0.1 * i, 0.1 * (i + 1), 0.05));
    double forward = 1, backward = 1;
    for (int i = 0; i < 1000; ++i)
      forward *= parts[static_cast<size_t>(i)], backward *= parts[static_cast<size_t>(999 - i)];
    EXPECT_NEAR(forward, whole, 1e-12) << kind;  // the case asks for 1e-6
    EXPECT_NEAR(backward, forward, 1e-13) << kind;
    EXPECT_LT(whole, 0.9) << kind;
  }
}

TEST(HardCaseA5, MarchedHeightFogConvergesFirstOrderFromTheLeftAndSecondOrderInTheMiddle) {
  const Medium fog = height_fog(20);
  const Vec3d origin(0, 2, 0), direction(std::sqrt(1 - 0.09), 0.3, 0);
  const double exact = world::medium_depth(fog, origin, direction, 0, 100);
  // k = 0.05 over 100 m from 2 m up, rising 0.3 m a metre: by hand.
  EXPECT_NEAR(exact, std::exp(-0.1) * 20 / 0.3 * (1 - std::exp(-1.5)), 1e-12);
  const auto error = [&](MarchRule rule, int steps) {
    return std::abs(std::exp(-0.05 * marched_depth(fog, origin, direction, 0, 100, rule, steps, no_random)) -
                    std::exp(-0.05 * exact));
  };
  for (const auto& [rule, order] : {std::pair{MarchRule::left, 1.0}, {MarchRule::midpoint, 2.0}})
    for (int steps = 16; steps <= 64; steps *= 2)
      EXPECT_NEAR(std::log2(error(rule, steps) / error(rule, 2 * steps)), order, 0.1) << steps;
  EXPECT_LE(error(MarchRule::midpoint, 16), 1e-3);
  EXPECT_GT(error(MarchRule::left, 16), 1e-3);
}

TEST(HardCaseA6, HeightFogHasNoSeamWhereTheRayIsLevel) {
  const Medium fog = height_fog(20);
  const double level = world::medium_depth(fog, {0, 0, 0}, {1, 0, 0}, 0, 100);
  EXPECT_EQ(level, 100);
  for (const double slope : {0.0, -0.0, 1e-320, -1e-320, 1e-17, -1e-17, 1e-8, -1e-8, 1e-4, -1e-4}) {
    const double depth = world::medium_depth(fog, {0, 0, 0}, {std::sqrt(1 - slope * slope), slope, 0}, 0, 100);
    // 100 (1 - x / 2 + x^2 / 6 ...), x = 100 slope / 20.
    const double x = 5 * slope;
    EXPECT_NEAR(depth, 100 * (1 - x / 2 + x * x / 6), 100 * std::abs(x * x * x) + 1e-12) << slope;
    if (std::abs(slope) <= 1e-8) {
      EXPECT_NEAR(depth, level, 1e-5);
    }
    // And its inverse has none either.
    EXPECT_NEAR(world::medium_reach(fog, {0, 0, 0}, {std::sqrt(1 - slope * slope), slope, 0}, 0, 200, depth), 100,
                1e-10)
        << slope;
  }
  const double naive_slope = 0;
  EXPECT_TRUE(std::isnan(20 / naive_slope * (1 - std::exp(-100 * naive_slope / 20))));
}

TEST(HardCaseA7, DeepUndergroundNothingPassesAndNothingIsNaN) {
  const Medium fog = height_fog(20);
  uint64_t numbers = 0;
  const auto random = [&] { return world::uniform01_double(world::mix64(++numbers)); };
  for (const double y : {-1e4, -1e6, -1e9})
    for (const Vec3d direction : {Vec3d(0, 1, 0), Vec3d(0, -1, 0), Vec3d(1, 0, 0), normalize(Vec3d(1, 1e-9, 0))})
      for (const double end : {1e-3, 1.0, 1e5, 1e12, kInf}) {
        const double depth = world::medium_depth(fog, {0, y, 0}, direction, 0, end);
        EXPECT_GT(depth, 1e200) << y;
        EXPECT_EQ(closed_transmittance(fog, {0, y, 0}, direction, 0, end, 0.05), 0);
        EXPECT_EQ(closed_transmittance(fog, {0, y, 0}, direction, 0, end, 0), 1);
        // It collides at once; how exactly is beyond double's range.
        EXPECT_LE(world::medium_reach(fog, {0, y, 0}, direction, 0, end, 1), 1e-100);
        EXPECT_EQ(delta_tracked_transmittance(fog, {0, y, 0}, direction, 0, end, 0.05, random), 0);
      }
  // From far above down to the ground, all that there is lies at the end.
  const double depth = world::medium_depth(fog, {0, 1e6, 0}, {0, -1, 0}, 0, 1e6);
  EXPECT_NEAR(depth, 20, 1e-8);
  EXPECT_NEAR(world::medium_reach(fog, {0, 1e6, 0}, {0, -1, 0}, 0, 2e6, 20), 1e6, 1e-6);
}

TEST(HardCaseA15, AbsorptionByVoxelIsAbsorptionByTheWhole) {
  const double sigma = 0.37;
  for (const int voxels : {1, 10, 1000, 100000}) {
    const double side = 10.0 / voxels;
    double product = 1, sum = 0;
    float product_of_floats = 1;
    for (int i = 0; i < voxels; ++i) {
      product *= beer_lambert(sigma, side);
      product_of_floats *= std::exp(static_cast<float>(-sigma * side));
      sum += side;
    }
    const double whole = beer_lambert(sigma, sum);
    EXPECT_NEAR(product / whole, 1, 1e-10) << voxels;  // the case asks for 1e-5
    if (voxels == 100000) {
      EXPECT_GT(std::abs(static_cast<double>(product_of_floats) / whole - 1), 1e-5);
    }
  }
}

}  // namespace
}  // namespace render
