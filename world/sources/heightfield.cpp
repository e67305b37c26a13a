// The solid below a surface y = f(x, z).
//
//   kind = "heightfield"
//   size = [x, z]              m: it covers [0, x] x [0, z]
//   base_m = -8                the solid's floor, below every height
//   mean_m = 0                 added to all heights
// a table, with bilinear interpolation:
//   columns, rows              posts along x and along z, from 2 to 4096 each
//   heights = [...]            columns * rows numbers, m; row by row, the first row at z = 0
// a sum of cosines, beside the table or without one:
//   [[source.wave]]
//   amplitude_m, wavelength_m, direction_deg = 0 (from +x towards +z), phase_deg = 0
//
// Bounds over a box are exact for a table alone (a pyramid of least and greatest heights; a bilinear patch lies between
// its corners) and for one wave alone; for sums they are the sum of the parts' bounds.
#include <cmath>

#include "world/numbers/interval.h"
#include "world/sources/source.h"

namespace world {
namespace {

constexpr double kRadian = 3.14159265358979323846 / 180;

/// Posts with least and greatest heights of cells in powers of two.
class Table {
 public:
  Table() = default;
  Table(int columns, int rows, std::vector<double> heights)
      : columns_(columns), rows_(rows), heights_(std::move(heights)) {
    int width = columns - 1, depth = rows - 1;
    std::vector<Interval> cells(static_cast<size_t>(width) * static_cast<size_t>(depth));
    for (int row = 0; row < depth; ++row) {
      for (int column = 0; column < width; ++column) {
        const double a = post(column, row), b = post(column + 1, row), c = post(column, row + 1),
                     d = post(column + 1, row + 1);
        cells[static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column)] = {
            std::min(std::min(a, b), std::min(c, d)), std::max(std::max(a, b), std::max(c, d))};
      }
    }
    levels_.push_back({width, depth, std::move(cells)});
    while (width > 1 || depth > 1) {
      const Level& below = levels_.back();
      Level level{(width + 1) / 2, (depth + 1) / 2, {}};
      for (int row = 0; row < level.depth; ++row) {
        for (int column = 0; column < level.width; ++column) {
          Interval all = below.at(2 * column, 2 * row);
          for (int i = 1; i < 4; ++i) {
            const int c = 2 * column + (i & 1), r = 2 * row + (i >> 1);
            if (c < below.width && r < below.depth) all = hull(all, below.at(c, r));
          }
          level.cells.push_back(all);
        }
      }
      width = level.width, depth = level.depth;
      levels_.push_back(std::move(level));
    }
  }
  bool empty() const { return levels_.empty(); }
  /// In posts, within the table.
  double height(double x, double z) const {
    const int c = std::min(static_cast<int>(x), columns_ - 2), r = std::min(static_cast<int>(z), rows_ - 2);
    const double u = x - c, v = z - r;
    return (post(c, r) * (1 - u) + post(c + 1, r) * u) * (1 - v) +
           (post(c, r + 1) * (1 - u) + post(c + 1, r + 1) * u) * v;
  }
  Interval range(double x0, double x1, double z0, double z1) const {
    int c0 = std::min(static_cast<int>(x0), columns_ - 2), c1 = std::min(static_cast<int>(x1), columns_ - 2);
    int r0 = std::min(static_cast<int>(z0), rows_ - 2), r1 = std::min(static_cast<int>(z1), rows_ - 2);
    size_t level = 0;
    while (c1 - c0 > 1 || r1 - r0 > 1) c0 /= 2, c1 /= 2, r0 /= 2, r1 /= 2, ++level;
    const Level& cells = levels_[level];
    return hull(hull(cells.at(c0, r0), cells.at(c1, r0)), hull(cells.at(c0, r1), cells.at(c1, r1)));
  }
  double columns() const { return columns_; }
  double rows() const { return rows_; }

 private:
  struct Level {
    int width = 0, depth = 0;
    std::vector<Interval> cells;
    const Interval& at(int column, int row) const {
      return cells[static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column)];
    }
  };
  static Interval hull(Interval a, Interval b) { return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)}; }
  double post(int column, int row) const {
    return heights_[static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column)];
  }
  int columns_ = 0, rows_ = 0;
  std::vector<double> heights_;
  std::vector<Level> levels_;
};

struct Wave {
  double amplitude, kx, kz, phase;  // m, rad/m, rad/m, rad
};

class Heightfield final : public Shape {
 public:
  double size_x = 1, size_z = 1, base = -8, mean = 0;
  Table table;
  std::vector<Wave> waves;

  double height(double x, double z) const {
    double h = mean;
    if (!table.empty()) h += table.height(x / size_x * (table.columns() - 1), z / size_z * (table.rows() - 1));
    for (const Wave& w : waves) h += w.amplitude * std::cos(w.kx * x + w.kz * z + w.phase);
    return h;
  }
  Interval range(double x0, double x1, double z0, double z1) const {
    Interval h(mean);
    if (!table.empty()) {
      const double cx = (table.columns() - 1) / size_x, cz = (table.rows() - 1) / size_z;
      h = h + table.range(x0 * cx, x1 * cx, z0 * cz, z1 * cz);
    }
    for (const Wave& w : waves)
      h = h + w.amplitude * cosine(w.kx * Interval(x0, x1) + w.kz * Interval(z0, z1) + w.phase);
    return h;
  }
  ShapeBox bounds() const override {
    return {{0, base, 0}, {size_x, std::max(base, range(0, size_x, 0, size_z).hi), size_z}};
  }
  Cover classify(const ShapeBox& box) const override {
    if (box.max.x < 0 || box.min.x > size_x || box.max.z < 0 || box.min.z > size_z || box.max.y < base)
      return Cover::outside;
    const Interval h = range(std::max(0.0, box.min.x), std::min(size_x, box.max.x), std::max(0.0, box.min.z),
                             std::min(size_z, box.max.z));
    if (box.min.y > h.hi) return Cover::outside;
    const bool within = box.min.x >= 0 && box.max.x <= size_x && box.min.z >= 0 && box.max.z <= size_z;
    return within && box.min.y >= base && box.max.y <= h.lo ? Cover::inside : Cover::mixed;
  }
  bool contains(const Vec3d& p) const override {
    return p.x >= 0 && p.x <= size_x && p.z >= 0 && p.z <= size_z && p.y >= base && p.y <= height(p.x, p.z);
  }
};

std::shared_ptr<const Shape> read_heightfield(TomlTable& table, const SourceContext&) {
  constexpr NumberRange kHeight{-1e6, 1e6}, kLength{.min = 0, .max = 1e9, .open_min = true};
  const auto field = std::make_shared<Heightfield>();
  double size[2] = {1, 1};
  table.require("size", std::span<double>(size), kLength);
  field->size_x = size[0], field->size_z = size[1];
  table.read("base_m", field->base, kHeight);
  table.read("mean_m", field->mean, kHeight);
  int32_t columns = 0, rows = 0;
  const bool wide = table.read("columns", columns, {2, 4096}), deep = table.read("rows", rows, {2, 4096});
  if (wide && deep) {
    std::vector<double> heights(static_cast<size_t>(columns) * static_cast<size_t>(rows));
    if (table.require("heights", std::span<double>(heights), kHeight))
      field->table = {columns, rows, std::move(heights)};
  } else if (wide || deep || table.has("heights")) {
    table.fail("heights", "a table of heights needs 'columns', 'rows' and 'heights'");
  }
  for (TomlTable row : table.array_of_tables("wave")) {
    double amplitude = 1, wavelength = 1, direction = 0, phase = 0;
    row.require("amplitude_m", amplitude, kHeight);
    row.require("wavelength_m", wavelength, kLength);
    row.read("direction_deg", direction, kHeight);
    row.read("phase_deg", phase, kHeight);
    const double k = 360 * kRadian / wavelength;
    field->waves.push_back(
        {amplitude, k * std::cos(direction * kRadian), k * std::sin(direction * kRadian), phase * kRadian});
  }
  return field;
}

}  // namespace

SourceKind heightfield_source() {
  return {.name = "heightfield", .what = "a table of heights, or a sum of cosines", .read = read_heightfield};
}

}  // namespace world
