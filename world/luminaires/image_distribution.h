/// Cells of a picture, drawn as often as they weigh: the importance sampling of skies and slides.
#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec2.hpp>

namespace world {

/// Weights are finite and >= 0, rows from the top. Sums are kept in double, so that a cell's share is right to 1e-12 of
/// itself beside a sun 10^9 times as bright.
class ImageDistribution {
 public:
  struct Cell {
    int column = 0, row = 0;
    glm::dvec2 within{0};    // what is left of u, in [0, 1): across and down the cell
    double probability = 0;  // > 0
  };

  ImageDistribution() = default;
  ImageDistribution(int width, int height, const std::vector<float>& weights);
  bool empty() const { return !(total_ > 0); }  // nothing weighs anything
  /// u.x chooses along the row, u.y the row, so that neighbours stay neighbours. Not for an empty one.
  Cell sample(glm::dvec2 u) const;
  double probability(int column, int row) const;
  const std::vector<double>& row_sums() const { return rows_; }        // up to and with each row
  const std::vector<double>& column_sums() const { return columns_; }  // within each row, up to and with each column

 private:
  int width_ = 0, height_ = 0;
  double total_ = 0;
  std::vector<double> rows_, columns_;  // sums up to and with each row; within each row up to and with each column
};

}  // namespace world
