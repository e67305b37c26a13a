#include "sim/light/ordinates.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace sim {

namespace {

using Point = std::array<int, 3>;
constexpr int kFinest = 8;
constexpr double kPi = 3.14159265358979323846;

/// Solid angle of the triangle that three points span from the origin.
/// source Van Oosterom, Strackee. The Solid Angle of a Plane Triangle. IEEE Trans. Biomed. Eng. 30. 1983, eq. 8
double solid_angle(const std::array<Point, 3>& p) {
  const auto dot = [](const Point& a, const Point& b) {
    return double(a[0]) * b[0] + double(a[1]) * b[1] + double(a[2]) * b[2];
  };
  const double volume = double(p[0][0]) * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
                        double(p[0][1]) * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
                        double(p[0][2]) * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
  const double a = std::sqrt(dot(p[0], p[0])), b = std::sqrt(dot(p[1], p[1])), c = std::sqrt(dot(p[2], p[2]));
  return 2 * std::atan2(std::abs(volume), a * b * c + dot(p[0], p[1]) * c + dot(p[1], p[2]) * a + dot(p[2], p[0]) * b);
}

/// The ordinate in the middle of a triangle of the octant. Triangles that a symmetry of the octant takes to each other
/// get the same bits: the area is that of the one whose centroid has sorted coordinates.
Ordinate ordinate_of(const std::array<Point, 3>& triangle) {
  const auto sum = [&](int a) { return triangle[0][a] + triangle[1][a] + triangle[2][a]; };
  const Point centre = {sum(0), sum(1), sum(2)};
  Point order = {0, 1, 2};
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return centre[a] < centre[b]; });
  std::array<Point, 3> sorted;
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 3; ++a) sorted[i][a] = triangle[i][order[a]];
  std::sort(sorted.begin(), sorted.end());

  const double length =
      std::sqrt(double(centre[0]) * centre[0] + double(centre[1]) * centre[1] + double(centre[2]) * centre[2]);
  Ordinate o;
  for (int a = 0; a < 3; ++a) o.along[a] = static_cast<float>(centre[a] / length);
  o.weight = static_cast<float>(solid_angle(sorted));
  return o;
}

/// The n^2 triangles of the octant: points with integer coordinates that sum to n.
std::vector<Ordinate> cut_octant(int n) {
  std::vector<Ordinate> all;
  for (int x = 0; x < n; ++x) {
    for (int y = 0; x + y < n; ++y) {
      const int z = n - x - y;
      all.push_back(ordinate_of({Point{x, y, z}, Point{x + 1, y, z - 1}, Point{x, y + 1, z - 1}}));
      if (z >= 2)
        all.push_back(ordinate_of({Point{x + 1, y, z - 1}, Point{x, y + 1, z - 1}, Point{x + 1, y + 1, z - 2}}));
    }
  }
  return all;
}

}  // namespace

world::Result<Ordinates> ordinates(int count) {
  Ordinates set;
  set.count = count;
  if (count == 6) {
    const float share = static_cast<float>(4 * kPi / 6);
    for (const int octant : {0, 7})
      for (int a = 0; a < 3; ++a) {
        Ordinate o{{0, 0, 0}, share};
        o.along[a] = 1;
        set.octants[octant].push_back(o);
      }
    set.half_range = share;
    return set;
  }
  for (int n = 1; n <= kFinest; ++n) {
    if (count != 8 * n * n) continue;
    set.octants.fill(cut_octant(n));
    for (const Ordinate& o : set.octants[0]) set.half_range += 4 * double(o.weight) * o.along[0];
    return set;
  }
  std::string known = "6";
  for (int n = 1; n <= kFinest; ++n) known += fmt::format(", {}", 8 * n * n);
  return world::usage_error(fmt::format("flux_directions: {} is no set of directions; known are {}", count, known));
}

}  // namespace sim
