/// Pearson's chi-squared test: do samples follow the density that they claim?
///
///   const auto seen = world::chi_squared_of_directions(sample, density, {.samples = 1000000, .seed = 1});
///   EXPECT_GT(seen.p, world::sidak_level(0.01, tests)) << seen.text();
///
/// Expected counts are integrals of the density over each bin, by nested Gauss rules split until they agree. Bins that
/// expect less than 5 are pooled, as the statistic's distribution is only approximate there; samples that are refused
/// (absorbed, below the horizon) are one more bin, of what the density leaves of 1. So a density that doesn't integrate
/// to what the sampler draws fails too.
///
/// With T tests, each at sidak_level(alpha, T), the chance that a right sampler fails any is alpha; seeds are fixed, so
/// that a test that passed goes on passing.
///
/// source  Matt Pharr, Wenzel Jakob, Greg Humphreys. Physically Based Rendering, 4th edition. 2023, section 2.3 (its
///         bsdfs_test.cpp has bins and correction like these); Zbynek Sidak. Rectangular Confidence Regions. 1967
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "world/base/random.h"

namespace world {

struct ChiSquared {
  double p = 0;  // of a statistic this large or larger, were the density right
  double statistic = 0;
  int degrees = 0;     // of freedom
  double refused = 0;  // of the samples, the share that gave nothing

  std::string text() const {
    char line[128];
    snprintf(line, sizeof line, "chi^2 = %.1f with %d degrees of freedom, p = %.3g; %.1f %% refused", statistic,
             degrees, p, 100 * refused);
    return line;
  }
};

/// Level of each of `tests` so that all together have the level alpha.
inline double sidak_level(double alpha, int tests) { return 1 - std::pow(1 - alpha, 1.0 / tests); }

/// The upper incomplete gamma function over gamma(a), a > 0, x >= 0: by its series below a + 1, else by Lentz's
/// continued fraction. error 1e-12 relative, for a up to 1e4. source Press et al. Numerical Recipes, section 6.2
inline double upper_gamma_ratio(double a, double x) {
  if (!(x > 0)) return 1;
  const double scale = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 100000 && term > sum * 1e-16; ++n) sum += term *= x / (a + n);
    return 1 - scale * sum;
  }
  const double tiny = 1e-300;
  double b = x + 1 - a, c = 1 / tiny, d = 1 / b, h = d;
  for (int n = 1; n < 100000; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = an * d + b;
    d = 1 / (std::abs(d) < tiny ? tiny : d);
    c = b + an / c;
    if (std::abs(c) < tiny) c = tiny;
    h *= d * c;
    if (std::abs(d * c - 1) < 1e-15) break;
  }
  return scale * h;
}

/// Counts, and what was expected of each bin; both add up to the number of samples.
inline ChiSquared chi_squared(std::span<const double> observed, std::span<const double> expected) {
  ChiSquared result;
  double pooled_observed = 0, pooled_expected = 0;
  int terms = 0;
  const auto add = [&](double o, double e) {
    result.statistic += (o - e) * (o - e) / e;
    ++terms;
  };
  for (size_t i = 0; i < observed.size(); ++i) {
    if (expected[i] >= 5) {
      add(observed[i], expected[i]);
    } else {
      pooled_observed += observed[i], pooled_expected += expected[i];
    }
  }
  // A sample where next to nothing is expected is wrong; but the integrals are only so good.
  if (pooled_expected >= 5 || pooled_observed > 5) add(pooled_observed, std::max(pooled_expected, 1.0));
  result.degrees = std::max(terms - 1, 1);
  result.p = upper_gamma_ratio(0.5 * result.degrees, 0.5 * result.statistic);
  return result;
}

/// The integral of f(x, y) over a rectangle, by 4 x 4 Gauss points, split in four where that changes it by more than
/// `tolerance`, at most `depth` times.
template <class F>
double integral_over(const F& f, double x0, double x1, double y0, double y1, double tolerance, int depth) {
  static constexpr double kAt[4] = {-0.861136311594053, -0.339981043584856, 0.339981043584856, 0.861136311594053};
  static constexpr double kWeight[4] = {0.347854845137454, 0.652145154862546, 0.652145154862546, 0.347854845137454};
  const auto gauss = [&](double a, double b, double c, double d) {
    double sum = 0;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        sum += kWeight[i] * kWeight[j] * f(0.5 * (a + b + (b - a) * kAt[i]), 0.5 * (c + d + (d - c) * kAt[j]));
    return sum * 0.25 * (b - a) * (d - c);
  };
  const double xm = 0.5 * (x0 + x1), ym = 0.5 * (y0 + y1);
  const double whole = gauss(x0, x1, y0, y1),
               parts[] = {gauss(x0, xm, y0, ym), gauss(xm, x1, y0, ym), gauss(x0, xm, ym, y1), gauss(xm, x1, ym, y1)};
  const double sum = parts[0] + parts[1] + parts[2] + parts[3];
  if (depth == 0 || std::abs(sum - whole) <= tolerance) return sum;
  return integral_over(f, x0, xm, y0, ym, tolerance / 2, depth - 1) +
         integral_over(f, xm, x1, y0, ym, tolerance / 2, depth - 1) +
         integral_over(f, x0, xm, ym, y1, tolerance / 2, depth - 1) +
         integral_over(f, xm, x1, ym, y1, tolerance / 2, depth - 1);
}

struct ChiSquaredSettings {
  int samples = 1000000;
  uint64_t seed = 1;
  int rows = 16, columns = 32;
};

/// Over the unit square. sample(u) with u in [0, 1)^3 gives std::optional of a point (x, y as .x and .y);
/// density(x, y) per unit area, >= 0, with an integral of at most 1.
template <class Sample, class Density>
ChiSquared chi_squared_of_square(const Sample& sample, const Density& density, const ChiSquaredSettings& settings) {
  const int rows = settings.rows, columns = settings.columns;
  std::vector<double> observed(static_cast<size_t>(rows * columns) + 1, 0), expected(observed.size(), 0);
  for (int i = 0; i < settings.samples; ++i) {
    const auto u = [&](uint64_t stream) { return uniform01(random_bits(settings.seed, i, 0, 0, 0, stream)); };
    const auto point = sample(glm::vec3(u(0), u(1), u(2)));
    const auto bin = [](double x, int bins) { return std::clamp(static_cast<int>(x * bins), 0, bins - 1); };
    ++observed[point ? static_cast<size_t>(bin(point->x, rows) * columns + bin(point->y, columns))
                     : observed.size() - 1];
  }
  double all = 0;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const double share = integral_over(density, r / double(rows), (r + 1) / double(rows), c / double(columns),
                                         (c + 1) / double(columns), 1e-7, 8);
      expected[static_cast<size_t>(r * columns + c)] = share * settings.samples;
      all += share;
    }
  expected.back() = std::max(0.0, 1 - all) * settings.samples;
  ChiSquared result = chi_squared(observed, expected);
  result.refused = observed.back() / settings.samples;
  return result;
}

/// Over the sphere, in bins of equal solid angle about `axis` (of length 1). sample(u) gives std::optional of a
/// direction; density(direction) per steradian.
template <class Sample, class Density>
ChiSquared chi_squared_of_directions(const Sample& sample, const Density& density, const ChiSquaredSettings& settings,
                                     glm::dvec3 axis = glm::dvec3(0, 0, 1)) {
  constexpr double kTurn = 6.283185307179586;
  const glm::dvec3 other = std::abs(axis.z) < 0.7 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
  const glm::dvec3 x_axis = normalize(cross(other, axis)), y_axis = cross(axis, x_axis);
  const auto to_square = [&](const glm::vec3& u) -> std::optional<glm::dvec2> {
    const auto direction = sample(u);
    if (!direction) return std::nullopt;
    const glm::dvec3 d(*direction);
    const double turn = std::atan2(dot(d, y_axis), dot(d, x_axis)) / kTurn;
    return glm::dvec2(0.5 + 0.5 * dot(d, axis), turn < 0 ? turn + 1 : turn);
  };
  const auto square_density = [&](double x, double y) {
    const double cosine = 2 * x - 1, sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    const glm::dvec3 d = cosine * axis + sine * (std::cos(kTurn * y) * x_axis + std::sin(kTurn * y) * y_axis);
    return 2 * kTurn * static_cast<double>(density(glm::vec3(d)));
  };
  return chi_squared_of_square(to_square, square_density, settings);
}

}  // namespace world
