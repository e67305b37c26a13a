/// What repetitions say together: medians, spreads, orders drawn from a seed, fronts and slopes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace tools {

/// Quartiles by linear interpolation between the sorted samples (type 7 of Hyndman, Fan. Sample Quantiles in
/// Statistical Packages. 1996). All NaN where there is no sample, or where any sample is NaN.
struct Spread {
  double median = 0, q1 = 0, q3 = 0, minimum = 0, maximum = 0;
  int count = 0;
  double iqr() const { return q3 - q1; }
};
Spread spread_of(std::vector<double> samples);

/// 0 .. count-1 in an order that is a function of (seed, round): Fisher and Yates.
std::vector<size_t> shuffled_order(size_t count, uint64_t seed, uint64_t round);

/// True for each point that no other point beats: at most its error and at most its cost, and less in one of them.
/// Points that are not finite are never on the front; equal points share their place.
std::vector<bool> pareto_front(const std::vector<double>& errors, const std::vector<double>& costs);

/// Whether another point beats this one by more than `margin` (0.05 = 5 %) in error or cost without losing the other.
/// `spreads`: interquartile ranges of measured costs, which are medians; none where costs are counted. Another's cost
/// is then no more than this one's only where the inner halves of the two don't overlap.
bool dominated_beyond(const std::vector<double>& errors, const std::vector<double>& costs, size_t point, double margin,
                      const std::vector<double>& spreads = {});

/// Least-squares slope of log y over log x, of the pairs where both are positive and finite; none below two such pairs
/// with different x.
std::optional<double> log_log_slope(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace tools
