#include "world/sources/mesh/patches.h"

#include <algorithm>
#include <cmath>

namespace world {
namespace {

std::array<double, 4> bernstein(double t) {
  const double s = 1 - t;
  return {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
}

/// Bezier points of the segment of a uniform cubic B-spline with these four control points.
std::array<Vec3d, 4> bezier_from_bspline(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
  return {(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0};
}

}  // namespace

Vec3d patch_point(const BezierPatch& patch, double u, double v) {
  const auto bu = bernstein(u), bv = bernstein(v);
  Vec3d sum(0.0);
  for (size_t row = 0; row < 4; ++row) {
    Vec3d along(0.0);
    for (size_t column = 0; column < 4; ++column) along += bu[column] * patch[4 * row + column];
    sum += bv[row] * along;
  }
  return sum;
}

std::vector<BezierPatch> patches_from_bspline(const std::vector<Vec3d>& net, int rows, int columns, bool closed_rows,
                                              bool closed_columns) {
  const auto point = [&](int row, int column) -> const Vec3d& {
    return net[static_cast<size_t>((row % rows) * columns + column % columns)];
  };
  std::vector<BezierPatch> patches;
  const int last_row = closed_rows ? rows : rows - 3, last_column = closed_columns ? columns : columns - 3;
  for (int row = 0; row < last_row; ++row) {
    for (int column = 0; column < last_column; ++column) {
      // Along the columns first, then along the rows.
      std::array<std::array<Vec3d, 4>, 4> half;
      for (int r = 0; r < 4; ++r)
        half[static_cast<size_t>(r)] = bezier_from_bspline(point(row + r, column), point(row + r, column + 1),
                                                           point(row + r, column + 2), point(row + r, column + 3));
      BezierPatch patch;
      for (size_t c = 0; c < 4; ++c) {
        const auto of_column = bezier_from_bspline(half[0][c], half[1][c], half[2][c], half[3][c]);
        for (size_t r = 0; r < 4; ++r) patch[4 * r + c] = of_column[r];
      }
      patches.push_back(patch);
    }
  }
  return patches;
}

int divisions_for(const BezierPatch& patch, double error) {
  double uu = 0, uv = 0, vv = 0;
  const auto p = [&](size_t row, size_t column) -> const Vec3d& { return patch[4 * row + column]; };
  for (size_t i = 0; i < 4; ++i) {
    for (size_t k = 0; k < 2; ++k) {
      uu = std::max(uu, 6 * glm::length(p(i, k) - 2.0 * p(i, k + 1) + p(i, k + 2)));
      vv = std::max(vv, 6 * glm::length(p(k, i) - 2.0 * p(k + 1, i) + p(k + 2, i)));
    }
  }
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 3; ++column)
      uv = std::max(uv,
                    9 * glm::length(p(row, column) - p(row, column + 1) - p(row + 1, column) + p(row + 1, column + 1)));
  const double n = std::ceil(std::sqrt((uu + 2 * uv + vv) / (8 * error)));
  return static_cast<int>(std::clamp(n, 1.0, 4096.0));
}

TriangleMesh triangles_of(const std::vector<BezierPatch>& patches, int divisions) {
  TriangleMesh mesh;
  const uint32_t n = static_cast<uint32_t>(divisions), side = n + 1;
  for (const BezierPatch& patch : patches) {
    const uint32_t first = static_cast<uint32_t>(mesh.positions.size());
    for (uint32_t row = 0; row <= n; ++row)
      for (uint32_t column = 0; column <= n; ++column)
        mesh.positions.emplace_back(patch_point(patch, static_cast<double>(column) / n, static_cast<double>(row) / n));
    for (uint32_t row = 0; row < n; ++row) {
      for (uint32_t column = 0; column < n; ++column) {
        const uint32_t a = first + row * side + column, b = a + 1, c = a + side, d = c + 1;
        mesh.triangles.emplace_back(a, b, d);
        mesh.triangles.emplace_back(a, d, c);
      }
    }
  }
  return mesh;
}

}  // namespace world
