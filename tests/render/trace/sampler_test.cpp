#include "render/trace/sampler.h"

#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace render {
namespace {

TEST(Sampler, NumbersAreAFunctionOfSeedPixelSampleAndDimension) {
  for (const SampleSequence sequence : {SampleSequence::random, SampleSequence::sobol}) {
    const Sampler a(sequence, 7, 3, 5, 11), again(sequence, 7, 3, 5, 11);
    EXPECT_EQ(a.one(4), again.one(4));
    EXPECT_EQ(a.two(4), again.two(4));
    EXPECT_EQ(a.stream(4).next(), again.stream(4).next());
    EXPECT_NE(a.two(4), Sampler(sequence, 8, 3, 5, 11).two(4));
    EXPECT_NE(a.two(4), Sampler(sequence, 7, 5, 3, 11).two(4));
    EXPECT_NE(a.two(4), Sampler(sequence, 7, 3, 5, 12).two(4));
    EXPECT_NE(a.two(4), a.two(6));
  }
}

TEST(Sampler, AllNumbersLieInTheUnitIntervalOneExcluded) {
  for (const SampleSequence sequence : {SampleSequence::random, SampleSequence::sobol})
    for (uint32_t s = 0; s < 20000; ++s) {
      const glm::vec3 u = Sampler(sequence, 1, s % 13, s % 7, s * 65537).three(s % 31);
      for (int a = 0; a < 3; ++a) ASSERT_TRUE(u[a] >= 0 && u[a] < 1) << u[a];
    }
}

/// How many of 2^k points lie in each elementary interval [i 2^-a, (i + 1) 2^-a) x [j 2^-(k-a), (j + 1) 2^-(k-a)).
TEST(SobolSampler, EachElementaryIntervalHoldsOnePointOfEachRunOfAPowerOfTwo) {
  for (uint32_t pixel = 0; pixel < 20; ++pixel)
    for (const uint32_t begin : {0u, 256u, 1024u * 37})
      for (int a = 0; a <= 8; ++a) {
        std::set<std::pair<int, int>> cells;
        for (uint32_t s = begin; s < begin + 256; ++s) {
          const glm::vec2 u = Sampler(SampleSequence::sobol, 9, pixel, 2, s).two(6);
          cells.insert({static_cast<int>(u.x * static_cast<float>(1 << a)),
                        static_cast<int>(u.y * static_cast<float>(1 << (8 - a)))});
        }
        EXPECT_EQ(cells.size(), 256u) << "pixel " << pixel << " from " << begin << " columns " << (1 << a);
      }
}

TEST(SobolSampler, PairsOfDimensionsAreIndependentOfEachOther) {
  // Over 4096 samples each cell of a 16 x 16 table of (dimension 0, dimension 2) expects 16, and is binomial if the two
  // are shuffled apart: chi^2 with 255 degrees of freedom lies below 340 but once in 5000.
  std::vector<int> table(256);
  for (uint32_t s = 0; s < 4096; ++s) {
    const Sampler sampler(SampleSequence::sobol, 3, 1, 1, s);
    ++table[static_cast<size_t>(sampler.two(0).x * 16) * 16 + static_cast<size_t>(sampler.two(2).x * 16)];
  }
  double chi = 0;
  for (const int n : table) chi += (n - 16) * (n - 16) / 16.0;
  EXPECT_LT(chi, 340);
}

TEST(SobolSampler, ASmoothIntegralErrsLessThanByRandomNumbers) {
  // The integral of x y over the unit square is 1/4; of 256 random samples the standard error is 0.0138.
  double squared[2] = {0, 0};
  for (uint32_t pixel = 0; pixel < 100; ++pixel)
    for (const SampleSequence sequence : {SampleSequence::random, SampleSequence::sobol}) {
      double sum = 0;
      for (uint32_t s = 0; s < 256; ++s) {
        const glm::vec2 u = Sampler(sequence, 5, pixel, 0, s).two(0);
        sum += double{u.x} * u.y / 256;
      }
      squared[static_cast<int>(sequence)] += (sum - 0.25) * (sum - 0.25) / 100;
    }
  EXPECT_NEAR(std::sqrt(squared[0]), 0.0138, 0.004);
  EXPECT_LT(std::sqrt(squared[1]), 0.0138 / 10);
}

}  // namespace
}  // namespace render
