/// Laws of what straight rays see through (render/see_through.shared.h), and hard cases A1, A11, A14 and A15 of it.
#include "render/see_through.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "render/bsdf/bsdf.h"
#include "world/base/random.h"

namespace render {
namespace {

using namespace shared;

SeeThroughBlock of_coverage(float alpha) {
  SeeThroughBlock b;
  b.matte.w = static_cast<float>(kSeeThroughCoverage);
  b.emitted.w = alpha;
  return b;
}

TEST(SeeThrough, KindsAreOfBlocksThatLetSomeLightThrough) {
  const world::BlockPalette& palette = world::standard_blocks();
  const SeeThroughKinds kinds(palette);
  for (const char* name : {"water", "glass", "ice", "glass_red"})
    EXPECT_TRUE(kinds.contains(*palette.find(name))) << name;
  for (const char* name : {"stone", "oak_leaves", "smoke", "torch", "mercury"})
    EXPECT_FALSE(kinds.contains(*palette.find(name))) << name;
  EXPECT_EQ(kinds.kind(world::kAir), 0);
  EXPECT_FLOAT_EQ(kinds.of(*palette.find("water")).absorption.w, 1.333f / palette[world::kAir].index_of_refraction);
}

TEST(HardCaseX1, ABlockThatCoversAllIsNoSeeThroughBlock) {
  world::BlockPalette palette;
  world::Block lace;
  lace.opaque = false;
  lace.bsdf = "coverage";
  for (const float coverage : {1.0f, 0.5f}) {
    lace.name = coverage < 1 ? "lace" : "cloth";
    lace.coverage = coverage;
    ASSERT_TRUE(palette.add(lace).ok());
  }
  const SeeThroughKinds kinds(palette);
  EXPECT_FALSE(kinds.contains(*palette.find("cloth")));
  EXPECT_TRUE(kinds.contains(*palette.find("lace")));
}

TEST(HardCaseA1, WhatPassesAnAbsorberIsAShareForAllNumbers) {
  const float infinity = std::numeric_limits<float>::infinity();
  const float values[] = {0, 1e-30f, 1, 87.4f, 103.9f, 104, 1e30f, infinity};
  for (const float sigma : values) {
    float before = 1;
    for (const float d : values) {
      const float passed = absorbed_along(glm::vec3(sigma), d).x;
      EXPECT_GE(passed, 0) << sigma << " " << d;
      EXPECT_LE(passed, before) << sigma << " " << d;
      if (sigma == 0 || d == 0) {
        EXPECT_EQ(passed, 1) << sigma << " " << d;
      }
      before = passed;
    }
  }
}

TEST(SeeThrough, ALayerThatPassesAllLeavesFogAsItIs) {
  SeeThroughBlock nothing;
  nothing.matte.w = static_cast<float>(kSeeThroughCoverage), nothing.emitted.w = 0;  // a coverage of 0
  const glm::vec3 behind(3, 2, 1), shine(5, 7, 9);
  const auto value_at = [](float t) {
    return glm::vec3(std::exp(-0.1f * t), std::exp(-0.2f * t), std::exp(-0.4f * t));
  };
  StraightView v = start_of_view();
  for (const float t : {0.5f, 2.0f, 7.0f}) {
    v = met_media(v, value_at(t), shine * (1.0f - value_at(t)));
    v = met_interface(v, nothing, interface_shares(nothing, 1, 1, 1, 1), glm::vec3(0), t, glm::vec3(99), glm::vec3(99),
                      true, kCoverageExact, 0);
  }
  v = met_media(v, value_at(11), shine * (1.0f - value_at(11)));
  const glm::vec3 seen = end_of_view(v, SeeThroughBlock{}, 1, 11, behind, kCoverageExact);
  const glm::vec3 fog = value_at(11) * behind + shine * (1.0f - value_at(11));
  for (int b = 0; b < 3; ++b) EXPECT_NEAR(seen[b], fog[b], 1e-5 * fog[b]);  // rounding of a few sums
}

TEST(SeeThrough, ALayerHidesOnlyTheFogBehindIt) {
  // A matte sheet half there at 1 m, of radiance 4, in fog that shines.
  SeeThroughBlock half;
  half.matte.w = static_cast<float>(kSeeThroughCoverage), half.emitted.w = 0.5f;
  StraightView v = met_media(start_of_view(), glm::vec3(0.8f), glm::vec3(1));
  v = met_interface(v, half, interface_shares(half, 1, 1, 1, 1), glm::vec3(0), 1, glm::vec3(0), glm::vec3(4), true,
                    kCoverageExact, 0);
  v = met_media(v, glm::vec3(0.2f), glm::vec3(5));
  // 1 of the fog before it, half of the sheet through that, half of the 4 of the fog behind and of what ends the view.
  EXPECT_NEAR(end_of_view(v, SeeThroughBlock{}, 1, 9, glm::vec3(10), kCoverageExact).x,
              1 + 0.5 * 0.8 * 4 + 0.5 * (5 - 1) + 0.5 * 0.2 * 10, 1e-5);
}

TEST(SeeThrough, WhatLiesInADenserMediumLooksDarkerByTheSquareOfTheIndices) {
  SeeThroughBlock water;
  water.absorption = {0, 0, 0, 1.333f};
  const StraightView v = start_of_view();
  EXPECT_NEAR(end_of_view(v, water, 1, 5, glm::vec3(1), kCoverageExact).x, 1 / (1.333 * 1.333), 1e-6);
  EXPECT_NEAR(end_of_view(v, SeeThroughBlock{}, 1.333f, 5, glm::vec3(1), kCoverageExact).x, 1.333 * 1.333, 1e-6);
  EXPECT_EQ(end_of_view(v, water, 1.333f, 5, glm::vec3(1), kCoverageExact).x, 1);
}

TEST(HardCaseA15, ARunOfVoxelsAbsorbsAsOneStretch) {
  for (const int voxels : {1, 10, 1000, 100000}) {
    const float sigma = 3.0f / static_cast<float>(voxels);
    EXPECT_NEAR(absorbed_along(glm::vec3(sigma), static_cast<float>(voxels)).x, std::exp(-3.0), 1e-6);
  }
}

TEST(SeeThrough, APaneMirrorsTheSameFromBothItsFaces) {
  for (int i = 0; i <= 90; ++i) {
    const float cosine = std::cos(static_cast<float>(i) * 0.01745329f);
    const float in = parallel_reflectance(1, 1, 1.5f, cosine), out = parallel_reflectance(1, 1.5f, 1, cosine);
    EXPECT_NEAR(in, out, 2e-4f) << i;
    EXPECT_EQ(parallel_reflectance(1, 1.5f, 1.5f, cosine), 0);
    // Water over glass: Snell's law through the pile.
    const float sine = std::sqrt(1 - cosine * cosine) / 1.333f;
    EXPECT_NEAR(parallel_reflectance(1, 1.333f, 1.5f, cosine),
                fresnel_reflectance(std::sqrt(1 - sine * sine), 1.5f / 1.333f), 1e-5f);
  }
}

TEST(SeeThrough, UnderWaterTheSkyIsSeenWithinSnellsWindowOnly) {
  const double critical = std::asin(1 / 1.333);
  for (int i = 0; i <= 90; ++i) {
    const double angle = i * 0.0174532925;
    const float r = parallel_reflectance(1.333f, 1.333f, 1, static_cast<float>(std::cos(angle)));
    if (angle > critical + 1e-3) {
      EXPECT_EQ(r, 1) << i;
    } else if (angle < critical - 1e-3) {
      EXPECT_LT(r, 1) << i;
    }
  }
}

TEST(SeeThrough, NothingIsGainedAtAnInterface) {
  for (uint64_t n = 0; n < 20000; ++n) {
    const auto unit = [&](uint64_t k) { return static_cast<float>(world::mix64(n * 16 + k) >> 40) / 16777216.0f; };
    SeeThroughBlock b = of_coverage(unit(0));
    b.matte.w = std::floor(3 * unit(1));
    for (int c = 0; c < 3; ++c) {
      b.matte[c] = unit(2 + static_cast<uint64_t>(c));
      b.transmission[c] = (1 - b.matte[c]) * unit(5 + static_cast<uint64_t>(c));
    }
    b.transmission.w = 1 + unit(8);
    const InterfaceShares s = interface_shares(b, 1 + unit(9), 1 + unit(10), 1 + unit(11), unit(12));
    for (int c = 0; c < 3; ++c) {
      const float matte = s.matte * (b.matte.w == static_cast<float>(kSeeThroughThin) ? b.matte[c] : 1.0f);
      EXPECT_GE(s.passed[c], 0);
      EXPECT_GE(s.mirrored[c], 0);
      EXPECT_LE(s.passed[c] + s.mirrored[c] + matte, 1 + 1e-5f) << n;
    }
  }
}

/// Mean share of white light behind two equal surfaces that a view of them lets through.
double through_two(uint32_t pattern, float alpha) {
  const SeeThroughBlock b = of_coverage(alpha);
  const InterfaceShares s = interface_shares(b, 1, 1, 1, 1);
  double sum = 0;
  constexpr uint32_t kEdge = 128;
  for (uint32_t y = 0; y < kEdge; ++y)
    for (uint32_t x = 0; x < kEdge; ++x) {
      StraightView v = start_of_view();
      for (const uint32_t layer : {17u, 91u})
        v = met_interface(v, b, s, glm::vec3(0), 1, glm::vec3(0), glm::vec3(0), true, pattern,
                          coverage_mask(pattern, alpha, x, y, layer));
      sum += end_of_view(v, SeeThroughBlock{}, 1, 2, glm::vec3(1), pattern).x;
    }
  return sum / (kEdge * kEdge);
}

TEST(CoveragePattern, HashedSurfacesAreIndependentAndCorrelatedOnesHideNoMoreThanOne) {
  for (const float alpha : {0.0f, 0.25f, 0.3f, 0.5f, 0.9f, 1.0f}) {
    const double square = (1 - double{alpha}) * (1 - double{alpha});
    EXPECT_NEAR(through_two(kCoverageExact, alpha), square, 1e-6);
    // 128^2 pixels of 16 samples: four standard deviations of their mean are below 0.004.
    EXPECT_NEAR(through_two(kCoverageHashed, alpha), square, 0.004);
    EXPECT_NEAR(through_two(kCoverageCorrelated, alpha), 1 - std::round(16 * alpha) / 16, 1e-6);
  }
}

TEST(CoveragePattern, MasksHoldAsManySamplesAsTheShareSays) {
  for (const float alpha : {0.0f, 0.1f, 0.3f, 0.77f, 1.0f}) {
    double sum = 0;
    for (uint32_t i = 0; i < 20000; ++i) {
      const uint32_t count = set_samples(coverage_mask(kCoverageHashed, alpha, i, 3 * i, 5));
      EXPECT_LE(std::abs(static_cast<float>(count) - 16 * alpha), 1.0f);
      sum += count;
    }
    EXPECT_NEAR(sum / 20000, 16 * alpha, 0.02);
  }
}

TEST(HardCaseA11, AViewOfThirtyTwoLayersOfHalfKeepsTheirShare) {
  const SeeThroughBlock b = of_coverage(0.5f);
  StraightView v = start_of_view();
  for (int layer = 0; layer < 32; ++layer)
    v = met_interface(v, b, interface_shares(b, 1, 1, 1, 1), glm::vec3(0), static_cast<float>(layer), glm::vec3(0),
                      glm::vec3(1), true, kCoverageExact, 0);
  EXPECT_FLOAT_EQ(v.through.x, std::pow(0.5f, 32));
  EXPECT_NEAR(v.added.x, 1, 1e-6);
}

TEST(HardCaseA14, AStraightRayThroughAPaneCarriesWhatARefractedOneDoes) {
  // Both faces by Fresnel, absorbed along the straight way. Refraction shortens the way within; that is the difference.
  SeeThroughBlock glass;
  glass.absorption = {0.5f, 0.1f, 0.8f, 1.5f};
  double worst = 0;
  for (int degrees = 0; degrees <= 75; degrees += 5) {
    const double angle = degrees * 0.0174532925, cosine = std::cos(angle);
    StraightView v = start_of_view();
    v = met_interface(v, glass, interface_shares(glass, 1, 1, 1.5f, static_cast<float>(cosine)), glm::vec3(0), 1,
                      glm::vec3(0), glm::vec3(0), true, kCoverageExact, 0);
    v = met_interface(v, glass, interface_shares(glass, 1, 1.5f, 1, static_cast<float>(cosine)),
                      glm::vec3(glass.absorption), static_cast<float>(1 + 0.1 / cosine), glm::vec3(0), glm::vec3(0),
                      false, kCoverageExact, 0);
    const double inside = std::sqrt(1 - std::sin(angle) * std::sin(angle) / 2.25);
    const double r = double{fresnel_reflectance(static_cast<float>(cosine), 1.5f)};
    for (int b = 0; b < 3; ++b) {
      const double refracted = (1 - r) * (1 - r) * std::exp(-double{glass.absorption[b]} * 0.1 / inside);
      EXPECT_LE(v.through[b], 1.0f);
      worst = std::max(worst, std::abs(double{v.through[b]} - refracted));
    }
  }
  EXPECT_LT(worst, 0.1);  // 1 dm of glass at 75 degrees: a way of 39 cm instead of 13
  EXPECT_GT(worst, 0.01);
}

}  // namespace
}  // namespace render
