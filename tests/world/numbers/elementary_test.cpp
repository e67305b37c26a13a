#include "world/numbers/elementary.shared.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include <gtest/gtest.h>

namespace world {
namespace {

double ulp(double exact) {
  const float at = std::abs(static_cast<float>(exact));
  return double{std::nextafter(at, INFINITY)} - at;
}

TEST(Elementary, LogOneMinusIsWithin2UlpForAllArgumentsOf16LeadingBits) {
  double worst = 0, worst_naive = 0;
  for (uint32_t bits = 0x00800000u; bits < 0x3f800000u; bits += 0x80) {
    const float x = std::bit_cast<float>(bits);
    const double exact = std::log1p(-double{x});
    worst = std::max(worst, std::abs(shared::log_one_minus(x) - exact) / ulp(exact));
    if (x > 1e-4f) worst_naive = std::max(worst_naive, std::abs(std::log(1 - x) - exact) / ulp(exact));
  }
  printf("  log_one_minus: %.2f ulp; naive: %.3g\n", worst, worst_naive);
  EXPECT_LE(worst, 2);
  EXPECT_GT(worst_naive, 100) << "the control found nothing";
  EXPECT_EQ(shared::log_one_minus(0), 0);
}

TEST(Elementary, ExpMinusOneIsWithin2UlpUpToAHalfForAllArgumentsOf16LeadingBits) {
  double worst = 0, worst_naive = 0;
  for (uint32_t bits = 0x00800000u; bits <= 0x3f000000u; bits += 0x80)
    for (const float x : {std::bit_cast<float>(bits), -std::bit_cast<float>(bits)}) {
      const double exact = std::expm1(double{x});
      worst = std::max(worst, std::abs(shared::exp_minus_one(x) - exact) / ulp(exact));
      if (std::abs(x) > 1e-4f) worst_naive = std::max(worst_naive, std::abs(std::exp(x) - 1 - exact) / ulp(exact));
    }
  printf("  exp_minus_one: %.2f ulp; naive: %.3g\n", worst, worst_naive);
  EXPECT_LE(worst, 2);
  EXPECT_GT(worst_naive, 100) << "the control found nothing";
  for (const float x : {-80.0f, -2.0f, 0.7f, 3.0f}) EXPECT_FLOAT_EQ(shared::exp_minus_one(x), std::expm1(x));
}

}  // namespace
}  // namespace world
