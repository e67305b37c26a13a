/// Arithmetic that keeps its accuracy, and its sense, where the plain formula loses it: near zero, near cancellation,
/// outside the domain, and for NaN. Each function states its error; tests/world/numbers/robust_test.cpp proves it.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace world {

// --- NaN never spreads ------------------------------------------------------------------------------------------

/// The lesser; the other one where one is NaN, and NaN only where both are.
template <std::floating_point T>
constexpr T min_number(T a, T b) {
  return a != a ? b : b < a ? b : a;
}
template <std::floating_point T>
constexpr T max_number(T a, T b) {
  return a != a ? b : b > a ? b : a;
}
/// In [low, high]; `low` where x is NaN. low <= high.
template <std::floating_point T>
constexpr T clamp_number(T x, T low, T high) {
  return x > low ? (x < high ? x : high) : low;
}
/// In [0, 1]; 0 where x is NaN.
template <std::floating_point T>
constexpr T clamp_unit_number(T x) {
  return clamp_number(x, T{0}, T{1});
}

// --- to integers ------------------------------------------------------------------------------------------------

/// x without its fraction, or nothing where that is outside Int or x is NaN.
template <std::integral Int>
constexpr std::optional<Int> checked_int(double x) {
  // Int's bounds as doubles that are exact: the lower one is 0 or a power of two, so is one above the upper.
  constexpr double kLow = static_cast<double>(std::numeric_limits<Int>::min());
  constexpr double kEnd = 2.0 * static_cast<double>(std::numeric_limits<Int>::max() / 2 + 1);
  // Below kLow by less than one still truncates to it; where kLow - 1 rounds to kLow there is nothing in between.
  const bool above = kLow - 1.0 < kLow ? x > kLow - 1.0 : x >= kLow;
  if (!(above && x < kEnd)) return std::nullopt;
  return static_cast<Int>(x);
}
/// x without its fraction, clamped to Int; 0 where x is NaN.
template <std::integral Int>
constexpr Int saturating_int(double x) {
  if (const auto inside = checked_int<Int>(x)) return *inside;
  return x > 0 ? std::numeric_limits<Int>::max() : x < 0 ? std::numeric_limits<Int>::min() : Int{0};
}
/// The largest integer <= x, clamped to Int; 0 where x is NaN. (A cast rounds towards zero: -0.5 would land in voxel
/// 0.)
template <std::integral Int = int32_t>
inline Int floor_to_int(double x) {
  return saturating_int<Int>(std::floor(x));
}
template <std::integral Int = int32_t>
inline Int ceil_to_int(double x) {
  return saturating_int<Int>(std::ceil(x));
}

// --- cancellation -----------------------------------------------------------------------------------------------

/// a*b - c*d. error: at most 1 ulp of the result; exactly 0 where the products are equal.
/// float: both products are exact in double, so that the difference is rounded twice only.
inline float difference_of_products(float a, float b, float c, float d) {
  return static_cast<float>(static_cast<double>(a) * b - static_cast<double>(c) * d);
}
/// double: Kahan's algorithm; at most 1.5 ulp while no product overflows or underflows.
/// source: Claude-Pierre Jeannerod, Nicolas Louvet, Jean-Michel Muller. Further Analysis of Kahan's Algorithm for the
///         Accurate Computation of 2x2 Determinants. 2013
inline double difference_of_products(double a, double b, double c, double d) {
  const double cd = c * d;
  const double error = std::fma(-c, d, cd);  // what rounding took from c*d, exactly
  return std::fma(a, b, -cd) + error;
}

/// 1 - exp(-x): what a medium of optical depth x takes away. error: at most 4 ulp for any x, however small.
template <std::floating_point T>
inline T one_minus_exp(T x) {
  return -std::expm1(-x);
}

/// Solid angle, sr, of a cone whose half angle is `half_angle` radians, 0 <= half_angle <= pi.
/// error: relative 2e-7 (float), 1e-15 (double); 1 - cos would be wrong by 32 % at 3e-4.
inline double cone_solid_angle(double half_angle) {
  const double s = std::sin(0.5 * half_angle);
  return 4.0 * std::numbers::pi * s * s;
}
inline float cone_solid_angle(float half_angle) { return static_cast<float>(cone_solid_angle(double{half_angle})); }

// --- domains ----------------------------------------------------------------------------------------------------

/// The square root, or 0 where x < 0 or NaN.
template <std::floating_point T>
inline T safe_sqrt(T x) {
  return x > 0 ? std::sqrt(x) : T{0};
}
/// The arc of the nearest number in [-1, 1]. NaN counts as -1 in both.
template <std::floating_point T>
inline T safe_acos(T x) {
  return std::acos(clamp_number(x, T{-1}, T{1}));
}
template <std::floating_point T>
inline T safe_asin(T x) {
  return std::asin(clamp_number(x, T{-1}, T{1}));
}

/// v as a unit vector, for any length from the smallest denormal to the largest number; `fallback` where v is zero or
/// not finite. error: the length is 1 within 2 ulp; each component within 1 ulp (float) or 4 ulp (double).
inline glm::dvec3 safe_normalize(glm::dvec3 v, glm::dvec3 fallback = {0, 1, 0}) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0) || !std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) return fallback;
  // Scales by a power of two, which is exact, so that no square overflows or underflows in the sum.
  int power = 0;
  std::frexp(largest, &power);
  v = {std::ldexp(v.x, -power), std::ldexp(v.y, -power), std::ldexp(v.z, -power)};
  return v / std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
}
inline glm::vec3 safe_normalize(const glm::vec3& v, const glm::vec3& fallback = {0, 1, 0}) {
  // The squares of floats neither overflow nor underflow in double.
  const glm::dvec3 d(v);
  const double square = d.x * d.x + d.y * d.y + d.z * d.z;
  if (!(square > 0) || !std::isfinite(square)) return fallback;
  return glm::vec3(d / std::sqrt(square));
}

// --- long sums --------------------------------------------------------------------------------------------------

/// A running sum that carries what rounding took. error: relative 2u, plus n u^2 times the sum of magnitudes, for n
/// terms and unit roundoff u: for the sums of a film, as good as one rounding. Needs -ffp-contract=off and no
/// fast-math. source: Arnold Neumaier. Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen. 1974
template <std::floating_point T>
struct KahanSum {
  T sum = 0, lost = 0;
  constexpr void add(T x) {
    const T next = sum + x;
    const bool sum_is_larger = (sum < 0 ? -sum : sum) >= (x < 0 ? -x : x);
    lost += sum_is_larger ? (sum - next) + x : (x - next) + sum;
    sum = next;
  }
  constexpr T value() const { return sum + lost; }
};

/// Sums in a balanced tree as terms arrive. error: relative log2(n) u for terms of one sign; half of KahanSum's cost.
/// The result depends on the order of the terms only.
template <std::floating_point T>
class PairwiseSum {
 public:
  constexpr void add(T x) {
    // Like counting up in binary: a carry joins two sums of equally many terms.
    uint64_t n = count_++;
    int level = 0;
    for (; n & 1; n >>= 1) x = partial_[level++] + x;
    partial_[level] = x;
  }
  constexpr T value() const {
    T total = 0;
    uint64_t n = count_;
    for (int level = 0; n; n >>= 1, ++level)
      if (n & 1) total = partial_[level] + total;
    return total;
  }
  constexpr uint64_t count() const { return count_; }

 private:
  uint64_t count_ = 0;
  T partial_[64] = {};
};

}  // namespace world
