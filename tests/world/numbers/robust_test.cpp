#include "world/numbers/robust.h"

#include <bit>
#include <cfloat>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace world {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// |got - expected| in units of the last place of the expected float.
double ulps(float got, long double expected) {
  const float near = static_cast<float>(expected);
  const double ulp = double{std::nextafter(std::abs(near), kInfinity)} - std::abs(near);
  return static_cast<double>(std::abs(got - expected)) / ulp;
}
double ulps(double got, long double expected) {
  const double near = static_cast<double>(expected);
  const double ulp = std::nextafter(std::abs(near), HUGE_VAL) - std::abs(near);
  return static_cast<double>(std::abs(got - expected) / ulp);
}

// --- sums -------------------------------------------------------------------------------------------------------

TEST(HardCaseN9, FilmSumOfOnesIsExactWhereTheNaiveSumStops) {
  const int n = 1 << 25;
  float naive = 0;
  KahanSum<float> kahan;
  PairwiseSum<float> pairwise;
  for (int i = 0; i < n; ++i) {
    naive += 1.0f;
    kahan.add(1.0f);
    pairwise.add(1.0f);
  }
  EXPECT_EQ(naive, 16777216.0f);
  EXPECT_EQ(kahan.value(), 33554432.0f);
  EXPECT_EQ(pairwise.value(), 33554432.0f);
}

float film_sample(int i) {
  const uint64_t bits = random_bits(10, i, 0, 0);
  return uniform01(bits) * (bits % 1000 == 0 ? 1000.0f : 1.0f);  // 0.1 % fireflies
}

TEST(HardCaseN10, FilmMeanOfTenMillionSamplesIsRightTo1e6) {
  const int n = 10'000'000;
  double exact = 0;  // 53 bits: its own error is below 1e-9
  float naive = 0;
  KahanSum<float> kahan;
  PairwiseSum<float> pairwise;
  for (int i = 0; i < n; ++i) {
    const float x = film_sample(i);
    exact += x;
    naive += x;
    kahan.add(x);
    pairwise.add(x);
  }
  EXPECT_LE(std::abs(kahan.value() / exact - 1), 1e-6);
  EXPECT_LE(std::abs(pairwise.value() / exact - 1), 1e-6);
  EXPECT_GT(std::abs(naive / exact - 1), 1e-6);  // what the two are for
}

/// Each step as written, kept from the optimiser by volatile: what -O0 computes.
float kahan_step_by_step(int n) {
  volatile float sum = 0, lost = 0;
  for (int i = 0; i < n; ++i) {
    const volatile float x = film_sample(i);
    const volatile float next = sum + x;
    if (std::abs(float{sum}) >= std::abs(float{x})) {
      const volatile float difference = sum - next;
      const volatile float correction = difference + x;
      lost = lost + correction;
    } else {
      const volatile float difference = x - next;
      const volatile float correction = difference + sum;
      lost = lost + correction;
    }
    sum = next;
  }
  return sum + lost;
}

TEST(HardCaseN11, KahanSumHasTheBitsOfTheUnoptimisedOne) {
  KahanSum<float> kahan;
  for (int i = 0; i < 300'000; ++i) kahan.add(film_sample(i));
  EXPECT_EQ(std::bit_cast<uint32_t>(kahan.value()), std::bit_cast<uint32_t>(kahan_step_by_step(300'000)));
  EXPECT_NE(kahan.lost, 0.0f);
}

TEST(KahanSum, KeepsSmallTermsBesideALargeOneThatGoesAway) {
  KahanSum<double> sum;
  for (double x : {1.0, 1e100, 1.0, -1e100}) sum.add(x);
  EXPECT_EQ(sum.value(), 2.0);  // Kahan's first version gives 0
}

TEST(PairwiseSum, AnyCountSumsEveryTermOnce) {
  for (int n : {0, 1, 2, 3, 7, 8, 1000, 1025}) {
    PairwiseSum<double> sum;
    for (int i = 1; i <= n; ++i) sum.add(i);
    EXPECT_EQ(sum.value(), n * (n + 1) / 2);
    EXPECT_EQ(sum.count(), static_cast<uint64_t>(n));
  }
}

// --- cancellation -----------------------------------------------------------------------------------------------

/// Not inlined and given instructions for it: here a compiler would fuse, were it allowed to.
#if defined(__x86_64__)
__attribute__((noinline, target("fma"))) float plain_difference(float a, float b, float c, float d) {
  return a * b - c * d;
}
bool may_fuse() { return __builtin_cpu_supports("fma"); }
#else
__attribute__((noinline)) float plain_difference(float a, float b, float c, float d) { return a * b - c * d; }
bool may_fuse() { return true; }
#endif

TEST(HardCaseN12, EqualProductsDifferByExactlyZero) {
  int fused_nonzero = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    const float x = 1 + uniform01(random_bits(12, i, 0, 0));
    ASSERT_EQ(difference_of_products(x, x, x, x), 0.0f) << x;
    ASSERT_TRUE(!may_fuse() || plain_difference(x, x, x, x) == 0.0f) << "the compiler contracted a*b - c*d";
    fused_nonzero += std::fma(x, x, -(x * x)) != 0;
  }
  EXPECT_GT(fused_nonzero, 900'000);  // contracted, nearly each of them would be off
}

TEST(HardCaseN12, DifferenceOfProductsIsWithinOneAndAHalfUlp) {
  double worst_float = 0, worst_double = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    const auto draw = [&](int k) { return 1 + uniform01_double(random_bits(13, i, k, 0)); };
    const float a = static_cast<float>(draw(0)), b = static_cast<float>(draw(1)), c = static_cast<float>(draw(2));
    const float d = static_cast<float>(static_cast<double>(a) * b / c);  // nearly cancels
    const long double exact = static_cast<long double>(a) * b - static_cast<long double>(c) * d;
    if (exact != 0) worst_float = std::max(worst_float, ulps(difference_of_products(a, b, c, d), exact));
    // Doubles with 32 bits, whose products a long double holds exactly.
    const double p = double{a} + 0x1p-31, q = b, r = c, s = d;
    const long double exact_double = static_cast<long double>(p) * q - static_cast<long double>(r) * s;
    if (exact_double != 0)
      worst_double = std::max(worst_double, ulps(difference_of_products(p, q, r, s), exact_double));
  }
  EXPECT_LE(worst_float, 1.0);
  EXPECT_LE(worst_double, 1.5);
  EXPECT_EQ(difference_of_products(0x1.0000001p0, 0x1.0000001p0, 1.0, 0x1.0000002p0), 0x1p-56);  // plain: 0
}

TEST(HardCaseN13, OneMinusExpKeepsItsDigitsForSmallDepths) {
  for (double x : {1e-4, 1e-6, 3e-8, 1e-9, 1e-30, 0.5, 3.0, 80.0}) {
    const float depth = static_cast<float>(x);
    EXPECT_LE(ulps(one_minus_exp(depth), -std::expm1(-static_cast<long double>(depth))), 4.0) << x;
    EXPECT_LE(ulps(one_minus_exp(x), -std::expm1(-static_cast<long double>(x))), 4.0) << x;
  }
  EXPECT_EQ(1 - std::exp(-1e-9f), 0.0f);  // the plain formula
  EXPECT_GT(std::abs((1 - std::exp(-3e-8f)) / 3e-8f - 1), 0.9f);
}

TEST(HardCaseN14, ConeSolidAngleIsRightForSmallAngles) {
  for (double theta : {3.0, 1.0, 0.1, 0.01, 1e-3, 3e-4, 1e-4, 1e-8}) {
    const float angle = static_cast<float>(theta);
    // The series of 2 pi (1 - cos) in long double, where the angle is small; the formula itself else.
    const long double t = angle;
    const long double exact = t < 0.01L
                                  ? std::numbers::pi_v<long double> * t * t * (1 - t * t / 12 + t * t * t * t / 360)
                                  : 2 * std::numbers::pi_v<long double> * (1 - std::cos(t));
    EXPECT_LE(std::abs(cone_solid_angle(angle) / exact - 1), 2e-7L) << theta;
    EXPECT_LE(std::abs(cone_solid_angle(double{angle}) / exact - 1), 1e-15L) << theta;
  }
  EXPECT_EQ(1 - std::cos(1e-4f), 0.0f);  // the plain formula sees no lamp at all
  EXPECT_EQ(cone_solid_angle(0.0), 0.0);
}

// --- domains ----------------------------------------------------------------------------------------------------

template <class Vector>
void expect_unit(const Vector& v) {
  using T = typename Vector::value_type;
  const Vector n = safe_normalize(v);
  const long double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  const long double x = v.x / largest, y = v.y / largest, z = v.z / largest;
  const long double length = std::sqrt(x * x + y * y + z * z);
  const long double expected[3] = {x / length, y / length, z / length};
  long double square = 0;
  for (int i = 0; i < 3; ++i) {
    ASSERT_LE(ulps(n[i], expected[i]), sizeof(T) == 4 ? 1.0 : 4.0) << v.x << ' ' << v.y << ' ' << v.z;
    square += static_cast<long double>(n[i]) * n[i];
  }
  ASSERT_LE(std::abs(std::sqrt(square) - 1), 2 * std::numeric_limits<T>::epsilon()) << v.x << ' ' << v.y << ' ' << v.z;
}

TEST(HardCaseN15, NormalizeIsUnitWithinTwoUlpAtAnyLength) {
  const float tiny = std::numeric_limits<float>::denorm_min();
  for (const glm::vec3& v : {glm::vec3(1e-30f, 0, 0), glm::vec3(1e30f, 1e30f, 0), glm::vec3(FLT_MAX, -FLT_MAX, FLT_MAX),
                             glm::vec3(tiny, 0, 0), glm::vec3(tiny, -tiny, 3 * tiny), glm::vec3(1, 2, 3)})
    expect_unit(v);
  const double small = std::numeric_limits<double>::denorm_min();
  for (const glm::dvec3& v :
       {glm::dvec3(1e-300, 0, 0), glm::dvec3(1e300, 1e300, 0), glm::dvec3(DBL_MAX, -DBL_MAX, DBL_MAX),
        glm::dvec3(small, -small, 3 * small), glm::dvec3(1, 2, 3)})
    expect_unit(v);
  for (int i = 0; i < 100'000 && !testing::Test::HasFailure(); ++i) {
    const auto draw = [&](int k) { return uniform01_double(random_bits(15, i, k, 0)) - 0.5; };
    const glm::dvec3 v(draw(0), draw(1), draw(2));
    expect_unit(v);
    expect_unit(glm::vec3(v));
  }
}

TEST(HardCaseN15, NormalizeFallsBackAndNeverGivesNan) {
  const glm::vec3 fallback(0, 0, -1);
  for (const glm::vec3& v : {glm::vec3(0), glm::vec3(-0.0f), glm::vec3(kNan, 1, 0), glm::vec3(kInfinity, 0, 0),
                             glm::vec3(0, -kInfinity, kInfinity)}) {
    EXPECT_EQ(safe_normalize(v, fallback), fallback);
    EXPECT_EQ(safe_normalize(glm::dvec3(v), glm::dvec3(fallback)), glm::dvec3(fallback));
  }
}

TEST(HardCaseN16, FloatToIntIsDefinedForEveryNumber) {
  constexpr int32_t kMax = std::numeric_limits<int32_t>::max(), kMin = std::numeric_limits<int32_t>::min();
  EXPECT_EQ(saturating_int<int32_t>(3e9f), kMax);
  EXPECT_EQ(saturating_int<int32_t>(-3e9f), kMin);
  EXPECT_EQ(saturating_int<int32_t>(kNan), 0);
  EXPECT_EQ(saturating_int<int32_t>(kInfinity), kMax);
  EXPECT_EQ(saturating_int<int32_t>(-kInfinity), kMin);
  EXPECT_EQ(saturating_int<int32_t>(1e300), kMax);
  EXPECT_EQ(saturating_int<uint8_t>(-1.0), 0);
  EXPECT_EQ(saturating_int<uint8_t>(255.9), 255);
  EXPECT_EQ(saturating_int<uint8_t>(256.0), 255);
  for (double x : {3e9, -3e9, double{kNan}, double{kInfinity}, 1e300, 2147483648.0, -2147483649.0})
    EXPECT_FALSE(checked_int<int32_t>(x)) << x;
  EXPECT_EQ(checked_int<int32_t>(2147483647.9), kMax);
  EXPECT_EQ(checked_int<int32_t>(-2147483648.9), kMin);
  EXPECT_EQ(checked_int<int32_t>(-0.5), 0);
  // 64 bits: no double lies between the largest integer and 2^63.
  EXPECT_FALSE(checked_int<int64_t>(0x1p63));
  EXPECT_EQ(checked_int<int64_t>(-0x1p63), std::numeric_limits<int64_t>::min());
  EXPECT_FALSE(checked_int<int64_t>(std::nextafter(-0x1p63, -HUGE_VAL)));
  EXPECT_EQ(checked_int<int64_t>(std::nextafter(0x1p63, 0)), 9223372036854774784);
  EXPECT_FALSE(checked_int<uint64_t>(0x1p64));
  EXPECT_FALSE(checked_int<uint64_t>(-1.0));
  EXPECT_EQ(checked_int<uint64_t>(-0.9), 0u);
}

TEST(HardCaseN17, FloorGoesDownBelowZeroWhereACastGoesUp) {
  EXPECT_EQ(floor_to_int(-0.5), -1);
  EXPECT_EQ(floor_to_int(-1.0), -1);
  EXPECT_EQ(floor_to_int(-1e-30), -1);
  EXPECT_EQ(floor_to_int(-0.0), 0);
  EXPECT_EQ(floor_to_int(0.999), 0);
  EXPECT_EQ(floor_to_int(1e300), std::numeric_limits<int32_t>::max());
  EXPECT_EQ(floor_to_int(kNan), 0);
  EXPECT_EQ(ceil_to_int(-0.5), 0);
  EXPECT_EQ(ceil_to_int(1e-30), 1);
}

TEST(HardCaseN18, MinMaxAndClampNeverLetNanThrough) {
  EXPECT_EQ(min_number(kNan, 2.0f), 2.0f);
  EXPECT_EQ(min_number(2.0f, kNan), 2.0f);
  EXPECT_EQ(max_number(kNan, 2.0f), 2.0f);
  EXPECT_EQ(max_number(2.0f, kNan), 2.0f);
  EXPECT_EQ(min_number(-1.0f, 2.0f), -1.0f);
  EXPECT_EQ(max_number(-1.0f, 2.0f), 2.0f);
  EXPECT_EQ(clamp_unit_number(kNan), 0.0f);
  EXPECT_EQ(clamp_unit_number(kInfinity), 1.0f);
  EXPECT_EQ(clamp_unit_number(-kInfinity), 0.0f);
  EXPECT_EQ(clamp_number(kNan, 3.0f, 4.0f), 3.0f);
  EXPECT_TRUE(std::isnan(std::min(kNan, 2.0f)));  // why std::min won't do: it depends on the order
}

TEST(HardCaseN19, ArcsAndRootsJustOutsideTheirDomainAreDefined) {
  EXPECT_EQ(safe_acos(std::nextafter(1.0f, 2.0f)), 0.0f);
  EXPECT_EQ(safe_acos(std::nextafter(-1.0, -2.0)), std::acos(-1.0));
  EXPECT_EQ(safe_asin(std::nextafter(1.0, 2.0)), std::asin(1.0));
  EXPECT_EQ(safe_sqrt(-1e-9f), 0.0f);
  EXPECT_EQ(safe_sqrt(kNan), 0.0f);
  EXPECT_EQ(safe_sqrt(4.0), 2.0);
  EXPECT_FALSE(std::isnan(safe_acos(kNan)));
  EXPECT_FALSE(std::isnan(safe_asin(kNan)));
  EXPECT_EQ(safe_acos(0.5), std::acos(0.5));
}

}  // namespace
}  // namespace world
