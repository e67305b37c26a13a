#include "world/numbers/normalized.shared.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "world/numbers/rgb565.h"

namespace world {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The smallest float in (low, high] for which `at_least` holds; it must be monotone, false at low and true at high.
template <class Predicate>
float first_float(float low, float high, Predicate at_least) {
  while (std::nextafter(low, high) != high) {
    const float middle = low + (high - low) * 0.5f;
    const float m = middle > low && middle < high ? middle : std::nextafter(low, high);
    (at_least(m) ? high : low) = m;
  }
  return high;
}

/// Encoding is monotone, so that the worst error is beside a change of code. All of them are looked at.
template <int N>
void expect_unorm_within_half_a_step() {
  const double half_step = 0.5 / Unorm<N>::kTop;
  for (uint32_t c = 0; c <= Unorm<N>::kTop; ++c) {
    const Unorm<N> code{static_cast<typename Unorm<N>::Code>(c)};
    ASSERT_EQ(Unorm<N>::from(code.value()), code) << N << " bits";
    ASSERT_EQ(code.value(), static_cast<float>(static_cast<double>(c) / Unorm<N>::kTop)) << "not correctly rounded";
    if (c == 0) continue;
    const float before = static_cast<float>(c - 1) / Unorm<N>::kTop;
    const float edge = first_float(before, code.value(), [&](float x) { return Unorm<N>::from(x).code >= c; });
    const float below = std::nextafter(edge, 0.0f);
    ASSERT_LE(std::abs(double{Unorm<N>::from(edge).value()} - edge), half_step + 0x1p-23) << N << " bits, code " << c;
    ASSERT_LE(std::abs(double{Unorm<N>::from(below).value()} - below), half_step + 0x1p-23) << N << " bits, code " << c;
  }
}

TEST(Unorm, EveryCodeComesBackAndTheErrorIsAtMostHalfAStep) {
  expect_unorm_within_half_a_step<1>();
  expect_unorm_within_half_a_step<4>();
  expect_unorm_within_half_a_step<5>();
  expect_unorm_within_half_a_step<6>();
  expect_unorm_within_half_a_step<8>();
  expect_unorm_within_half_a_step<10>();
  expect_unorm_within_half_a_step<12>();
  expect_unorm_within_half_a_step<16>();
}

TEST(Unorm, ClampsAndTurnsNanToZero) {
  EXPECT_EQ(Unorm<8>::from(kNan).code, 0);
  EXPECT_EQ(Unorm<8>::from(-kInfinity).code, 0);
  EXPECT_EQ(Unorm<8>::from(-0.0f).code, 0);
  EXPECT_EQ(Unorm<8>::from(std::nextafter(1.0f, 2.0f)).code, 255);
  EXPECT_EQ(Unorm<16>::from(kInfinity).code, 65535);
}

TEST(HardCaseN1, All256Unorm8CodesRoundTrip) {
  int exact = 0, exact_by_256 = 0, same_as_reciprocal = 0;
  for (int c = 0; c < 256; ++c) {
    exact += Unorm<8>::from(Unorm<8>{static_cast<uint8_t>(c)}.value()).code == c;
    exact_by_256 += Unorm<8>::from(static_cast<float>(c) / 256.0f).code == c;
    same_as_reciprocal += static_cast<float>(c) * (1 / 255.0f) == static_cast<float>(c) / 255.0f;
  }
  EXPECT_EQ(exact, 256);
  // Why the formula is fixed: the two usual short cuts differ from it.
  EXPECT_EQ(256 - exact_by_256, 127);
  EXPECT_EQ(256 - same_as_reciprocal, 126);
}

TEST(HardCaseN3, Snorm8HasAnExactZeroAndOnlyTheLowestCodeMoves) {
  int moved = 0, zeros = 0, zeros_of_old_formula = 0;
  for (int c = -128; c < 128; ++c) {
    const Snorm<8> code{static_cast<int8_t>(c)};
    moved += Snorm<8>::from(code.value()) != code;
    zeros += code.value() == 0.0f;
    zeros_of_old_formula += static_cast<float>(2 * c + 1) / 255.0f == 0.0f;
  }
  EXPECT_EQ(moved, 1);
  EXPECT_EQ(Snorm<8>::from(Snorm<8>{-128}.value()).code, -127);
  EXPECT_EQ(zeros, 1);
  EXPECT_EQ(Snorm<8>::from(0.0f).code, 0);
  EXPECT_EQ(Snorm<8>{-127}.value(), -1.0f);
  EXPECT_EQ(Snorm<8>{127}.value(), 1.0f);
  EXPECT_EQ(zeros_of_old_formula, 0);  // sliding the line is what makes the zero
}

template <int N>
void expect_snorm_within_half_a_step() {
  const double half_step = 0.5 / Snorm<N>::kTop;
  for (int c = 1; c <= Snorm<N>::kTop; ++c) {
    const float value = static_cast<float>(c) / Snorm<N>::kTop, before = static_cast<float>(c - 1) / Snorm<N>::kTop;
    const float edge = first_float(before, value, [&](float x) { return Snorm<N>::from(x).code >= c; });
    for (float x : {edge, std::nextafter(edge, 0.0f), value}) {
      ASSERT_LE(std::abs(double{Snorm<N>::from(x).value()} - x), half_step + 0x1p-23) << N << " bits, code " << c;
      ASSERT_EQ(Snorm<N>::from(-x).code, -Snorm<N>::from(x).code) << "not symmetric";
    }
    ASSERT_EQ(Snorm<N>::from(value).code, c);
  }
}

TEST(Snorm, TheErrorIsAtMostHalfAStepAndTheSignIsSymmetric) {
  expect_snorm_within_half_a_step<2>();
  expect_snorm_within_half_a_step<8>();
  expect_snorm_within_half_a_step<10>();
  expect_snorm_within_half_a_step<16>();
  EXPECT_EQ(Snorm<16>::from(kNan).code, 0);
  EXPECT_EQ(Snorm<16>::from(kInfinity).code, 32767);
  EXPECT_EQ(Snorm<16>::from(-kInfinity).code, -32767);
}

TEST(Rgb565, EveryCodeComesBack) {
  for (uint32_t c = 0; c < 65536; ++c) {
    const Rgb565 code{static_cast<uint16_t>(c)};
    ASSERT_EQ(Rgb565::from(code.value()), code);
  }
}

TEST(Rgb565, TheErrorIsAtMostHalfAStepInEachBand) {
  for (int i = 0; i <= 1 << 20; ++i) {
    const float x = static_cast<float>(i) * 0x1p-20f;
    const glm::vec3 back = Rgb565::from({x, x, x}).value();
    ASSERT_LE(std::abs(back.x - x), 0.5f / 31 + 0x1p-23f);
    ASSERT_LE(std::abs(back.y - x), 0.5f / 63 + 0x1p-23f);
    ASSERT_EQ(back.z, back.x);
  }
  EXPECT_EQ(Rgb565::from({1, 0, 0}).code, 0xf800);
  EXPECT_EQ(Rgb565::from({0, 1, 0}).code, 0x07e0);
  EXPECT_EQ(Rgb565::from({0, 0, 1}).code, 0x001f);
  EXPECT_EQ(Rgb565::from({kNan, -1, 2}).code, 0x001f);
}

}  // namespace
}  // namespace world
