/// Clouds: how dense they are where, how much of the sky they take, and what becomes of light in them.
#include "world/scenes/clouds.shared.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/random.h"
#include "world/scenes/cloud_layer.h"

namespace world {
namespace {

using glm::vec3;
using shared::CloudLayer, shared::CloudView, shared::kCloudFar;

constexpr float kEndless = 1e30f;

Environment clouded(float cover, uint32_t seed = 1) {
  Environment e;
  e.clouds.cover = cover, e.clouds.seed = seed;
  return e;
}
CloudLayer layer_of(const Environment& e, VoxelPos from = {}) { return cloud_layer(e, from); }

/// The i-th of many places over 60 km, at the layer's base.
vec3 place_over_land(const CloudLayer& layer, uint64_t i) {
  const auto part = [&](uint64_t which) { return static_cast<float>(mix64(2 * i + which) >> 40) * 0x1p-24f - 0.5f; };
  return {60'000 * part(0), layer.place.y, 60'000 * part(1)};
}

/// Of what stands straight above a place.
double opacity_above(const CloudLayer& layer, vec3 place) {
  constexpr int kSlices = 48;
  double depth = 0;
  for (int k = 0; k < kSlices; ++k) {
    place.y = layer.place.y + layer.shape.x * (static_cast<float>(k) + 0.5f) / kSlices;
    depth += double{cloud_density(layer, place, 0)} * layer.shape.x * layer.shape.y / kSlices;
  }
  return 1 - std::exp(-depth);
}

TEST(Clouds, TakeTheShareOfTheSkyThatCoverSays) {
  for (const uint32_t seed : {1u, 2u, 77u})
    for (const float cover : {0.1f, 0.25f, 0.5f, 0.75f, 0.9f}) {
      const CloudLayer layer = layer_of(clouded(cover, seed));
      double sum = 0;
      constexpr uint64_t kPlaces = 4000;
      for (uint64_t i = 0; i < kPlaces; ++i) sum += opacity_above(layer, place_over_land(layer, i));
      // 7500 lumps lie over that land: 0.01 from one seed to the next.
      EXPECT_NEAR(sum / kPlaces, cover, 0.04) << "seed " << seed;
    }
}

TEST(Clouds, OfCoverOneCloseTheSkyAndOfCoverNearNoughtLeaveItOpen) {
  const CloudLayer closed = layer_of(clouded(1)), open = layer_of(clouded(1e-4f));
  double of_closed = 0, of_open = 0;
  for (uint64_t i = 0; i < 2000; ++i) {
    of_closed += opacity_above(closed, place_over_land(closed, i)) / 2000;
    of_open += opacity_above(open, place_over_land(open, i)) / 2000;
  }
  EXPECT_GT(of_closed, 0.98);
  EXPECT_LT(of_open, 0.01);
}

TEST(Clouds, AreAShareOfTheirExtinctionWithinTheLayerAndNothingOutside) {
  const CloudLayer layer = layer_of(clouded(0.5f));
  for (uint64_t i = 0; i < 20'000; ++i) {
    vec3 place = place_over_land(layer, i);
    place.y += layer.shape.x * (static_cast<float>(i % 300) / 100 - 1);
    const float density = cloud_density(layer, place, static_cast<float>(i % 7) * 40);
    const bool within = place.y > layer.place.y && place.y < layer.place.y + layer.shape.x;
    EXPECT_GE(density, 0);
    EXPECT_LE(density, 1);
    EXPECT_TRUE(within || density == 0) << place.y;
  }
}

TEST(Clouds, HaveFlatBasesAndRoundTops) {
  const CloudLayer layer = layer_of(clouded(0.4f));
  const auto cover_at = [&](float h) {
    double sum = 0;
    for (uint64_t i = 0; i < 4000; ++i)
      sum += double{cloud_density(layer, place_over_land(layer, i) + vec3(0, h * layer.shape.x, 0), 0)} / 4000;
    return sum;
  };
  const double low = cover_at(0.1f), middle = cover_at(0.5f), high = cover_at(0.9f);
  EXPECT_NEAR(low, 0.4, 0.05) << "all of them stand on the base";
  EXPECT_LT(high, 0.15 * low) << "few reach the top";
  // A dome is wide up to half its height: one whose sides are straight has half of its base there.
  EXPECT_GT(middle, 0.45 * low);
}

TEST(Clouds, ChangeSmoothlyAcrossCellsOfTheirNoise) {
  const Environment e = clouded(0.6f);
  const CloudLayer layer = layer_of(e);
  // Along x through the finest cells, 0.1 m at a time: the steepest slope of noise is 1.5 a cell, over an edge of 0.05.
  const float finest = e.clouds.size / 16;
  const float steepest = 0.1f / finest * 1.5f * 2 / shared::kCloudEdge;
  float before = -1;
  for (int i = 0; i < 20'000; ++i) {
    const vec3 place(-700 + 0.1f * static_cast<float>(i), layer.place.y + 60, 31);
    const float density = cloud_density(layer, place, 0);
    if (before >= 0) {
      EXPECT_LE(std::abs(density - before), steepest) << place.x;
    }
    before = density;
  }
}

/// Hard cases R1 and R2: the voxel that places are relative to may be anywhere.
TEST(Clouds, AreAsFineFarFromTheOriginAsNearIt) {
  const Environment e = clouded(0.5f);
  for (const int32_t far : {1'000'000, -1'000'000'000}) {
    const VoxelPos here{far, 0, -far}, beside{far + 1000, 100, -far - 3000};
    const CloudLayer a = layer_of(e, here), b = layer_of(e, beside);
    double worst = 0;
    int between = 0;
    for (uint64_t i = 0; i < 5000; ++i) {
      vec3 place = place_over_land(a, i) * vec3(0.1f, 1, 0.1f) + vec3(0, 70, 0);
      const double first = cloud_density(a, place, 0), second = cloud_density(b, place - vec3(1000, 100, -3000), 0);
      worst = std::max(worst, std::abs(first - second));
      between += first > 0.05 && first < 0.95;
    }
    EXPECT_GT(between, 50) << "edges are there";
    EXPECT_LT(worst, 5e-3) << far << ": a float's rounding over 3 km, times the slope of an edge";
  }
}

TEST(Clouds, DriftAsAWhole) {
  Environment e = clouded(0.5f), later = e;
  later.clouds.drifted = {1234.5, 99, -4321.25};
  const CloudLayer a = layer_of(e), b = layer_of(later);
  double worst = 0;
  for (uint64_t i = 0; i < 5000; ++i) {
    const vec3 place = place_over_land(a, i) * vec3(0.1f, 1, 0.1f) + vec3(0, 70, 0);
    worst = std::max(worst, std::abs(double{cloud_density(a, place, 0)} -
                                     double{cloud_density(b, place + vec3(1234.5f, 0, -4321.25f), 0)}));
  }
  EXPECT_LT(worst, 5e-3);
}

/// What a closed, thick layer sends straight up under the sun at the zenith, over what a white surface would.
TEST(Clouds, OfAThickLayerSendBackThreeFifthsOfTheSunsLight) {
  Environment e = clouded(1);
  e.sun_direction = {0, 1, 0};
  e.sun_irradiance = {100, 100, 100};
  e.sky_zenith = e.sky_horizon = e.sky_ground = {};
  e.clouds.extinction = 0.3f;
  const CloudLayer layer = layer_of(e);
  double sum = 0;
  constexpr int kRays = 400;
  for (uint64_t i = 0; i < kRays; ++i) {
    const vec3 from = place_over_land(layer, i) + vec3(0, layer.shape.x + 1, 0);
    const CloudView seen = clouds_along(layer, from, {0, -1, 0}, vec3(0), 256, 16, kEndless);
    sum += double{seen.added.x} * std::numbers::pi / 100 / kRays;
  }
  EXPECT_NEAR(sum, 0.6, 0.03);
}

TEST(Clouds, AddNoMoreThanTheyHideWhereTheirLightIsThatOfTheSkyAround) {
  Environment e = clouded(0.7f);
  e.sun_irradiance = {};
  e.sky_zenith = e.sky_horizon = e.sky_ground = {10, 10, 10};
  const CloudLayer layer = layer_of(e);
  for (uint64_t i = 0; i < 2000; ++i) {
    const float up = static_cast<float>(i % 200) / 100 - 1, level = std::sqrt(1 - up * up);
    const float angle = static_cast<float>(i);
    const vec3 direction(level * std::cos(angle), up, level * std::sin(angle));
    const vec3 from(0, static_cast<float>(i % 3) * 600, 0);
    for (const int steps : {1, 3, 32}) {
      const CloudView seen = clouds_along(layer, from, direction, vec3(10), steps, 2, kEndless);
      EXPECT_GE(seen.through, 0);
      EXPECT_LE(seen.through, 1);
      EXPECT_GE(seen.added.x, 0);
      EXPECT_LE(seen.added.x + 10 * seen.through, 10.001f) << up;
    }
  }
}

TEST(Clouds, AreLeftOutWhereARayMissesTheirLayer) {
  const CloudLayer layer = layer_of(clouded(1));
  const auto through = [&](vec3 from, vec3 direction, int steps) {
    const CloudView seen = clouds_along(layer, from, glm::normalize(direction), vec3(5), steps, 2, kEndless);
    EXPECT_TRUE(seen.through < 1 || seen.added == vec3(0));
    return seen.through;
  };
  EXPECT_EQ(through({0, 50, 0}, {1, -0.2f, 0}, 8), 1);
  EXPECT_EQ(through({0, 50, 0}, {1, 0, 0}, 8), 1) << "level, below them";
  EXPECT_EQ(through({0, 2000, 0}, {0, 1, 0}, 8), 1);
  EXPECT_LT(through({0, 2000, 0}, {0, -1, 0}, 8), 0.1f);
  EXPECT_LT(through({0, 1000, 0}, {1, 0, 0}, 64), 0.1f) << "level, within them";
}

TEST(Clouds, BeforeThingsGrowWithTheirDistanceUpToThoseOfTheWholeRay) {
  const CloudLayer layer = layer_of(clouded(0.6f));
  int grown = 0;
  for (uint64_t i = 0; i < 600; ++i) {
    const float up = static_cast<float>(i % 40) / 20 - 1, level = std::sqrt(1 - up * up), angle = static_cast<float>(i);
    const vec3 direction(level * std::cos(angle), up, level * std::sin(angle));
    // Below the layer, within it and above.
    const vec3 from(300 * angle, 700 + 300 * static_cast<float>(i % 3), 0);
    for (const int steps : {1, 8, 64}) {
      const auto up_to = [&](float t) { return clouds_along(layer, from, direction, vec3(10), steps, 2, t); };
      const CloudView whole = up_to(kEndless);
      CloudView before = up_to(0);
      EXPECT_EQ(before.through, 1);
      for (float t = 1; t < 2 * kCloudFar; t *= 1.3f) {
        const CloudView seen = up_to(t);
        EXPECT_LE(seen.through, before.through);
        EXPECT_TRUE(glm::all(glm::greaterThanEqual(seen.added, before.added)));
        EXPECT_GE(seen.through, whole.through);
        EXPECT_LE(seen.distance, t * 1.0001f);
        grown += seen.through < before.through;
        before = seen;
      }
      EXPECT_EQ(before.through, whole.through);
      EXPECT_EQ(before.added, whole.added);
    }
  }
  EXPECT_GT(grown, 1000);
}

/// Land below the base never asks for clouds from below.
TEST(Clouds, LieBeforeNothingThatLiesBelowThemWithTheEye) {
  const CloudLayer layer = layer_of(clouded(1));
  for (float t = 1; t < 1e5f; t *= 2)
    for (const float y : {0.0f, 400.0f, layer.place.y - 1}) {
      const vec3 from(0, 100, 0), direction = glm::normalize(vec3(t, y - 100, 0));
      EXPECT_EQ(clouds_along(layer, from, direction, vec3(10), 8, 2, glm::length(vec3(t, y - 100, 0))).through, 1);
    }
}

TEST(Clouds, BetweenFogAndFogHideWhatTheFogBehindThemAdds) {
  CloudView clouds;
  clouds.added = vec3(3), clouds.through = 0.25f;
  // No fog; fog before them alone; fog behind them alone.
  EXPECT_EQ(clouds_laid_over(clouds, vec3(1), vec3(0), vec3(8)), vec3(5));
  EXPECT_EQ(clouds_laid_over(clouds, vec3(0.5f), vec3(2), vec3(0.5f * 8 + 2)), vec3(0.5f * 5 + 2));
  EXPECT_EQ(clouds_laid_over(clouds, vec3(1), vec3(0), vec3(0.5f * 8 + 2)), vec3(3 + 0.25f * 6));
}

TEST(Clouds, ComeNearerToManyStepsWithMoreOfThem) {
  const CloudLayer layer = layer_of(clouded(0.5f));
  const auto error_of = [&](int steps) {
    double sum = 0;
    for (uint64_t i = 0; i < 400; ++i) {
      const float angle = static_cast<float>(i), up = 0.2f + 0.7f * static_cast<float>(i % 20) / 20;
      const float level = std::sqrt(1 - up * up);
      const vec3 direction(level * std::cos(angle), up, level * std::sin(angle));
      const CloudView exact = clouds_along(layer, {0, 50, 0}, direction, vec3(20), 512, 8, kEndless),
                      seen = clouds_along(layer, {0, 50, 0}, direction, vec3(20), steps, 8, kEndless);
      sum += std::abs(double{seen.through} - exact.through);
    }
    return sum / 400;
  };
  const double four = error_of(4), sixteen = error_of(16), sixty_four = error_of(64);
  EXPECT_LT(sixteen, 0.6 * four);
  EXPECT_LT(sixty_four, 0.6 * sixteen);
  EXPECT_LT(sixty_four, 0.02);
}

TEST(Clouds, DimTheSunAlikeAllAlongItsRay) {
  const Environment e = clouded(0.5f);
  const CloudLayer layer = layer_of(e);
  double dimmed = 0;
  for (uint64_t i = 0; i < 1000; ++i) {
    vec3 place = place_over_land(layer, i) * vec3(0.1f, 0, 0.1f);
    const float here = cloud_sun_through(layer, place);
    const float above = cloud_sun_through(layer, place + 500.0f * vec3(e.sun_direction));
    EXPECT_NEAR(here, above, 1e-3f);
    EXPECT_GT(here, 0);
    EXPECT_LE(here, 1);
    dimmed += here < 0.5f;
    place.y = layer.place.y + layer.shape.x + 1;
    EXPECT_EQ(cloud_sun_through(layer, place), 1) << "above them";
  }
  EXPECT_GT(dimmed, 100);
  EXPECT_LT(dimmed, 600);
}

}  // namespace
}  // namespace world
