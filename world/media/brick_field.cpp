#include "world/media/brick_field.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "world/numbers/robust.h"
#include "world/space/grid_walk.h"

namespace world {

namespace {

VoxelPos floor_of(const Vec3d& p) { return {floor_to_int(p.x), floor_to_int(p.y), floor_to_int(p.z)}; }
bool finite(const Vec3d& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

Result<std::shared_ptr<const BrickField>> BrickField::make(std::vector<FieldLeaf> leaves, FieldSampling sampling,
                                                           const std::string& name) {
  auto field = std::shared_ptr<BrickField>(new BrickField);
  field->trilinear_ = sampling == FieldSampling::trilinear;
  field->edge_ = field->trilinear_ ? 9 : 8;
  field->shift_ = field->trilinear_ ? 0.5 : 0;

  // Which leaves hold anything, and the box of voxels that aren't 0.
  std::sort(leaves.begin(), leaves.end(), [](const FieldLeaf& a, const FieldLeaf& b) { return a.leaf < b.leaf; });
  std::unordered_map<LeafPos, const FieldLeaf*, PosHash> by_place;
  VoxelBox box;
  for (const FieldLeaf& leaf : leaves) {
    bool any = false;
    for (int i = 0; i < kLeafVoxels; ++i) {
      const float v = leaf.values[static_cast<size_t>(i)];
      const VoxelPos at = voxel_from_leaf(leaf.leaf) + offset_in_leaf(i);
      if (!(v >= 0) || !std::isfinite(v))
        return input_error(fmt::format("{}: the density at voxel ({}, {}, {}) is {}, but must be finite and at least 0",
                                       name, at.x, at.y, at.z, v));
      if (v == 0) continue;
      any = true;
      box.include(at);
    }
    if (any) by_place.emplace(leaf.leaf, &leaf);
  }
  if (box.empty()) return std::shared_ptr<const BrickField>(std::move(field));

  // A cell with its lower corner in one leaf has samples in the next one: bricks lie below leaves, too.
  std::vector<LeafPos> places;
  const int reach = field->trilinear_ ? 1 : 0;
  for (const auto& [at, leaf] : by_place)
    for (int x = -reach; x <= 0; ++x)
      for (int y = -reach; y <= 0; ++y)
        for (int z = -reach; z <= 0; ++z) places.push_back(at + LeafPos{x, y, z});
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  if (places.size() > kMostBricks)
    return input_error(fmt::format("{}: the densities fill {} bricks of 8^3 voxels, more than the {} that fit", name,
                                   places.size(), kMostBricks));

  const int edge = field->edge_;
  const size_t size = static_cast<size_t>(edge * edge * edge);
  std::vector<float> samples(size);
  for (const LeafPos& place : places) {
    float largest = 0;
    const FieldLeaf* around[8];
    for (int n = 0; n < 8; ++n) {
      const auto found = by_place.find(place + LeafPos{n >> 2, n >> 1 & 1, n & 1});
      around[n] = found == by_place.end() ? nullptr : found->second;
    }
    size_t k = 0;
    for (int x = 0; x < edge; ++x)
      for (int y = 0; y < edge; ++y)
        for (int z = 0; z < edge; ++z, ++k) {
          const FieldLeaf* leaf = around[(x >> 3) << 2 | (y >> 3) << 1 | z >> 3];
          samples[k] = leaf ? leaf->values[static_cast<size_t>(index_in_leaf({x, y, z}))] : 0;
          largest = std::max(largest, samples[k]);
        }
    if (largest == 0) continue;
    const RegionPos r = region_from_leaf(place);
    const auto [found, added] = field->region_numbers_.try_emplace(r, static_cast<uint32_t>(field->regions_.size()));
    if (added) {
      field->regions_.emplace_back();
      field->regions_.back().bricks.fill(kNone);
    }
    Region& region = field->regions_[found->second];
    region.bricks[static_cast<size_t>(index_in_region(place))] = static_cast<uint32_t>(field->largest_of_.size());
    region.largest = std::max(region.largest, largest);
    field->largest_of_.push_back(largest);
    field->largest_ = std::max(field->largest_, largest);
    field->samples_.insert(field->samples_.end(), samples.begin(), samples.end());
  }
  field->make_table();
  const double margin = field->shift_;
  field->low_ = Vec3d(box.min.x, box.min.y, box.min.z) - margin;
  field->high_ = Vec3d(box.max.x, box.max.y, box.max.z) + 1.0 + margin;
  return std::shared_ptr<const BrickField>(std::move(field));
}

void BrickField::make_table() {
  VoxelBox box;
  for (const auto& [r, number] : region_numbers_) box.include(VoxelPos{r.x, r.y, r.z});
  if (box.volume() > kMostTableEntries) return;
  table_min_ = {box.min.x, box.min.y, box.min.z};
  table_size_ = {box.max.x - box.min.x + 1, box.max.y - box.min.y + 1, box.max.z - box.min.z + 1};
  region_table_.assign(box.volume(), kNone);
  for (const auto& [r, number] : region_numbers_) {
    const RegionPos at = r - table_min_;
    region_table_[static_cast<size_t>((at.x * table_size_.y + at.y) * table_size_.z + at.z)] = number;
  }
}

void BrickField::for_each_leaf(FunctionRef<void(const FieldLeaf&)> visit) const {
  std::vector<std::pair<RegionPos, uint32_t>> regions(region_numbers_.begin(), region_numbers_.end());
  std::sort(regions.begin(), regions.end());
  FieldLeaf leaf;
  for (const auto& [at, number] : regions)
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const uint32_t brick = regions_[number].bricks[static_cast<size_t>(i)];
      if (brick == kNone) continue;
      leaf.leaf = leaf_from_region(at) + leaf_offset_in_region(i);
      const float* const samples = &samples_[size_t{brick} * static_cast<size_t>(edge_ * edge_ * edge_)];
      bool any = false;
      for (int v = 0; v < kLeafVoxels; ++v) {
        const VoxelPos o = offset_in_leaf(v);
        const float value = samples[(o.x * edge_ + o.y) * edge_ + o.z];
        leaf.values[static_cast<size_t>(v)] = value;
        any |= value > 0;
      }
      if (any) visit(leaf);  // else only what lies in the next leaf
    }
}

size_t BrickField::bytes() const {
  return region_table_.capacity() * sizeof(uint32_t) + samples_.capacity() * sizeof(float) +
         largest_of_.capacity() * sizeof(float) + regions_.capacity() * sizeof(Region) + region_numbers_.size() * 32;
}

const BrickField::Region* BrickField::region(RegionPos r) const {
  if (!region_table_.empty()) {
    const uint32_t x = static_cast<uint32_t>(r.x - table_min_.x), y = static_cast<uint32_t>(r.y - table_min_.y),
                   z = static_cast<uint32_t>(r.z - table_min_.z);
    if (x >= static_cast<uint32_t>(table_size_.x) || y >= static_cast<uint32_t>(table_size_.y) ||
        z >= static_cast<uint32_t>(table_size_.z))
      return nullptr;
    const uint32_t number =
        region_table_[(size_t{x} * static_cast<uint32_t>(table_size_.y) + y) * static_cast<uint32_t>(table_size_.z) +
                      z];
    return number == kNone ? nullptr : &regions_[number];
  }
  const auto found = region_numbers_.find(r);
  return found == region_numbers_.end() ? nullptr : &regions_[found->second];
}

uint32_t BrickField::brick(LeafPos l) const {
  const Region* r = region(region_from_leaf(l));
  return r ? r->bricks[static_cast<size_t>(index_in_region(l))] : kNone;
}

/// The density in one cell as a function of the place in it, from the samples at its corners.
class BrickField::Cell {
 public:
  Cell(const BrickField& field, uint32_t brick, VoxelPos at) : trilinear_(field.trilinear_) {
    const int edge = field.edge_;
    const float* s = &field.samples_[static_cast<size_t>(brick) * static_cast<size_t>(edge * edge * edge) +
                                     static_cast<size_t>(((at.x & 7) * edge + (at.y & 7)) * edge + (at.z & 7))];
    if (!trilinear_) {
      corner_[0] = *s;
      return;
    }
    constexpr int offsets[8] = {0, 1, 9, 10, 81, 82, 90, 91};
    for (int c = 0; c < 8; ++c) corner_[c] = s[offsets[c]];
  }
  bool empty() const {
    float sum = corner_[0];
    for (int c = 1; c < (trilinear_ ? 8 : 1); ++c) sum += corner_[c];
    return sum == 0;
  }
  double operator()(const Vec3d& f) const {
    if (!trilinear_) return corner_[0];
    double along_z[4], along_y[2];
    for (int i = 0; i < 4; ++i) along_z[i] = corner_[2 * i] + f.z * (double{corner_[2 * i + 1]} - corner_[2 * i]);
    for (int i = 0; i < 2; ++i) along_y[i] = along_z[2 * i] + f.y * (along_z[2 * i + 1] - along_z[2 * i]);
    return along_y[0] + f.x * (along_y[1] - along_y[0]);
  }

 private:
  bool trilinear_;
  float corner_[8];
};

float BrickField::density(const Vec3d& voxels) const {
  for (int a = 0; a < 3; ++a)
    if (!(voxels[a] >= low_[a] && voxels[a] <= high_[a])) return 0;
  const Vec3d p = voxels - shift_;
  const VoxelPos cell = floor_of(p);
  const uint32_t b = brick(leaf_from_voxel(cell));
  if (b == kNone) return 0;
  const Vec3d fraction = p - Vec3d(cell.x, cell.y, cell.z);
  return clamp_number(static_cast<float>(Cell(*this, b, cell)(fraction)), 0.0f, largest_of_[b]);
}

MediumInterval BrickField::clipped(const Vec3d& origin, const Vec3d& direction, double t0, double t1) const {
  MediumInterval in{t0, t1};
  if (largest_ == 0 || !finite(origin) || !finite(direction)) return {0, -1};
  for (int a = 0; a < 3; ++a) {
    if (std::abs(direction[a]) < kTinyDirection) {
      if (origin[a] < low_[a] || origin[a] > high_[a]) return {0, -1};
      continue;
    }
    const double ta = (low_[a] - origin[a]) / direction[a], tb = (high_[a] - origin[a]) / direction[a];
    in.t0 = std::max(in.t0, std::min(ta, tb)), in.t1 = std::min(in.t1, std::max(ta, tb));
  }
  if (!std::isfinite(in.t1 - in.t0)) return {0, -1};  // no direction
  return in;
}

template <class Visit>
void BrickField::walk_bricks(const Vec3d& origin, const Vec3d& direction, double t0, double t1, Visit visit) const {
  // Through regions, then through the bricks of those that hold any.
  const auto walk = [&](double size, double from, double to, auto&& each) {
    const Vec3d start = (glm::clamp(origin + from * direction, low_, high_) - shift_) / size;
    FlatWalk w(GridRay(WorldPoint::from(start.x, start.y, start.z), direction / size, to - from));
    while (w.inside()) {
      const VoxelPos at = w.voxel();
      const double begin = from + w.t();
      w.step();
      const double end = w.inside() ? from + w.t() : to;
      if (!each(at, begin, std::max(begin, end))) return false;
    }
    return true;
  };
  walk(kRegionSize, t0, t1, [&](VoxelPos at, double begin, double end) {
    const Region* r = region({at.x, at.y, at.z});
    if (!r) return visit(kNone, begin, end);
    return walk(kLeafSize, begin, end, [&](VoxelPos v, double a, double b) {
      const LeafPos leaf{v.x, v.y, v.z};
      const bool here = region_from_leaf(leaf) == RegionPos{at.x, at.y, at.z};  // but for rounding
      return visit(here ? r->bricks[static_cast<size_t>(index_in_region(leaf))] : brick(leaf), a, b);
    });
  });
}

template <class Visit>
bool BrickField::walk_cells(uint32_t brick, const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                            Visit visit) const {
  const Vec3d start = glm::clamp(origin + t0 * direction, low_, high_) - shift_;
  FlatWalk w(GridRay(WorldPoint::from(start.x, start.y, start.z), direction, t1 - t0));
  while (w.inside()) {
    const VoxelPos cell = w.voxel();
    const double begin = t0 + w.t();
    w.step();
    const double end = w.inside() ? t0 + w.t() : t1;
    const Cell density(*this, brick, cell);
    if (!(end > begin) || density.empty()) continue;
    const Vec3d from_cell = origin - shift_ - Vec3d(cell.x, cell.y, cell.z);
    const auto density_at = [&](double t) { return density(glm::clamp(from_cell + t * direction, 0.0, 1.0)); };
    if (!visit(begin, end, density_at)) return false;
  }
  return true;
}

namespace {

/// Exact for polynomials of degree 3.
/// source  Carl Friedrich Gauss. Methodus nova integralium valores per approximationem inveniendi. 1814
template <class Density>
double integral(double begin, double end, const Density& density_at) {
  const double middle = 0.5 * (begin + end), half = 0.5 * (end - begin);
  const double off = half * 0.57735026918962576;  // 1 / sqrt(3)
  return half * (density_at(middle - off) + density_at(middle + off));
}

}  // namespace

double BrickField::depth(const Vec3d& origin, const Vec3d& direction, double t0, double t1) const {
  const MediumInterval in = clipped(origin, direction, t0, t1);
  if (in.empty()) return 0;
  double sum = 0;
  walk_bricks(origin, direction, in.t0, in.t1, [&](uint32_t b, double begin, double end) {
    if (b != kNone)
      walk_cells(b, origin, direction, begin, end, [&](double from, double to, const auto& density_at) {
        sum += integral(from, to, density_at);
        return true;
      });
    return true;
  });
  return sum;
}

double BrickField::reach(const Vec3d& origin, const Vec3d& direction, double t0, double t1, double depth) const {
  if (!(depth > 0)) return t0;
  const MediumInterval in = clipped(origin, direction, t0, t1);
  if (in.empty()) return kInfinity;
  double left = depth, found = kInfinity;
  walk_bricks(origin, direction, in.t0, in.t1, [&](uint32_t b, double begin, double end) {
    if (b == kNone) return true;
    return walk_cells(b, origin, direction, begin, end, [&](double from, double to, const auto& density_at) {
      const double here = integral(from, to, density_at);
      if (here < left) {
        left -= here;
        return true;
      }
      // The integral from the cell's start grows with t: halve until neighbours.
      double low = from, high = to;
      for (int i = 0; i < 64; ++i) {
        const double middle = low + 0.5 * (high - low);
        if (!(middle > low && middle < high)) break;
        (integral(from, middle, density_at) < left ? low : high) = middle;
      }
      found = high;
      return false;
    });
  });
  return found;
}

void BrickField::pieces(const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                        FunctionRef<bool(double end, double largest)> visit) const {
  const MediumInterval in = clipped(origin, direction, t0, t1);
  if (in.empty()) {
    visit(t1, 0);
    return;
  }
  if (in.t0 > t0 && !visit(in.t0, 0)) return;
  // Neighbours with the same bound are one piece, empty ones above all.
  double bound = 0, until = in.t0;
  bool going = true;
  walk_bricks(origin, direction, in.t0, in.t1, [&](uint32_t b, double begin, double end) {
    const double largest = b == kNone ? 0 : largest_of_[b];
    if (largest != bound && begin > until) {
      going = visit(begin, bound);
      until = begin;
    }
    bound = largest;
    return going && end >= begin;
  });
  if (!going || !(in.t1 <= until || visit(in.t1, bound))) return;
  if (in.t1 < t1) visit(t1, 0);
}

}  // namespace world
