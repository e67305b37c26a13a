#include "tools/bench/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>

namespace tools {

const double kInfinity = std::numeric_limits<double>::infinity();
const double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Statistics, QuartilesInterpolateBetweenSortedSamples) {
  const Spread s = spread_of({4, 1, 3, 2});
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.q1, 1.75);
  EXPECT_DOUBLE_EQ(s.q3, 3.25);
  EXPECT_DOUBLE_EQ(s.iqr(), 1.5);
  EXPECT_DOUBLE_EQ(s.minimum, 1);
  EXPECT_DOUBLE_EQ(s.maximum, 4);
  EXPECT_EQ(s.count, 4);
}

TEST(Statistics, OneOutlierMovesNeitherMedianNorQuartiles) {
  const Spread calm = spread_of({10, 11, 12, 13, 14, 15, 16, 17, 18});
  const Spread wild = spread_of({10, 11, 12, 13, 14, 15, 16, 17, 1e9});
  EXPECT_EQ(calm.median, wild.median);
  EXPECT_EQ(calm.q1, wild.q1);
  EXPECT_EQ(calm.q3, wild.q3);
}

TEST(Statistics, OneSampleIsItsOwnSpread) {
  const Spread s = spread_of({7});
  EXPECT_EQ(s.median, 7);
  EXPECT_EQ(s.q1, 7);
  EXPECT_EQ(s.q3, 7);
}

TEST(Statistics, AFailedSampleIsNeverDropped) {
  EXPECT_TRUE(std::isnan(spread_of({1, kNan, 3}).median));
  EXPECT_TRUE(std::isnan(spread_of({}).median));
  EXPECT_EQ(spread_of({kInfinity, kInfinity, kInfinity}).median, kInfinity);
}

TEST(Statistics, OrderIsAPermutationAndAFunctionOfSeedAndRound) {
  for (uint64_t round = 0; round < 20; ++round) {
    std::vector<size_t> order = shuffled_order(9, 42, round);
    EXPECT_EQ(order, shuffled_order(9, 42, round));
    std::sort(order.begin(), order.end());
    std::vector<size_t> expected(9);
    std::iota(expected.begin(), expected.end(), size_t{0});
    EXPECT_EQ(order, expected);
  }
  EXPECT_NE(shuffled_order(9, 42, 0), shuffled_order(9, 42, 1));
  EXPECT_NE(shuffled_order(9, 42, 0), shuffled_order(9, 43, 0));
}

TEST(Statistics, EachContenderIsFirstEquallyOften) {
  // Of 6000 rounds each of 3 is first 2000 times; the standard deviation is 36.5, the bound five of them.
  int first[3] = {};
  for (uint64_t round = 0; round < 6000; ++round) ++first[shuffled_order(3, 1, round)[0]];
  for (int f : first) EXPECT_NEAR(f, 2000, 183);
}

TEST(Statistics, FrontHoldsExactlyWhatNothingBeats) {
  //                                 front  front  beaten front  failed  failed
  const std::vector<double> errors{1.0, 0.5, 0.7, 0.1, kNan, 0.0};
  const std::vector<double> costs{1.0, 2.0, 3.0, 9.0, 0.1, kInfinity};
  EXPECT_EQ(pareto_front(errors, costs), (std::vector<bool>{true, true, false, true, false, false}));
}

TEST(Statistics, FrontAgreesWithItsDefinitionOnRandomPoints) {
  for (uint64_t trial = 0; trial < 50; ++trial) {
    std::vector<double> errors, costs;
    for (size_t k : shuffled_order(30, trial, 0)) errors.push_back(static_cast<double>(k / 3));  // with ties
    for (size_t k : shuffled_order(30, trial, 1)) costs.push_back(static_cast<double>(k / 3));
    const std::vector<bool> front = pareto_front(errors, costs);
    // Sort by error, then cost; a point is on the front where its cost is the least so far and no equal error is
    // cheaper.
    for (size_t i = 0; i < 30; ++i) {
      double cheapest = kInfinity, cheapest_below = kInfinity;
      for (size_t j = 0; j < 30; ++j) {
        if (errors[j] <= errors[i]) cheapest = std::min(cheapest, costs[j]);
        if (errors[j] < errors[i]) cheapest_below = std::min(cheapest_below, costs[j]);
      }
      EXPECT_EQ(front[i], costs[i] == cheapest && cheapest_below > costs[i]) << "trial " << trial << " point " << i;
    }
  }
}

TEST(Statistics, DominationBeyondAMarginForgivesNearTies) {
  EXPECT_FALSE(dominated_beyond({1.0, 0.97}, {1.0, 0.97}, 0, 0.05));
  EXPECT_TRUE(dominated_beyond({1.0, 0.90}, {1.0, 1.0}, 0, 0.05));
  EXPECT_TRUE(dominated_beyond({1.0, 1.0}, {1.0, 0.90}, 0, 0.05));
  EXPECT_FALSE(dominated_beyond({1.0, 0.1}, {1.0, 1.1}, 0, 0.05));
  // Measured costs: only where their inner halves are apart.
  EXPECT_TRUE(dominated_beyond({1.0, 0.5}, {1.0, 0.8}, 0, 0.05, {0.2, 0.2}));
  EXPECT_FALSE(dominated_beyond({1.0, 0.5}, {1.0, 0.8}, 0, 0.05, {0.2, 0.3}));
}

TEST(Statistics, SlopeOfAPowerLawIsItsExponent) {
  std::vector<double> x, y;
  for (double v = 1; v < 1000; v *= 2) x.push_back(v), y.push_back(3 * std::pow(v, -1.5));
  ASSERT_TRUE(log_log_slope(x, y).has_value());
  EXPECT_NEAR(*log_log_slope(x, y), -1.5, 1e-12);
  EXPECT_FALSE(log_log_slope({1, 2}, {0, 0}).has_value());
  EXPECT_FALSE(log_log_slope({5, 5}, {1, 2}).has_value());
}

}  // namespace tools
