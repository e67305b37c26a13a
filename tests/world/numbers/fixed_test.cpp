#include "world/numbers/fixed.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace world {
namespace {

using Fix12_4 = Fixed<12, 4>;
using Small = Fixed<4, 4>;     // 8 bits: all pairs can be tried
using Ufix5_3 = UFixed<5, 3>;  // the book's example
using Raster = Fixed<24, 8>;
using Coordinate = Fixed<32, 32>;

static_assert(sizeof(Small) == 1 && sizeof(Raster) == 4 && sizeof(Coordinate) == 8 && sizeof(Fixed<12, 4>) == 2);
static_assert(sizeof(UFixed<10, 7>) == 4);

TEST(Fixed, TheRangeIsTheBooks) {
  EXPECT_EQ(Ufix5_3::min().value(), 0);
  EXPECT_EQ(Ufix5_3::max().value(), 31.875);
  EXPECT_EQ(Small::min().value(), -8);
  EXPECT_EQ(Small::max().value(), 7.9375);
  EXPECT_EQ(Raster::max().value(), 8388607.99609375);
}

TEST(Fixed, EveryCodeComesBackAndTheErrorIsAtMostHalfAStep) {
  for (int c = -32768; c < 32768; ++c) {
    const auto fixed = Fix12_4::from_code(static_cast<int16_t>(c));
    ASSERT_EQ(Fix12_4::checked(fixed.value()), fixed);
    // Half a step up is the next code where c >= 0, away from zero; just below half is this one.
    const double half = 0x1p-5;
    if (c == 32767) continue;
    ASSERT_EQ(Fix12_4::checked(std::nextafter(fixed.value() + half, -1e9))->code, c);
    ASSERT_EQ(Fix12_4::checked(fixed.value() + half)->code, c >= 0 ? c + 1 : c);
  }
}

TEST(Fixed, ConversionOutsideTheRangeIsRefusedOrSaturates) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (double x : {nan, infinity, -infinity, 1e300, -1e300, 8.0, 7.97, -8.04, 7.96875})
    EXPECT_FALSE(Small::checked(x)) << x;
  for (double x : {7.9375, 7.96, -8.0, -8.03, 0.0, -0.0}) EXPECT_TRUE(Small::checked(x)) << x;
  EXPECT_EQ(Small::saturated(nan).value(), 0);
  EXPECT_EQ(Small::saturated(infinity), Small::max());
  EXPECT_EQ(Small::saturated(-1e300), Small::min());
  EXPECT_FALSE(Ufix5_3::checked(-0.1));
  EXPECT_EQ(Ufix5_3::saturated(-0.1).value(), 0);
  EXPECT_FALSE(Coordinate::checked(0x1p31));
  EXPECT_EQ(Coordinate::checked(-0x1p31)->value(), -0x1p31);
  EXPECT_EQ(Coordinate::saturated(0x1p31), Coordinate::max());
}

TEST(Fixed, SumsAndProductsOfAllPairsAreExactOrRefused) {
  for (int i = -128; i < 128; ++i)
    for (int j = -128; j < 128; ++j) {
      const Small a{static_cast<int8_t>(i)}, b{static_cast<int8_t>(j)};
      ASSERT_EQ(a + b - b, a) << "also where a + b overflows";
      ASSERT_EQ(a - b + b, a);
      const double sum = a.value() + b.value(), product = a.value() * b.value();
      const bool sum_fits = sum >= -8 && sum <= 7.9375;
      ASSERT_EQ(Small::checked_add(a, b).has_value(), sum_fits);
      if (sum_fits) {
        ASSERT_EQ((a + b).value(), sum);
      }
      const double difference = a.value() - b.value();
      const bool difference_fits = difference >= -8 && difference <= 7.9375;
      ASSERT_EQ(Small::checked_subtract(a, b).has_value(), difference_fits);
      if (difference_fits) {
        ASSERT_EQ((a - b).value(), difference);
      }
      const auto checked = Small::checked_multiply(a, b);
      if (checked) {
        ASSERT_LE(std::abs(checked->value() - product), 0x1p-5);
        ASSERT_EQ(a * b, *checked);
      } else {
        ASSERT_TRUE(product >= 7.9375 + 0x1p-5 || product < -8 - 0x1p-5) << product;
      }
      ASSERT_EQ(a < b, a.value() < b.value());
    }
}

TEST(Fixed, AdditionIsAssociativeWhereFloatIsNot) {
  const Coordinate far = Coordinate::saturated(1e9), near = Coordinate::saturated(0x1p-32);
  EXPECT_EQ((far + near - far).value(), 0x1p-32);
  EXPECT_EQ(1e9f + 0x1p-32f - 1e9f, 0.0f);
  Coordinate forward, backward;
  for (int i = 0; i < 1000; ++i)
    forward = forward + Coordinate::from_code(static_cast<int64_t>(random_bits(1, i, 0, 0)));
  for (int i = 999; i >= 0; --i)
    backward = backward + Coordinate::from_code(static_cast<int64_t>(random_bits(1, i, 0, 0)));
  EXPECT_EQ(forward, backward);
}

TEST(Fixed, SixtyFourBitProductsAreRoundedNotTruncated) {
  const Coordinate third = Coordinate::saturated(1 / 3.0), three = Coordinate::saturated(3);
  EXPECT_EQ(three * third, Coordinate::saturated(1) - Coordinate::from_code(1));
  EXPECT_EQ((Coordinate::saturated(-1.5) * Coordinate::saturated(40000.25)).value(), -60000.375);
  EXPECT_FALSE(Coordinate::checked_multiply(Coordinate::saturated(1e6), Coordinate::saturated(1e6)));
}

}  // namespace
}  // namespace world
