#include "world/luminaires/image_distribution.h"

#include <algorithm>

namespace world {

namespace {

/// The first entry of the rising sums that exceeds u times the last, and where between it and its predecessor.
struct Step {
  ptrdiff_t index;
  double within, weight;
};
Step step_of(const double* sums, ptrdiff_t count, double u) {
  const double target = u * sums[count - 1];
  ptrdiff_t index = std::upper_bound(sums, sums + count, target) - sums;
  // u * total may round up to total: then the last entry that weighs something.
  if (index == count) index = std::lower_bound(sums, sums + count, sums[count - 1]) - sums;
  const double before = index ? sums[index - 1] : 0, weight = sums[index] - before;
  return {index, std::clamp((target - before) / weight, 0.0, 0x1.fffffffffffffp-1), weight};
}

}  // namespace

ImageDistribution::ImageDistribution(int width, int height, const std::vector<float>& weights)
    : width_(width), height_(height), rows_(static_cast<size_t>(height)), columns_(weights.size()) {
  for (size_t y = 0, i = 0; y < rows_.size(); ++y) {
    double sum = 0;
    for (int x = 0; x < width; ++x, ++i) columns_[i] = sum += weights[i];
    rows_[y] = total_ += sum;
  }
}

ImageDistribution::Cell ImageDistribution::sample(glm::dvec2 u) const {
  const Step row = step_of(rows_.data(), height_, u.y);
  const Step column = step_of(columns_.data() + row.index * width_, width_, u.x);
  return {
      static_cast<int>(column.index), static_cast<int>(row.index), {column.within, row.within}, column.weight / total_};
}

double ImageDistribution::probability(int column, int row) const {
  const double* sums = columns_.data() + ptrdiff_t{row} * width_;
  return (sums[column] - (column ? sums[column - 1] : 0)) / total_;
}

}  // namespace world
