#include "render/image/display.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace render {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The code of one linear display value, through display_image; the value is exact at this radiance scale.
std::vector<int> codes_of(const std::vector<float>& radiance) {
  Image image(static_cast<int>(radiance.size()), 1);
  for (size_t i = 0; i < radiance.size(); ++i) image.pixels[i] = {radiance[i], radiance[i], radiance[i]};
  const Image8 shown = display_image(image, 0);
  std::vector<int> codes;
  for (size_t i = 0; i < radiance.size(); ++i) {
    EXPECT_EQ(shown.pixels[3 * i], shown.pixels[3 * i + 1]);
    EXPECT_EQ(shown.pixels[3 * i], shown.pixels[3 * i + 2]);
    codes.push_back(shown.pixels[3 * i]);
  }
  return codes;
}

int code_by_definition(float radiance, float exposure_ev = 0) {
  const float linear = radiance * (std::exp2(exposure_ev) / kWhiteRadiance);
  return static_cast<int>(std::floor(srgb_from_linear(linear) * 255.0f + 0.5f));
}

TEST(Display, TableEqualsTheFloatFunctionAtEveryStepAndItsNeighbours) {
  // The linear value halfway between two codes, and 300 floats on each side of it.
  for (int code = 0; code < 255; ++code) {
    const double srgb = (code + 0.5) / 255;
    const double linear = srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
    float below = static_cast<float>(linear * kWhiteRadiance), above = below;
    std::vector<float> radiance = {below};
    for (int i = 0; i < 300; ++i) {
      below = std::nextafter(below, -1.0f), above = std::nextafter(above, 1e9f);
      radiance.push_back(below), radiance.push_back(above);
    }
    const std::vector<int> codes = codes_of(radiance);
    for (size_t i = 0; i < radiance.size(); ++i) {
      ASSERT_EQ(codes[i], code_by_definition(radiance[i])) << radiance[i];
    }
    ASSERT_EQ(codes[599], code) << "300 floats below the step";
    ASSERT_EQ(codes[600], code + 1) << "300 floats above the step";
  }
}

TEST(Display, TableEqualsTheFloatFunctionOnRandomBitsAndExposures) {
  std::mt19937 random(5);
  for (const float ev : {-3.0f, 0.0f, 0.7f, 9.0f}) {
    Image image(1 << 15, 1);
    for (Rgb& p : image.pixels) {
      const auto any = [&] {
        const uint32_t bits = random();
        float f;
        std::memcpy(&f, &bits, 4);
        return random() % 4 == 0 ? f : std::ldexp(static_cast<float>(random() & 0xffffff), -24 - (random() & 7)) * 200;
      };
      p = {any(), any(), any()};
    }
    const Image8 shown = display_image(image, ev);
    for (size_t i = 0; i < image.pixels.size(); ++i) {
      ASSERT_EQ(shown.pixels[3 * i], code_by_definition(image.pixels[i].r, ev)) << image.pixels[i].r;
      ASSERT_EQ(shown.pixels[3 * i + 1], code_by_definition(image.pixels[i].g, ev)) << image.pixels[i].g;
      ASSERT_EQ(shown.pixels[3 * i + 2], code_by_definition(image.pixels[i].b, ev)) << image.pixels[i].b;
    }
  }
}

TEST(Display, OneExposureStopDoublesTheValue) {
  Image image(2, 1);
  image.pixels[0] = {0.25f * kWhiteRadiance, 0, kWhiteRadiance};
  image.pixels[1] = {0.5f * kWhiteRadiance, 0, kWhiteRadiance};
  const Image8 a = display_image(image, 1), b = display_image(image, 0);
  EXPECT_EQ(a.pixels[0], b.pixels[3]);
  EXPECT_EQ(a.pixels[0], 188);  // sRGB of 0.5 is 0.7353569830524495
  EXPECT_EQ(a.pixels[2], 255);
  EXPECT_EQ(a.pixels[1], 0);
}

// N4: every 8-bit code survives the way to linear float and back.
TEST(HardCaseN4, All256CodesSurviveLinearFloat) {
  std::vector<float> radiance;
  for (int code = 0; code < 256; ++code) {
    const float linear = linear_from_srgb(static_cast<float>(code) / 255.0f);
    EXPECT_EQ(static_cast<int>(srgb_from_linear(linear) * 255.0f + 0.5f), code);
    radiance.push_back(linear * kWhiteRadiance);
  }
  const std::vector<int> codes = codes_of(radiance);
  for (int code = 0; code < 256; ++code) EXPECT_EQ(codes[static_cast<size_t>(code)], code);
}

TEST(HardCaseN5, SrgbOfNanNegativeAndBeyondOneStaysInRange) {
  EXPECT_EQ(srgb_from_linear(kNan), 0.0f);
  EXPECT_EQ(srgb_from_linear(-kInfinity), 0.0f);
  EXPECT_EQ(srgb_from_linear(-0.1f), 0.0f);
  EXPECT_EQ(srgb_from_linear(-0.0f), 0.0f);
  EXPECT_FALSE(std::signbit(srgb_from_linear(-0.0f)));
  EXPECT_EQ(srgb_from_linear(1.5f), 1.0f);
  EXPECT_EQ(srgb_from_linear(kInfinity), 1.0f);
  EXPECT_EQ(linear_from_srgb(kNan), 0.0f);
  EXPECT_EQ(linear_from_srgb(-1.0f), 0.0f);
  EXPECT_EQ(linear_from_srgb(7.0f), 1.0f);
  EXPECT_EQ(codes_of({kNan, -kInfinity, -15.0f, -0.0f, 225.0f, kInfinity}), (std::vector<int>{0, 0, 0, 0, 255, 255}));
}

// N6: a plain power of 2.2 differs by up to 9 codes; this encoding must not.
TEST(HardCaseN6, EncodingIsSrgbAndNotAPowerOf22) {
  int worst = 0;
  for (int code = 0; code < 256; ++code) {
    const float linear = linear_from_srgb(static_cast<float>(code) / 255.0f);
    const int plain = static_cast<int>(std::pow(linear, 1 / 2.2f) * 255.0f + 0.5f);
    worst = std::max(worst, std::abs(plain - code));
  }
  EXPECT_EQ(worst, 9);
}

// R19: a grey ramp comes out as sRGB once, not twice. Values by the standard's formula in Python's float64.
TEST(HardCaseR19, GreyRampIsEncodedOnce) {
  std::vector<float> radiance;
  for (int i = 0; i <= 10; ++i) radiance.push_back(static_cast<float>(i) / 10.0f * kWhiteRadiance);
  EXPECT_EQ(codes_of(radiance), (std::vector<int>{0, 89, 124, 149, 170, 188, 203, 218, 231, 243, 255}));
}

}  // namespace
}  // namespace render
