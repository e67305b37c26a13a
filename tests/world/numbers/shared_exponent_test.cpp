#include "world/numbers/shared_exponent.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace world {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The steps of EXT_texture_shared_exponent as written there, in long double, where each of them is exact.
uint32_t by_the_specification(const glm::vec3& rgb) {
  const int n = 9, bias = 15;
  const auto clamped = [](float x) -> long double { return x > 0 ? std::min(x, 65408.0f) : 0.0f; };
  const long double c[3] = {clamped(rgb.x), clamped(rgb.y), clamped(rgb.z)};
  const long double largest = std::max({c[0], c[1], c[2]});
  const int floor_log2 = largest > 0 ? std::ilogb(largest) : -1000;
  int exponent = std::max(-bias - 1, floor_log2) + 1 + bias;
  if (std::floor(std::ldexp(largest, -(exponent - bias - n)) + 0.5L) == 512) ++exponent;
  uint32_t code = static_cast<uint32_t>(exponent) << 27;
  for (int band = 0; band < 3; ++band)
    code |= static_cast<uint32_t>(std::floor(std::ldexp(c[band], -(exponent - bias - n)) + 0.5L)) << (9 * band);
  return code;
}

double worst_error(const glm::vec3& a, const glm::vec3& b) {
  double worst = 0;
  for (int i = 0; i < 3; ++i) worst = std::max(worst, std::abs(double{a[i]} - b[i]));
  return worst;
}

glm::vec3 random_triple(int i) {
  glm::vec3 rgb;
  for (int band = 0; band < 3; ++band) {
    const uint64_t bits = random_bits(9, i, band, 0);
    // Exponents -14..14 and a random mantissa.
    rgb[band] = static_cast<float>(std::ldexp(1 + uniform01_double(bits), static_cast<int>(bits % 29) - 14));
  }
  return rgb;
}

TEST(HardCaseN8, Rgb9e5ErrorIsAtMostMaxChannelOver511) {
  double worst = 0;
  for (int i = 0; i < 2'000'000; ++i) {
    const glm::vec3 rgb = random_triple(i);
    const double ratio = worst_error(Rgb9e5::from(rgb).value(), rgb) / std::max({rgb.x, rgb.y, rgb.z});
    if (ratio > worst) worst = ratio;
  }
  EXPECT_LE(worst, 1 / 511.0);
  EXPECT_GT(worst, 1 / 512.0);  // the carry from 511.5 makes 1/512 too tight a claim
}

/// Grey at each step of each exponent and at the edges between them: the largest band's own error, exhaustively.
TEST(HardCaseN8, EveryStepOfEveryExponentIsWithinTheBound) {
  for (int exponent = 0; exponent < 32; ++exponent) {
    const double step = std::ldexp(1.0, exponent - 24);
    for (int m = exponent == 0 ? 0 : 255; m < 512; ++m) {
      const float edge = static_cast<float>((m + 0.5) * step);
      for (float x : {static_cast<float>(m * step), edge, std::nextafter(edge, 0.0f), std::nextafter(edge, 1e9f)}) {
        const float in_range = std::min(x, Rgb9e5::kMax);
        const double bound = std::max(in_range / 511.0, 0x1p-25);
        ASSERT_LE(std::abs(double{Rgb9e5::from({x, 0, 0}).value().x} - in_range), bound) << exponent << ' ' << m;
        ASSERT_EQ(Rgb9e5::from({x, x / 3, 0}).code, by_the_specification({x, x / 3, 0})) << exponent << ' ' << m;
      }
    }
  }
}

TEST(HardCaseN8, EncodingADecodedColourGivesTheSameCode) {
  for (int i = 0; i < 2'000'000; ++i) {
    const Rgb9e5 once = Rgb9e5::from(random_triple(i));
    ASSERT_EQ(Rgb9e5::from(once.value()).code, once.code) << i;
  }
}

TEST(HardCaseN8, TheCodeIsTheSpecificationsBitForBit) {
  for (int i = 0; i < 300'000; ++i) {
    const glm::vec3 rgb = random_triple(i);
    ASSERT_EQ(Rgb9e5::from(rgb).code, by_the_specification(rgb)) << rgb.x << ' ' << rgb.y << ' ' << rgb.z;
  }
  for (int power = -149; power <= 16; ++power)
    for (float x :
         {std::ldexp(1.0f, power), std::nextafter(std::ldexp(1.0f, power), 0.0f), std::ldexp(511.5f, power - 9)})
      ASSERT_EQ(Rgb9e5::from({x, 0, x}).code, by_the_specification({x, 0, x})) << x;
}

TEST(HardCaseN8, TheNamedCases) {
  EXPECT_EQ(Rgb9e5::from({65408, 65408, 65408}).value(), glm::vec3(65408));
  EXPECT_EQ(Rgb9e5::from({1000, 0.9f, 0.4f}).value(), glm::vec3(1000, 0, 0));
  EXPECT_EQ(Rgb9e5::from({-5, kNan, kInfinity}).value(), glm::vec3(0, 0, 65408));
  EXPECT_EQ(Rgb9e5::from({0, -0.0f, kNan}).code, 0u);
  EXPECT_EQ(Rgb9e5::from({std::numeric_limits<float>::denorm_min(), 0, 0}).value(), glm::vec3(0));
}

}  // namespace
}  // namespace world
