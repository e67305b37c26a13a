#include "world/numbers/interval.h"

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace world {
namespace {

double draw(uint64_t i, uint64_t stream, double low, double high) {
  return low + (high - low) * uniform01_double(random_bits(11, 0, 0, 0, i, stream));
}

TEST(Interval, HoldsEveryValueOfEveryOperation) {
  for (uint64_t i = 0; i < 20000; ++i) {
    const double a0 = draw(i, 0, -20, 20), b0 = draw(i, 1, -20, 20);
    const double scale = std::pow(2.0, std::floor(draw(i, 2, -40, 10)));
    const Interval a(a0, a0 + scale * draw(i, 3, 0, 1)), b(b0, b0 + scale * draw(i, 4, 0, 1));
    const double x = std::min(a.hi, a.lo + (a.hi - a.lo) * draw(i, 5, 0, 1)),
                 y = std::min(b.hi, b.lo + (b.hi - b.lo) * draw(i, 6, 0, 1));
    // long double has 11 bits more: what it rounds to may lie a little beside, not a whole ulp of double.
    const long double lx = x, ly = y;
    const auto holds = [](Interval v, long double exact) { return v.lo <= exact && exact <= v.hi; };
    ASSERT_TRUE(holds(a + b, lx + ly));
    ASSERT_TRUE(holds(a - b, lx - ly));
    ASSERT_TRUE(holds(a * b, lx * ly));
    ASSERT_TRUE(holds(square(a), lx * lx));
    ASSERT_TRUE(holds(absolute(a), std::abs(lx)));
    ASSERT_TRUE(holds(square_root(absolute(a)), std::sqrt(std::abs(lx))));
    ASSERT_TRUE(holds(exponential(a), std::exp(lx)));
    ASSERT_TRUE(holds(cosine(a), std::cos(lx)));
    ASSERT_TRUE(holds(maximum(a, b), std::max(lx, ly)));
    ASSERT_GE(square(a).lo, 0);
  }
}

TEST(Interval, CosineKnowsItsPeaks) {
  EXPECT_EQ(cosine({-0.1, 0.1}).hi, 1);
  EXPECT_EQ(cosine({3, 3.3}).lo, -1);
  EXPECT_LT(cosine({0.5, 1}).hi, 0.88);
  EXPECT_GT(cosine({0.5, 1}).lo, 0.54);
  EXPECT_EQ(cosine({-1000, 1000}).lo, -1);
  EXPECT_EQ(cosine({-1000, 1000}).hi, 1);
}

}  // namespace
}  // namespace world
