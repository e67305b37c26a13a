#include "world/base/random.h"

#include <bit>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

namespace world {
namespace {

TEST(Random, Mix64IsSplitMix64s) {
  // The published first outputs of SplitMix64 for the seed 1234567.
  const uint64_t expected[] = {6457827717110365317u, 3203168211198807973u, 9817491932198370423u, 4593380528125082431u,
                               16408922859458223821u};
  for (uint64_t i = 0; i < 5; ++i) EXPECT_EQ(mix64(1234567 + (i + 1) * 0x9e3779b97f4a7c15ull), expected[i]);
}

/// Worlds depend on these: a change makes every seed another world.
TEST(Random, TheValuesNeverChange) {
  EXPECT_EQ(random_bits(0, 0, 0, 0), 15844657912287365683u);
  EXPECT_EQ(random_bits(42, -1, 2, -3), 4627914409642724000u);
  EXPECT_EQ(random_bits(42, -1, 2, -3, 7, 1), 9968057396696704227u);
  EXPECT_EQ(random_bits(1, 1073737727, -1073737728, 0), 9825758029741046274u);
}

TEST(Random, UniformNeverReachesOne) {
  EXPECT_EQ(uniform01(~0ull), 1.0f - 0x1p-24f);
  EXPECT_LT(uniform01(~0ull), 1.0f);
  EXPECT_EQ(uniform01_double(~0ull), 1.0 - 0x1p-53);
  EXPECT_LT(uniform01_double(~0ull), 1.0);
  EXPECT_EQ(uniform01(0), 0.0f);
  EXPECT_EQ(uniform01((1ull << 40) - 1), 0.0f);
  EXPECT_EQ(uniform01(1ull << 40), 0x1p-24f);
}

TEST(Random, EachArgumentMatters) {
  std::set<uint64_t> seen;
  seen.insert(random_bits(1, 2, 3, 4, 5, 6));
  seen.insert(random_bits(2, 2, 3, 4, 5, 6));
  seen.insert(random_bits(1, 3, 3, 4, 5, 6));
  seen.insert(random_bits(1, 2, 4, 4, 5, 6));
  seen.insert(random_bits(1, 2, 3, 5, 5, 6));
  seen.insert(random_bits(1, 2, 3, 4, 6, 6));
  seen.insert(random_bits(1, 2, 3, 4, 5, 7));
  seen.insert(random_bits(1, 3, 2, 4, 5, 6));  // order too
  seen.insert(random_bits(1, -2, 3, 4, 5, 6));
  EXPECT_EQ(seen.size(), 9u);
}

TEST(Random, NoSeedIsAnotherSeedsWorldMoved) {
  std::set<uint64_t> seen;
  for (uint64_t seed = 0; seed < 100; ++seed)
    for (int x = -100; x < 100; ++x) seen.insert(random_bits(seed, x, 0, 0));
  EXPECT_EQ(seen.size(), 20'000u);
  EXPECT_NE(hash_combine(1, 2), hash_combine(2, 1));
}

TEST(Random, FlippingOneInputBitFlipsEachOutputBitHalfOfTheTime) {
  const int trials = 4096;
  for (int bit : {0, 1, 7, 31, 40, 63}) {
    int flips[64] = {};
    for (int i = 0; i < trials; ++i) {
      const uint64_t difference =
          random_bits(5, i, 0, 0) ^ random_bits(5, static_cast<int64_t>(static_cast<uint64_t>(i) ^ 1ull << bit), 0, 0);
      for (int b = 0; b < 64; ++b) flips[b] += difference >> b & 1;
    }
    // 4096 fair coins: a standard deviation is 32; 6 of them for 384 counts.
    for (int b = 0; b < 64; ++b)
      ASSERT_NEAR(flips[b], trials / 2, 6 * 32) << "input bit " << bit << ", output bit " << b;
  }
}

TEST(Random, NeighbouringVoxelsAreUniformAndUncorrelated) {
  const int n = 100;
  double sum = 0, sum_of_squares = 0, sum_of_neighbours = 0;
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < n; ++y)
      for (int z = 0; z < n; ++z) {
        const double u = uniform01_double(random_bits(8, x, y, z)) - 0.5,
                     v = uniform01_double(random_bits(8, x + 1, y, z)) - 0.5;
        sum += u;
        sum_of_squares += u * u;
        sum_of_neighbours += u * v;
      }
  const double count = n * n * n;  // standard deviations: 2.9e-4, 7.5e-5, 8.3e-5
  EXPECT_NEAR(sum / count, 0, 6 * 2.9e-4);
  EXPECT_NEAR(sum_of_squares / count, 1 / 12.0, 6 * 7.5e-5);
  EXPECT_NEAR(sum_of_neighbours / count, 0, 6 * 8.3e-5);
}

}  // namespace
}  // namespace world
