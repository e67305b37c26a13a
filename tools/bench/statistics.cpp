#include "tools/bench/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "world/base/random.h"

namespace tools {

Spread spread_of(std::vector<double> samples) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const int count = static_cast<int>(samples.size());
  if (samples.empty() || std::any_of(samples.begin(), samples.end(), [](double s) { return std::isnan(s); }))
    return {nan, nan, nan, nan, nan, count};
  std::sort(samples.begin(), samples.end());
  const auto quantile = [&](double p) {
    const double place = p * (count - 1);
    const size_t below = static_cast<size_t>(place), above = std::min<size_t>(below + 1, samples.size() - 1);
    if (samples[below] == samples[above]) return samples[below];  // also keeps infinities from becoming NaN
    return samples[below] + (place - static_cast<double>(below)) * (samples[above] - samples[below]);
  };
  return {quantile(0.5), quantile(0.25), quantile(0.75), samples.front(), samples.back(), count};
}

std::vector<size_t> shuffled_order(size_t count, uint64_t seed, uint64_t round) {
  std::vector<size_t> order(count);
  std::iota(order.begin(), order.end(), size_t{0});
  for (size_t i = count; i > 1; --i) {
    const uint64_t bits = world::random_bits(seed, static_cast<int64_t>(i), 0, 0, round);
    std::swap(order[i - 1], order[static_cast<size_t>(world::uniform01_double(bits) * static_cast<double>(i))]);
  }
  return order;
}

std::vector<bool> pareto_front(const std::vector<double>& errors, const std::vector<double>& costs) {
  std::vector<bool> front(errors.size(), false);
  for (size_t i = 0; i < errors.size(); ++i) {
    if (!std::isfinite(errors[i]) || !std::isfinite(costs[i])) continue;
    bool beaten = false;
    for (size_t j = 0; j < errors.size() && !beaten; ++j)
      beaten = errors[j] <= errors[i] && costs[j] <= costs[i] && (errors[j] < errors[i] || costs[j] < costs[i]);
    front[i] = !beaten;
  }
  return front;
}

bool dominated_beyond(const std::vector<double>& errors, const std::vector<double>& costs, size_t point, double margin,
                      const std::vector<double>& spreads) {
  const auto half = [&](size_t i) { return spreads.empty() ? 0.0 : spreads[i] / 2; };
  if (!std::isfinite(errors[point]) || !std::isfinite(costs[point])) return true;
  for (size_t j = 0; j < errors.size(); ++j) {
    if (j == point) continue;
    const bool no_worse = errors[j] <= errors[point] && costs[j] + half(j) <= costs[point] - half(point);
    const bool well_better = errors[j] < (1 - margin) * errors[point] || costs[j] < (1 - margin) * costs[point];
    if (no_worse && well_better) return true;
  }
  return false;
}

std::optional<double> log_log_slope(const std::vector<double>& x, const std::vector<double>& y) {
  double n = 0, sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0;
  for (size_t i = 0; i < x.size() && i < y.size(); ++i) {
    if (!(x[i] > 0) || !(y[i] > 0) || !std::isfinite(x[i]) || !std::isfinite(y[i])) continue;
    const double lx = std::log(x[i]), ly = std::log(y[i]);
    n += 1, sum_x += lx, sum_y += ly, sum_xx += lx * lx, sum_xy += lx * ly;
  }
  const double determinant = n * sum_xx - sum_x * sum_x;
  if (n < 2 || !(determinant > 1e-12 * n * sum_xx)) return std::nullopt;
  return (n * sum_xy - sum_x * sum_y) / determinant;
}

}  // namespace tools
