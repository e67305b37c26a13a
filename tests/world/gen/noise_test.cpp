#include "world/gen/noise.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/random.h"
#include "world/base/simd.h"

namespace world {
namespace {

/// Places from the origin to the ends of 32 bits: k * 2^j, the Far Lands of a 32-bit float world, and their mirrors.
std::vector<int64_t> hard_coordinates() {
  std::vector<int64_t> places;
  for (int j = 0; j <= 30; ++j)
    for (const int64_t k : {-1, 1}) places.push_back(k << j);
  for (int64_t p = 12550820; p <= 12550824; ++p) places.push_back(p), places.push_back(-p);
  places.push_back(INT32_MAX - 70);
  places.push_back(INT32_MIN);
  return places;
}

TEST(HardCaseN20, NoiseKeepsItsRangeAndGradientBoundAtHugeCoordinates) {
  constexpr int kRow = 70;
  std::vector<int32_t> row(kRow);
  for (const int cell_log2 : {3, 6, 9})
    for (const int64_t x : hard_coordinates())
      for (const int64_t z : hard_coordinates()) {
        const int32_t bound = 9 * kNoiseOne >> cell_log2;
        noise2_row(7, cell_log2, x, z, 1, kRow, row.data());
        for (int i = 0; i < kRow; ++i) {
          ASSERT_LE(std::abs(row[i]), kNoiseOne * 105 / 100) << x << ' ' << z + i;
          ASSERT_LE(std::abs(row[i] - row[i > 0 ? i - 1 : 0]), bound) << x << ' ' << z + i;
        }
        noise3_row(7, cell_log2, cell_log2, x, x + z, z, 1, kRow, row.data());
        for (int i = 0; i < kRow; ++i) {
          ASSERT_LE(std::abs(row[i]), kNoiseOne * 105 / 100) << x << ' ' << z + i;
          ASSERT_LE(std::abs(row[i] - row[i > 0 ? i - 1 : 0]), bound) << x << ' ' << z + i;
        }
      }
}

TEST(HardCaseN20, NoiseIsAsSmoothAcrossXAndYAsAlongItsRow) {
  for (const int64_t x : hard_coordinates())
    for (int64_t d = -9; d < 9; ++d) {
      const int32_t bound = 9 * kNoiseOne >> 6;
      ASSERT_LE(std::abs(noise2(3, 6, x + d, 5) - noise2(3, 6, x + d + 1, 5)), bound);
      ASSERT_LE(std::abs(noise3(3, 6, 6, x + d, 9, 5) - noise3(3, 6, 6, x + d + 1, 9, 5)), bound);
      ASSERT_LE(std::abs(noise3(3, 6, 6, 9, x + d, 5) - noise3(3, 6, 6, 9, x + d + 1, 5)), bound);
    }
}

TEST(Noise, APointIsTheSameAloneAndInAnyRow) {
  std::vector<int32_t> fine(200), coarse(50);
  noise3_row(5, 5, 4, 17, -3, -100, 1, 200, fine.data());
  noise3_row(5, 5, 4, 17, -3, -100, 4, 50, coarse.data());
  for (int i = 0; i < 200; ++i) EXPECT_EQ(fine[i], noise3(5, 5, 4, 17, -3, -100 + i));
  for (int i = 0; i < 50; ++i) EXPECT_EQ(coarse[i], fine[4 * i]);
  noise2_row(5, 5, 17, -100, 1, 200, fine.data());
  noise2_row(5, 5, 17, -100, 4, 50, coarse.data());
  for (int i = 0; i < 200; ++i) EXPECT_EQ(fine[i], noise2(5, 5, 17, -100 + i));
  for (int i = 0; i < 50; ++i) EXPECT_EQ(coarse[i], fine[4 * i]);
}

TEST(Noise, IsZeroOnItsLatticeAndBalancedAroundZero) {
  int64_t sum = 0, squares = 0;
  int32_t low = 0, high = 0;
  for (int x = 0; x < 512; ++x)
    for (int z = 0; z < 512; ++z) {
      const int32_t n = noise2(11, 4, x, z);
      EXPECT_TRUE(n == 0 || x % 16 != 0 || z % 16 != 0);
      sum += n, squares += int64_t{n} * n, low = std::min(low, n), high = std::max(high, n);
    }
  const double mean = static_cast<double>(sum) / (512 * 512), variance = static_cast<double>(squares) / (512 * 512);
  EXPECT_NEAR(mean, 0, 0.03 * kNoiseOne);  // 1024 cells: three standard errors of a mean of +-0.33
  EXPECT_GT(variance, 0.05 * kNoiseOne * kNoiseOne);
  EXPECT_LT(low, -0.7 * kNoiseOne);
  EXPECT_GT(high, 0.7 * kNoiseOne);
}

TEST(Noise, OtherSeedsGiveOtherNoise) {
  int same = 0;
  for (int i = 0; i < 1000; ++i) same += noise2(1, 4, 7, 3 + i * 16 + 5) == noise2(2, 4, 7, 3 + i * 16 + 5);
  EXPECT_LT(same, 100);
}

/// The values of 4096 points hashed: any other compiler, machine or SIMD level must give these bits.
TEST(Noise, HasTheSameBitsOnEveryMachineAndSimdLevel) {
  for (const SimdLevel& level : simd_levels()) {
    const SimdChoice choice(level);
    uint64_t h = 0;
    std::vector<int32_t> flat(64), deep(64);
    for (int x = 0; x < 64; ++x) {
      noise2_row(1, 5, x * 7, -300, 5, 64, flat.data());
      noise3_row(1, 5, 4, x * 7, x - 9, -300, 5, 64, deep.data());
      for (int z = 0; z < 64; ++z)
        h = hash_combine(h, static_cast<uint64_t>(flat[z]) ^ static_cast<uint64_t>(deep[z]) << 20);
    }
    EXPECT_EQ(h, 0x53d876d2af0f4ca1ull) << level.name << ' ' << std::hex << h;
  }
}

TEST(Noise, RowsOfAnyLengthStepAndCellEndWhereTheyShould) {
  std::vector<int32_t> row(40);
  for (const int cell_log2 : {1, 3, 12, 13, 24})
    for (const int step : {1, 3, 4, 100})
      for (int count = 0; count < 36; ++count) {
        std::fill(row.begin(), row.end(), 12345678);
        noise2_row(9, cell_log2, 77, -50, step, count, row.data());
        for (int i = 0; i < count; ++i) ASSERT_EQ(row[i], noise2(9, cell_log2, 77, -50 + int64_t{i} * step));
        ASSERT_EQ(row[count], 12345678);
      }
}

}  // namespace
}  // namespace world
