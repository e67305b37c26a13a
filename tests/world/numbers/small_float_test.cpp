#include "world/numbers/small_float.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace world {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(Half, EveryCodeComesBack) {
  int nans = 0;
  for (uint32_t c = 0; c < 65536; ++c) {
    const Half code{static_cast<uint16_t>(c)};
    const float x = float_from_half(code);
    if (std::isnan(x)) {
      ++nans;
      ASSERT_TRUE(std::isnan(float_from_half(half_from_float(x)))) << c;
    } else {
      ASSERT_EQ(half_from_float(x), code) << c;
    }
  }
  EXPECT_EQ(nans, 2 * 1023);
}

TEST(Half, EveryCodeHasTheValueOfTheStandard) {
  for (uint32_t c = 0; c < 0x7c00; ++c) {
    const int exponent = static_cast<int>(c >> 10), mantissa = static_cast<int>(c & 1023);
    const double expected = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
    ASSERT_EQ(float_from_half({static_cast<uint16_t>(c)}), expected) << c;
    ASSERT_EQ(float_from_half({static_cast<uint16_t>(c | 0x8000u)}), -expected) << c;
  }
  EXPECT_EQ(float_from_half({0x7c00}), kInfinity);
  EXPECT_EQ(float_from_half({0xfc00}), -kInfinity);
}

/// Between two neighbours the nearer one is taken, and the even one in the middle. Encoding is monotone (checked here
/// at each middle and the floats beside it), so that these three floats a pair prove all others.
TEST(Half, RoundsToTheNearestAndTiesToEven) {
  for (uint32_t c = 0; c + 1 < 0x7c00; ++c) {
    const float low = float_from_half({static_cast<uint16_t>(c)}),
                high = float_from_half({static_cast<uint16_t>(c + 1)});
    const float middle = low + (high - low) / 2;  // exact: one bit more than Half has
    ASSERT_EQ(half_from_float(middle).code, c & 1 ? c + 1 : c) << c;
    ASSERT_EQ(half_from_float(std::nextafter(middle, 0.0f)).code, c) << c;
    ASSERT_EQ(half_from_float(std::nextafter(middle, kInfinity)).code, c + 1) << c;
    ASSERT_EQ(half_from_float(-middle).code, half_from_float(middle).code | 0x8000u) << c;
    const double bound = std::max(low * 0x1p-11, 0x1p-25);
    ASSERT_LE(double{middle} - low, low < 0x1p-14f ? 0x1p-25 : bound) << c;
  }
}

TEST(HardCaseN7, HalfFloatEdges) {
  const auto through = [](float x) { return float_from_half(half_from_float(x)); };
  EXPECT_EQ(through(65504), 65504);
  EXPECT_EQ(through(65519), 65504);
  EXPECT_EQ(through(65520), kInfinity);
  EXPECT_EQ(through(1e30f), kInfinity);
  EXPECT_EQ(through(2049), 2048);  // integers end at 2048
  EXPECT_EQ(through(2051), 2052);
  EXPECT_EQ(through(1e-8f), 0);
  EXPECT_EQ(through(0x1p-25f), 0);  // half of the smallest, to even
  EXPECT_EQ(through(std::nextafter(0x1p-25f, 1.0f)), 0x1p-24f);
  EXPECT_TRUE(std::isnan(through(kNan)));
  EXPECT_TRUE(std::signbit(through(-0.0f)));
  // What is stored is finite.
  const auto stored = [](float x) { return float_from_half(half_from_float_saturated(x)); };
  EXPECT_EQ(stored(65520), 65504);
  EXPECT_EQ(stored(kInfinity), 65504);
  EXPECT_EQ(stored(-kInfinity), -65504);
  EXPECT_EQ(stored(kNan), 0);
}

TEST(Float7e3, EveryCodeComesBackAndHasItsValue) {
  for (uint32_t c = 0; c < 1024; ++c) {
    const Float7e3 code{static_cast<uint16_t>(c)};
    const int exponent = static_cast<int>(c >> 7), mantissa = static_cast<int>(c & 127);
    const double expected = exponent == 0 ? std::ldexp(mantissa, -9) : std::ldexp(128 + mantissa, exponent - 10);
    ASSERT_EQ(code.value(), expected) << c;
    ASSERT_EQ(Float7e3::from(code.value()), code) << c;
  }
  EXPECT_EQ(Float7e3{1023}.value(), Float7e3::kMax);
}

TEST(Float7e3, TheErrorIsAtMost1In256AndBelowAQuarter1In1024Absolute) {
  for (uint32_t c = 0; c < 1023; ++c) {
    const double low = Float7e3{static_cast<uint16_t>(c)}.value(),
                 high = Float7e3{static_cast<uint16_t>(c + 1)}.value();
    const float middle = static_cast<float>((low + high) / 2);
    ASSERT_EQ(Float7e3::from(middle).code, c & 1 ? c + 1 : c);
    ASSERT_EQ(Float7e3::from(std::nextafter(middle, 0.0f)).code, c);
    ASSERT_EQ(Float7e3::from(std::nextafter(middle, 99.0f)).code, c + 1);
    ASSERT_LE(middle - low, low < 0.25 ? 0x1p-10 : middle * 0x1p-8) << c;
  }
}

TEST(Float7e3, ClampsAndTurnsNanToZero) {
  EXPECT_EQ(Float7e3::from(kNan).value(), 0);
  EXPECT_EQ(Float7e3::from(-1).value(), 0);
  EXPECT_EQ(Float7e3::from(-0.0f).value(), 0);
  EXPECT_EQ(Float7e3::from(kInfinity).value(), 31.875f);
  EXPECT_EQ(Float7e3::from(32).value(), 31.875f);
}

}  // namespace
}  // namespace world
