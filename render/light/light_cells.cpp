#include "render/light/light_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/image/display.h"

namespace render {

using world::Vec3d;
using world::VoxelPos;

namespace {

constexpr double kPi = 3.14159265358979323846, kInfinity = std::numeric_limits<double>::infinity();

/// The largest radiant intensity of any direction and band, W/sr; infinite where it doesn't fall as 1 / r^2.
double largest_intensity(const world::Luminaire& l, const world::LuminaireTables& t) {
  const double colour = std::max({t.colour.x, t.colour.y, t.colour.z});
  double brightest = 1;
  if (l.light_image)
    for (const world::Radiance3& p : l.light_image->pixels) brightest = std::max(brightest, double{p.max()});
  if (l.kind == "unified_point") {
    // M = Phi / (4 pi (a.x + a.y r + a.z r^2)) is at most that of a.z alone.
    return l.attenuation.z > 0 ? colour / (4 * kPi * l.attenuation.z) : kInfinity;
  }
  const bool point = t.area == 0, ball = l.kind == "sphere";
  return brightest * colour / (point || ball ? 4 * kPi : kPi);
}

double reach_of(const LightCells::Light& light, double cutoff) {
  return light.finite && cutoff > 0 ? light.radius + std::sqrt(light.intensity / cutoff) : kInfinity;
}

/// Cubes of 2^shift voxels that a sphere's box meets.
struct CellRange {
  VoxelPos low, high;
  int64_t count() const {
    return (int64_t{high.x} - low.x + 1) * (int64_t{high.y} - low.y + 1) * (int64_t{high.z} - low.z + 1);
  }
};
CellRange range_of(const LightCells::Light& light, double reach, int shift) {
  const auto cell = [shift](double v) { return static_cast<int32_t>(std::floor(v)) >> shift; };
  CellRange r;
  for (int a = 0; a < 3; ++a) {
    const double at = light.position.voxel[a] + light.position.fraction[a];
    r.low[a] = cell(at - reach), r.high[a] = cell(at + reach);
  }
  return r;
}

/// Whether a cell may hold a point that the light reaches.
bool reaches_cell(const LightCells::Light& light, double reach, VoxelPos cell, int shift) {
  const double size = std::ldexp(1.0, shift);
  Vec3d low;
  for (int a = 0; a < 3; ++a) low[a] = double(cell[a]) * size - light.position.voxel[a] - light.position.fraction[a];
  const Vec3d nearest = glm::max(low, glm::min(low + size, Vec3d(0)));
  if (glm::dot(nearest, nearest) > reach * reach) return false;
  if (!light.one_sided) return true;
  // The sphere around the cell against the cone around the axis, moved back by the light's own size.
  const Vec3d centre = low + 0.5 * size + light.axis * light.radius;
  const double around = 0.8660254037844387 * size + light.radius, distance = glm::length(centre);
  if (distance <= around) return true;
  const double angle = std::acos(std::clamp(glm::dot(centre, light.axis) / distance, -1.0, 1.0));
  return angle - std::asin(around / distance) <= light.half_angle;
}

}  // namespace

LightCells::Light LightCells::light_of(const world::Luminaire& l, const world::LuminaireTables& tables) {
  const world::shared::Emitter& e = tables.parts[0];
  Light light;
  light.position = l.position;
  light.intensity = largest_intensity(l, tables);
  light.finite = std::isfinite(tables.area) && std::isfinite(light.intensity);
  if (l.kind == "rectangle") light.radius = 0.5 * glm::length(Vec3d(e.extent.x, e.extent.y, 0));
  if (l.kind == "disk" || l.kind == "sphere") light.radius = e.radius;
  for (const world::Vec3f& corner : l.triangles) light.radius = std::max(light.radius, double{glm::length(corner)});
  light.one_sided = l.kind == "rectangle" || l.kind == "disk" || l.kind == "spot" || l.kind == "gobo";
  light.axis = e.axis;
  if (light.one_sided) light.half_angle = light.radius > 0 ? kPi / 2 : double{l.half_angle};
  return light;
}

double LightCells::cutoff_of(float share, float exposure) {
  return kPi * double{kWhiteRadiance} * std::exp2(-double{exposure}) * share;
}

std::span<const uint32_t> LightCells::near(const VoxelPos& voxel) const {
  const VoxelPos place{voxel.x >> shift_, voxel.y >> shift_, voxel.z >> shift_};
  const auto at = std::lower_bound(cells_.begin(), cells_.end(), place,
                                   [](const Cell& cell, const VoxelPos& p) { return cell.place < p; });
  if (at == cells_.end() || at->place != place) return {};
  return std::span(numbers_).subspan(at->first, at->count);
}

LightCells LightCells::make(std::span<const Light> lights, double cutoff) {
  LightCells made;
  made.cutoff_ = lights.size() > kFew ? cutoff : 0;
  made.reaches_.resize(lights.size());
  // Cubes about half as wide as a usual reach: narrower ones repeat lists, wider ones hold what doesn't reach.
  const auto fit = [&] {
    std::vector<double> finite;
    for (size_t i = 0; i < lights.size(); ++i) {
      made.reaches_[i] = reach_of(lights[i], made.cutoff_);
      if (made.reaches_[i] < kInfinity) finite.push_back(made.reaches_[i]);
    }
    if (finite.empty()) return;
    std::nth_element(finite.begin(), finite.begin() + static_cast<ptrdiff_t>(finite.size() / 2), finite.end());
    const double usual = std::max(finite[finite.size() / 2], 1.0);
    made.shift_ = std::clamp(static_cast<int>(std::floor(std::log2(usual))) - 1, 2, 20);
  };
  for (;;) {
    fit();
    made.everywhere_.clear();
    size_t too_wide = 0;
    double entries = 0;
    for (size_t i = 0; i < lights.size(); ++i) {
      if (!(made.reaches_[i] < 1e9)) {
        made.everywhere_.push_back(static_cast<uint32_t>(i));
        too_wide += lights[i].finite;
        continue;
      }
      const int64_t count = range_of(lights[i], made.reaches_[i], made.shift_).count();
      if (count > kMostCellsEach) {
        made.everywhere_.push_back(static_cast<uint32_t>(i)), ++too_wide;
        made.reaches_[i] = kInfinity;
      } else {
        entries += static_cast<double>(count);
      }
    }
    const bool exact = made.cutoff_ == 0;
    if (exact || (too_wide <= kMostEverywhere && entries <= double(kMostEntries))) break;
    made.cutoff_ *= 2;
  }

  // Pairs of cell and light, sorted by cell.
  struct Entry {
    VoxelPos cell;
    uint32_t light;
  };
  std::vector<Entry> entries;
  for (size_t i = 0; i < lights.size(); ++i) {
    if (!(made.reaches_[i] < kInfinity)) continue;
    const CellRange r = range_of(lights[i], made.reaches_[i], made.shift_);
    for (VoxelPos c = r.low; c.x <= r.high.x; ++c.x)
      for (c.y = r.low.y; c.y <= r.high.y; ++c.y)
        for (c.z = r.low.z; c.z <= r.high.z; ++c.z)
          if (reaches_cell(lights[i], made.reaches_[i], c, made.shift_))
            entries.push_back({c, static_cast<uint32_t>(i)});
  }
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.cell == b.cell ? a.light < b.light : a.cell < b.cell; });
  made.most_ = made.everywhere_.size();
  for (const Entry& e : entries) {
    if (made.cells_.empty() || made.cells_.back().place != e.cell)
      made.cells_.push_back({e.cell, static_cast<uint32_t>(made.numbers_.size()), 0});
    made.numbers_.push_back(e.light);
    made.most_ = std::max<size_t>(made.most_, ++made.cells_.back().count + made.everywhere_.size());
  }
  return made;
}

}  // namespace render
