// Values "worked out elsewhere" come from three places, named at each: by hand, from closed forms evaluated in Python's
// float64, and from other programs (scikit-image 0.19.3; the FLIP authors' own program, version 1.7) on the pictures
// that test_picture and changed_picture define by integers.
#include "render/image/error_metrics.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "render/image/display.h"
#include "world/base/jobs.h"

namespace render {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kWidth = 96, kHeight = 64;

Image8 constant_picture(int width, int height, int r, int g, int b) {
  Image8 image{width, height, {}};
  for (int i = 0; i < width * height; ++i) {
    for (const int c : {r, g, b}) image.pixels.push_back(static_cast<unsigned char>(c));
  }
  return image;
}

/// Ramps in each channel, inverted in every other square of 16x16.
Image8 test_picture() {
  Image8 image{kWidth, kHeight, {}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int v = (3 * x + 2 * y + 40 * c) & 255;
        image.pixels.push_back(static_cast<unsigned char>((x / 16 + y / 16) & 1 ? 255 - v : v));
      }
    }
  }
  return image;
}

/// The same, moved by a pixel left of x = 40, greener below y = 40, and with single inverted pixels.
Image8 changed_picture() {
  const Image8 a = test_picture();
  Image8 image{kWidth, kHeight, {}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) {
        int v = a.pixels[static_cast<size_t>((y * kWidth + (x < 40 ? x + 1 : x)) * 3 + c)];
        if (y >= 40 && c == 1) v = std::min(255, v + 12);
        if ((x * 7 + y * 13) % 97 == 0) v = 255 - v;
        image.pixels.push_back(static_cast<unsigned char>(v));
      }
    }
  }
  return image;
}

Image gray_row(const std::vector<float>& values) {
  Image image(static_cast<int>(values.size()), 1);
  for (size_t i = 0; i < values.size(); ++i) image.pixels[i] = {values[i], values[i], values[i]};
  return image;
}

TEST(ErrorMetrics, EqualPicturesHaveNoErrorAtAll) {
  const Image8 a = test_picture();
  const ImageComparison c = compare_images(a, a);
  EXPECT_TRUE(c.metrics.equal);
  EXPECT_EQ(c.metrics.mse, 0);
  EXPECT_EQ(c.metrics.rel_mse, 0);
  EXPECT_EQ(c.metrics.trimmed_rel_mse, 0);
  EXPECT_EQ(c.metrics.smape, 0);
  EXPECT_EQ(c.metrics.bias, 0);
  EXPECT_EQ(c.metrics.psnr, std::numeric_limits<double>::infinity());
  EXPECT_EQ(c.metrics.ssim, 1);
  EXPECT_EQ(c.metrics.flip, 0);
  EXPECT_EQ(c.metrics.worst.difference, 0);
  EXPECT_EQ(c.metrics.fraction_within_1, 1);
  for (const float v : c.flip.values) ASSERT_EQ(v, 0);
}

// numpy and scikit-image on the same integers: ((A-B)**2).mean() and so on with A, B in [0, 1];
// structural_similarity(data_range=1, gaussian_weights=True, sigma=1.5, use_sample_covariance=False) of the luma.
TEST(ErrorMetrics, TestPictureHasTheValuesOfScikitImage) {
  const ErrorMetrics m = compare_images(test_picture(), changed_picture()).metrics;
  EXPECT_NEAR(m.mse, 0.011331673481620317, 1e-15);
  EXPECT_NEAR(m.psnr, 19.457059480214866, 1e-12);
  EXPECT_NEAR(m.rel_mse, 0.9118202680452695, 1e-12);
  EXPECT_NEAR(m.trimmed_rel_mse, 0.06768930362637839, 1e-13);
  EXPECT_NEAR(m.smape, 0.06579166315215246, 1e-14);
  EXPECT_NEAR(m.bias, -0.013673098072776946, 1e-14);
  EXPECT_NEAR(m.ssim, 0.8160400251676218, 1e-12);
  EXPECT_EQ(m.fraction_within_1, 0.3619791666666667);
  EXPECT_FALSE(m.equal);
  EXPECT_EQ(m.worst.x, 58);
  EXPECT_EQ(m.worst.y, 21);
  EXPECT_EQ(m.worst.difference, 255);
  EXPECT_EQ(m.worst.a, (std::array<float, 3>{216, 0, 40}));
  EXPECT_EQ(m.worst.b, (std::array<float, 3>{39, 255, 215}));
}

// By hand. a = 1, 4; b = 2, 2; mean of b = 2, so e = 0.01 * 4 = 0.04:
//   mse = (1 + 4) / 2, rel_mse = (1 + 4) / 4.04 / 2, smape = (2/3 + 4/6) / 2, bias = (2.5 - 2) / 2.
TEST(ErrorMetrics, TwoPixelsOfRadianceGiveTheValuesOfHand) {
  const ErrorMetrics m = compare_images(gray_row({1, 4}), gray_row({2, 2})).metrics;
  EXPECT_DOUBLE_EQ(m.mse, 2.5);
  EXPECT_DOUBLE_EQ(m.rel_mse, 5 / 4.04 / 2);
  EXPECT_DOUBLE_EQ(m.trimmed_rel_mse, m.rel_mse);  // fewer than 100 pixels: nothing is trimmed
  EXPECT_DOUBLE_EQ(m.smape, (2.0 / 3 + 2.0 / 3) / 2);
  EXPECT_DOUBLE_EQ(m.bias, 0.25);
  EXPECT_EQ(m.worst.x, 1);
  EXPECT_EQ(m.worst.difference, 2);
  EXPECT_EQ(m.worst.a[0], 4);
  EXPECT_EQ(m.worst.b[0], 2);
}

// By hand: 200 pixels of 1 against 1, but two fireflies of 101 and 3. Two pixels are dropped.
TEST(ErrorMetrics, TrimmedErrorLeavesTheLargestHundredthOut) {
  std::vector<float> a(200, 1.0f);
  a[7] = 101, a[90] = 3, a[150] = 1.5f;
  const ErrorMetrics m = compare_images(gray_row(a), gray_row(std::vector<float>(200, 1.0f))).metrics;
  EXPECT_NEAR(m.rel_mse, (10000 + 4 + 0.25) / 1.01 / 200, 1e-12);
  EXPECT_NEAR(m.trimmed_rel_mse, 0.25 / 1.01 / 198, 1e-15);
}

TEST(ErrorMetrics, ValuesThatAreNotFiniteAreCountedAndLeftOut) {
  const ErrorMetrics m = compare_images(gray_row({kNan, 1, kInfinity, 5}), gray_row({1, 2, kInfinity, kNan})).metrics;
  EXPECT_EQ(m.not_finite, 3u);
  EXPECT_DOUBLE_EQ(m.mse, 1);
  EXPECT_DOUBLE_EQ(m.bias, -0.5);
  EXPECT_FALSE(m.equal);
  EXPECT_EQ(m.worst.x, 0);
  EXPECT_EQ(m.worst.difference, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(m.worst.a[0]));
  EXPECT_TRUE(compare_images(gray_row({kNan, -0.0f, kInfinity}), gray_row({kNan, 0.0f, kInfinity})).metrics.equal);
}

TEST(ErrorMetrics, ABlackReferenceHasNoRelativeError) {
  const ErrorMetrics m = compare_images(gray_row({1, 1}), gray_row({0, 0})).metrics;
  EXPECT_TRUE(std::isnan(m.rel_mse));
  EXPECT_TRUE(std::isnan(m.bias));
  EXPECT_DOUBLE_EQ(m.smape, 2);
}

TEST(ErrorMetrics, RadianceIsShownAtZeroExposureForWhatEyesSee) {
  Image a(kWidth, kHeight), b(kWidth, kHeight);
  const Image8 shown_a = test_picture(), shown_b = changed_picture();
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    const auto radiance = [&](const Image8& image) {
      const auto one = [&](size_t c) {
        return linear_from_srgb(static_cast<float>(image.pixels[3 * i + c]) / 255.0f) * kWhiteRadiance;
      };
      return Rgb{one(0), one(1), one(2)};
    };
    a.pixels[i] = radiance(shown_a), b.pixels[i] = radiance(shown_b);
  }
  const ErrorMetrics linear = compare_images(a, b).metrics, shown = compare_images(shown_a, shown_b).metrics;
  EXPECT_EQ(linear.psnr, shown.psnr);
  EXPECT_EQ(linear.ssim, shown.ssim);
  EXPECT_EQ(linear.flip, shown.flip);
  EXPECT_EQ(linear.fraction_within_1, shown.fraction_within_1);
  EXPECT_NE(linear.mse, shown.mse);
}

TEST(ErrorMetrics, FractionWithinOneCountsPixelsAndNotChannels) {
  Image8 a = constant_picture(10, 1, 100, 100, 100), b = a;
  b.pixels[0] = 101, b.pixels[1] = 99;              // pixel 0: within
  b.pixels[3] = 102;                                // pixel 1: not
  b.pixels[6] = 90, b.pixels[7] = b.pixels[8] = 0;  // pixel 2: not
  EXPECT_DOUBLE_EQ(compare_images(a, b).metrics.fraction_within_1, 0.8);
}

TEST(ErrorMetrics, AnyNumberOfThreadsGivesTheSameNumbers) {
  Image8 a = constant_picture(700, 300, 0, 0, 0), b = a;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    a.pixels[i] = static_cast<unsigned char>(i * i >> 5), b.pixels[i] = static_cast<unsigned char>(i * 7 >> 3);
  }
  const ImageComparison all = compare_images(a, b);
  const world::ThreadLimit one(1);
  const ImageComparison single = compare_images(a, b);
  EXPECT_EQ(all.metrics.mse, single.metrics.mse);
  EXPECT_EQ(all.metrics.rel_mse, single.metrics.rel_mse);
  EXPECT_EQ(all.metrics.trimmed_rel_mse, single.metrics.trimmed_rel_mse);
  EXPECT_EQ(all.metrics.ssim, single.metrics.ssim);
  EXPECT_EQ(all.metrics.flip, single.metrics.flip);
  EXPECT_EQ(all.flip.values, single.flip.values);
}

// Closed form for constant pictures x, y of luma in [0, 1]: (2xy + C1) / (x^2 + y^2 + C1), C1 = 1e-4.
TEST(Ssim, ConstantPicturesFollowTheClosedForm) {
  for (const int size : {1, 7, 11, 30}) {
    EXPECT_NEAR(
        structural_similarity(constant_picture(size, size, 100, 100, 100), constant_picture(size, size, 101, 101, 101)),
        0.9999505134293561, 1e-9)
        << size;
    EXPECT_NEAR(
        structural_similarity(constant_picture(size, size, 0, 0, 0), constant_picture(size, size, 255, 255, 255)),
        9.999000099990002e-05, 1e-9)
        << size;
  }
}

TEST(Ssim, InvertedContrastIsNegativeAndOrderDoesNotMatter) {
  Image8 a = constant_picture(32, 32, 0, 0, 0), inverted = a;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    a.pixels[i] = (i / 3 + i / 96) % 2 ? 200 : 56;
    inverted.pixels[i] = static_cast<unsigned char>(256 - a.pixels[i]);
  }
  EXPECT_LT(structural_similarity(a, inverted), -0.9);
  EXPECT_EQ(structural_similarity(a, inverted), structural_similarity(inverted, a));
}

// The authors' program (FLIP 1.7, C++, 67.020645 pixels per degree) on the same pixels: the mean and four pixels. It
// uses another rounding of the colour matrices, which makes the 2e-5.
TEST(Flip, TestPictureHasTheValuesOfTheAuthorsProgram) {
  const FlipMap map = flip_map(test_picture(), changed_picture());
  EXPECT_NEAR(map.mean, 0.18874113, 1e-5);
  EXPECT_NEAR(map.values[0], 0.980806, 2e-5);
  EXPECT_NEAR(map.values[10 * kWidth + 20], 0.114011, 2e-5);
  EXPECT_NEAR(map.values[45 * kWidth + 41], 0.273612, 2e-5);
  EXPECT_NEAR(map.values[kWidth * kHeight - 1], 0.295275, 2e-5);
  // From farther off, at 30 pixels per degree.
  const FlipMap far_map = flip_map(test_picture(), changed_picture(), {30});
  EXPECT_NEAR(far_map.mean, 0.19121697, 1e-5);
  EXPECT_NEAR(far_map.values[10 * kWidth + 20], 0.087850, 2e-5);
}

// Constant pictures have no features and no blur changes them: what is left is the mapped HyAB distance of two colours,
// worked out in Python's float64 from the standard's formulas.
TEST(Flip, ConstantColoursFollowTheClosedForm) {
  const auto flip_of = [](std::array<int, 3> a, std::array<int, 3> b) {
    const FlipMap map =
        flip_map(constant_picture(30, 20, a[0], a[1], a[2]), constant_picture(30, 20, b[0], b[1], b[2]));
    for (const float v : map.values) EXPECT_NEAR(v, map.mean, 2e-5);
    return map.mean;
  };
  EXPECT_NEAR(flip_of({0, 0, 0}, {255, 255, 255}), 0.9673791815541143, 2e-5);
  EXPECT_NEAR(flip_of({0, 255, 0}, {0, 0, 255}), 1.0, 1e-6);
  EXPECT_NEAR(flip_of({100, 100, 100}, {101, 101, 101}), 0.03078320984394806, 2e-5);
  EXPECT_NEAR(flip_of({200, 30, 40}, {190, 45, 30}), 0.16310446263684583, 2e-5);
}

TEST(Flip, IsSymmetricBoundedAndZeroFarFromAnyDifference) {
  const Image8 a = test_picture();
  Image8 b = a;
  b.pixels[static_cast<size_t>((32 * kWidth + 20) * 3)] = 255;
  const FlipMap ab = flip_map(a, b), ba = flip_map(b, a);
  EXPECT_EQ(ab.values, ba.values);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float v = ab.values[static_cast<size_t>(y * kWidth + x)];
      EXPECT_GE(v, 0);
      EXPECT_LE(v, 1);
      // 10 = ceil(3 sigma) of the widest filter at 67 pixels per degree.
      if (std::abs(x - 20) > 10 || std::abs(y - 32) > 10) {
        EXPECT_EQ(v, 0) << x << ' ' << y;
      }
    }
  }
  EXPECT_GT(ab.values[32 * kWidth + 20], 0.1f);
}

TEST(Flip, ASinglePixelPictureWorks) {
  EXPECT_GT(flip_map(constant_picture(1, 1, 0, 0, 0), constant_picture(1, 1, 9, 0, 0)).mean, 0);
  EXPECT_EQ(flip_map(constant_picture(1, 1, 7, 8, 9), constant_picture(1, 1, 7, 8, 9)).mean, 0);
}

TEST(Flip, HeatPictureRunsFromBlackToWhite) {
  FlipMap map{5, 1, {0, 0.25f, 0.5f, 0.75f, 1}, 0.5};
  EXPECT_EQ(heat_picture(map).pixels,
            (std::vector<unsigned char>{0, 0, 0, 0, 0, 255, 255, 0, 0, 255, 255, 0, 255, 255, 255}));
}

}  // namespace
}  // namespace render
