/// Interval arithmetic in double: bounds of a formula over a box, found by writing the formula once for numbers and
/// for intervals.
///
/// error  outward: each result holds every value that the real operation takes; the ends are moved out by one part in
///        2^52 after each operation, so rounding can't lose any (tests/world/numbers/interval_test.cpp)
/// cost   some 1.5 to 4 times the formula in double
/// source Ramon Moore. Interval Analysis. 1966
#pragma once

#include <algorithm>
#include <cmath>

namespace world {

struct Interval {
  double lo = 0, hi = 0;  // lo <= hi

  constexpr Interval() = default;
  constexpr Interval(double value) : lo(value), hi(value) {}
  constexpr Interval(double low, double high) : lo(low), hi(high) {}
  bool contains(double v) const { return lo <= v && v <= hi; }

  /// Moved out by more than the rounding of one operation. The constant covers results below the normal numbers.
  static Interval widened(double low, double high) {
    constexpr double kUlp = 0x1p-52, kTiny = 1e-300;
    return {low - (std::abs(low) * kUlp + kTiny), high + (std::abs(high) * kUlp + kTiny)};
  }
};

inline Interval operator-(Interval a) { return {-a.hi, -a.lo}; }
inline Interval operator+(Interval a, Interval b) { return Interval::widened(a.lo + b.lo, a.hi + b.hi); }
inline Interval operator-(Interval a, Interval b) { return Interval::widened(a.lo - b.hi, a.hi - b.lo); }
inline Interval operator*(Interval a, Interval b) {
  const double p = a.lo * b.lo, q = a.lo * b.hi, r = a.hi * b.lo, s = a.hi * b.hi;
  return Interval::widened(std::min(std::min(p, q), std::min(r, s)), std::max(std::max(p, q), std::max(r, s)));
}

// The same names for numbers, so that one template serves both.
inline double square(double a) { return a * a; }
inline double square_root(double a) { return std::sqrt(a); }
inline double absolute(double a) { return std::abs(a); }
inline double maximum(double a, double b) { return std::max(a, b); }

/// Tighter than a * a: the two factors are the same number.
inline Interval square(Interval a) {
  const double p = a.lo * a.lo, q = a.hi * a.hi;
  const Interval outer = Interval::widened(std::min(p, q), std::max(p, q));
  return a.contains(0) ? Interval(0, outer.hi) : Interval(std::max(0.0, outer.lo), outer.hi);
}
/// Of the part that is not negative.
inline Interval square_root(Interval a) {
  const Interval root = Interval::widened(std::sqrt(std::max(0.0, a.lo)), std::sqrt(std::max(0.0, a.hi)));
  return {std::max(0.0, root.lo), root.hi};
}
inline Interval absolute(Interval a) {
  const double p = std::abs(a.lo), q = std::abs(a.hi);
  return {a.contains(0) ? 0 : std::min(p, q), std::max(p, q)};
}
inline Interval maximum(Interval a, Interval b) { return {std::max(a.lo, b.lo), std::max(a.hi, b.hi)}; }

/// exp over the interval; the library's exp is taken to be right within 2 ulp.
inline Interval exponential(Interval a) {
  const Interval inner = Interval::widened(std::exp(a.lo), std::exp(a.hi));
  const Interval outer = Interval::widened(inner.lo, inner.hi);
  return {std::max(0.0, outer.lo), outer.hi};
}
/// cos over the interval, in radians.
inline Interval cosine(Interval a) {
  constexpr double kPi = 3.14159265358979323846;
  // Peaks lie at even multiples of pi, troughs at odd ones. Near one, take it in: an end may be off by its rounding.
  const double slack = 1e-15 * (std::abs(a.lo) + std::abs(a.hi) + 1);
  const auto holds_multiple = [&](double first) {
    return std::floor((a.hi + slack - first) / (2 * kPi)) >= std::ceil((a.lo - slack - first) / (2 * kPi));
  };
  const double p = std::cos(a.lo), q = std::cos(a.hi);
  const Interval ends = Interval::widened(std::min(p, q) - 1e-15, std::max(p, q) + 1e-15);
  return {holds_multiple(kPi) ? -1.0 : std::max(-1.0, ends.lo), holds_multiple(0) ? 1.0 : std::min(1.0, ends.hi)};
}

}  // namespace world
