#include "world/store/contours.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "world/base/jobs.h"

namespace world {

// --- 32 bits ------------------------------------------------------------------------------------------------------

namespace {

constexpr double kHalfSteps = 511;  // of an octahedron's coordinate, from -1 to 0
double sign_of(double v) { return v < 0 ? -1.0 : 1.0; }

}  // namespace

uint32_t pack_plane(const ContourPlane& plane) {
  Vec3d n = plane.normal / (std::abs(plane.normal.x) + std::abs(plane.normal.y) + std::abs(plane.normal.z));
  if (n.y < 0) n = {(1 - std::abs(n.z)) * sign_of(n.x), n.y, (1 - std::abs(n.x)) * sign_of(n.z)};
  const auto code = [](double v, double half, double low) {
    return static_cast<uint32_t>(std::clamp(std::round(v * half) + half + low, low, 2 * half + low));
  };
  return code(n.x, kHalfSteps, 0) | code(n.z, kHalfSteps, 0) << 10 | code(plane.offset / kLargestOffset, 2047, 1) << 20;
}

ContourPlane unpack_plane(uint32_t word) {
  const double x = (word & 1023) / kHalfSteps - 1, z = (word >> 10 & 1023) / kHalfSteps - 1;
  Vec3d n(x, 1 - std::abs(x) - std::abs(z), z);
  if (n.y < 0) n.x = (1 - std::abs(z)) * sign_of(x), n.z = (1 - std::abs(x)) * sign_of(z);
  return {glm::normalize(n), (static_cast<double>(word >> 20) - 2048) * (kLargestOffset / 2047)};
}

// --- where values come from ---------------------------------------------------------------------------------------

namespace {

VoxelPos corner_of_samples(LeafPos leaf) { return voxel_from_leaf(leaf) - VoxelPos{1, 1, 1}; }

class DensitySurface : public SurfaceField {
 public:
  DensitySurface(const FloatLayer& density, float iso) : density_(density), iso_(iso) {}
  void read(LeafPos leaf, std::span<float> values) const override {
    density_.read_cube(corner_of_samples(leaf), Contours::kAlong, std::numeric_limits<float>::quiet_NaN(), values);
    for (float& v : values) v = iso_ - v;
  }
  std::vector<LeafPos> leaves() const override {
    // Beside a leaf whose density ends at its border lies a part of the surface.
    std::vector<LeafPos> all;
    for (const LeafPos& l : density_.leaves())
      for (int i = 0; i < 27; ++i) all.push_back(l + LeafPos{i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1});
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }
  float beyond() const override { return iso_; }
  bool fog() const override { return true; }

 private:
  const FloatLayer& density_;
  float iso_;
};

class LevelSetSurface : public SurfaceField {
 public:
  explicit LevelSetSurface(const FloatLayer& distance) : distance_(distance) {}
  void read(LeafPos leaf, std::span<float> values) const override {
    distance_.read_cube(corner_of_samples(leaf), Contours::kAlong, std::numeric_limits<float>::quiet_NaN(), values);
  }
  std::vector<LeafPos> leaves() const override { return distance_.leaves(); }
  float beyond() const override { return 3; }  // the usual half width of a band

 private:
  const FloatLayer& distance_;
};

class FunctionSurface : public SurfaceField {
 public:
  FunctionSurface(std::function<float(VoxelPos)> value, const VoxelBox& box) : value_(std::move(value)), box_(box) {}
  void read(LeafPos leaf, std::span<float> values) const override {
    const VoxelPos low = corner_of_samples(leaf);
    size_t i = 0;
    for (int x = 0; x < Contours::kAlong; ++x)
      for (int y = 0; y < Contours::kAlong; ++y)
        for (int z = 0; z < Contours::kAlong; ++z) values[i++] = value_(low + VoxelPos{x, y, z});
  }
  std::vector<LeafPos> leaves() const override {
    std::vector<LeafPos> all;
    if (box_.empty()) return all;
    const LeafPos a = leaf_from_voxel(box_.min), b = leaf_from_voxel(box_.max);
    for (int x = a.x; x <= b.x; ++x)
      for (int y = a.y; y <= b.y; ++y)
        for (int z = a.z; z <= b.z; ++z) all.push_back({x, y, z});
    return all;
  }
  float beyond() const override { return 3; }

 private:
  std::function<float(VoxelPos)> value_;
  VoxelBox box_;
};

}  // namespace

std::unique_ptr<SurfaceField> density_surface(const FloatLayer& density, float iso) {
  return std::make_unique<DensitySurface>(density, iso);
}
std::unique_ptr<SurfaceField> level_set_surface(const FloatLayer& distance) {
  return std::make_unique<LevelSetSurface>(distance);
}
std::unique_ptr<SurfaceField> function_surface(std::function<float(VoxelPos)> value, const VoxelBox& box) {
  return std::make_unique<FunctionSurface>(std::move(value), box);
}

// --- one voxel ----------------------------------------------------------------------------------------------------

namespace {

constexpr int kAlong = Contours::kAlong;
constexpr int kCorners = 2 * kLeafSize + 1;  // of the eighths of a leaf's voxels, along an axis

constexpr size_t sample_at(int x, int y, int z) { return static_cast<size_t>((x * kAlong + y) * kAlong + z); }
constexpr size_t corner_at(int x, int y, int z) { return static_cast<size_t>((x * kCorners + y) * kCorners + z); }

/// Values at the corners of all eighths: samples at odd places, means of 2, 4 and 8 of them between.
void read_corners(const Contours::Values& values, std::vector<float>& corners) {
  corners.resize(kCorners * kCorners * kCorners);
  for (int x = 0; x < kCorners; ++x)
    for (int y = 0; y < kCorners; ++y)
      for (int z = 0; z < kCorners; ++z) {
        const int x0 = (x + 1) / 2, y0 = (y + 1) / 2, z0 = (z + 1) / 2;
        const int x1 = x0 + (x + 1) % 2, y1 = y0 + (y + 1) % 2, z1 = z0 + (z + 1) % 2;
        const auto along_z = [&](int i, int j) { return values[sample_at(i, j, z0)] + values[sample_at(i, j, z1)]; };
        corners[corner_at(x, y, z)] = ((along_z(x0, y0) + along_z(x0, y1)) + (along_z(x1, y0) + along_z(x1, y1))) / 8;
      }
}

/// The quadric through the 27 values around a voxel, least squares; without its constant.
struct Quadric {
  Vec3d linear{0.0}, square{0.0}, mixed{0.0};  // mixed: yz, xz, xy
  Quadric(const Contours::Values& values, VoxelPos in_leaf) {
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          const double v = values[sample_at(in_leaf.x + 1 + x, in_leaf.y + 1 + y, in_leaf.z + 1 + z)];
          linear += v / 18 * Vec3d(x, y, z);
          square += v / 6 * (Vec3d(x * x, y * y, z * z) - 2.0 / 3);
          mixed += v / 12 * Vec3d(y * z, x * z, x * y);
        }
  }
  Vec3d gradient(const Vec3d& at) const {
    return linear + 2.0 * square * at +
           Vec3d(mixed.z * at.y + mixed.y * at.z, mixed.z * at.x + mixed.x * at.z, mixed.y * at.x + mixed.x * at.y);
  }
};

/// `corner(x, y, z)`, each 0..2: the value there.
template <class Corner>
std::optional<uint32_t> fit_plane(Corner corner, const Quadric& quadric) {
  // Find where the edges of the eighths cross the surface, relative to the voxel's middle.
  Vec3d sum(0.0);
  int crossings = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < 18; ++i) {
      int at[3];
      at[axis] = i / 9, at[(axis + 1) % 3] = i / 3 % 3, at[(axis + 2) % 3] = i % 3;
      const double a = corner(at[0], at[1], at[2]);
      Vec3d place(0.5 * (at[0] - 1), 0.5 * (at[1] - 1), 0.5 * (at[2] - 1));
      ++at[axis];
      const double b = corner(at[0], at[1], at[2]);
      if ((a <= 0) == (b <= 0)) continue;
      place[axis] += 0.5 * (a / (a - b));
      sum += place;
      ++crossings;
    }
  if (crossings == 0) return std::nullopt;
  const Vec3d mean = sum / static_cast<double>(crossings), gradient = quadric.gradient(mean);
  const double length = glm::length(gradient);
  if (!(length > 0) || !std::isfinite(length)) return std::nullopt;
  // Round the normal first, so that the plane still passes through the mean.
  const Vec3d normal = unpack_plane(pack_plane({gradient / length, 0})).normal;
  const ContourPlane plane{normal, glm::dot(normal, mean)};
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 3; ++y)
      for (int z = 0; z < 3; ++z) {
        const double height = glm::dot(normal, 0.5 * Vec3d(x - 1, y - 1, z - 1)) - plane.offset;
        if (std::abs(height) > kMisfit && (height <= 0) != (corner(x, y, z) <= 0)) return std::nullopt;
      }
  return pack_plane({normal, plane.offset});
}

}  // namespace

Vec3d surface_gradient(const Contours::Values& values, VoxelPos in_leaf, const Vec3d& from_middle) {
  return Quadric(values, in_leaf).gradient(from_middle);
}

// --- leaves -------------------------------------------------------------------------------------------------------

struct Contours::Built {
  LeafMask cells;
  bool any = false;  // planes and values hold something
  Planes planes{};
  Values values{};
};

Contours::Built Contours::build(LeafPos l) const {
  Built built;
  built.cells = occupied_->leaf(l);
  if (!std::binary_search(field_leaves_.begin(), field_leaves_.end(), l)) return built;

  // Read the values; where there are none the blocks speak.
  field_->read(l, built.values);
  const float beyond = field_->beyond();
  const VoxelPos low = corner_of_samples(l);
  bool edited[kSamples], any_edited = false, any_inside = false, any_outside = false;
  for (int i = 0; i < kSamples; ++i) {
    float& value = built.values[static_cast<size_t>(i)];
    const VoxelPos in_cube{i / (kAlong * kAlong), i / kAlong % kAlong, i % kAlong};
    const VoxelPos v = low + in_cube;
    const VoxelPos shifted = in_cube - VoxelPos{1, 1, 1};
    const bool own = ((shifted.x | shifted.y | shifted.z) & ~7) == 0;
    const bool block = own ? built.cells.test(v) : occupied_->test(v);
    if (std::isnan(value)) {
      edited[i] = field_->fog() && block;
      value = block ? -beyond : beyond;
    } else {
      edited[i] = field_->fog() ? value <= 0 && !block : (value <= 0) != block;
    }
    any_edited |= edited[i];
    (value <= 0 ? any_inside : any_outside) = true;
  }
  if (!any_edited && !(any_inside && any_outside)) {
    if (!any_inside) built.cells = kNoneMask;
    return built;
  }

  static thread_local std::vector<float> corners;
  read_corners(built.values, corners);
  for (int i = 0; i < kLeafVoxels; ++i) {
    const VoxelPos in_leaf = offset_in_leaf(i);
    if (any_edited) {
      bool near_edit = false;
      for (int n = 0; n < 27; ++n)
        near_edit |= edited[sample_at(in_leaf.x + n / 9, in_leaf.y + n / 3 % 3, in_leaf.z + n % 3)];
      if (near_edit) continue;  // the cell is what the block is
    }
    const auto corner = [&](int x, int y, int z) {
      return corners[corner_at(2 * in_leaf.x + x, 2 * in_leaf.y + y, 2 * in_leaf.z + z)];
    };
    int inside = 0;
    for (int n = 0; n < 27; ++n) inside += corner(n / 9, n / 3 % 3, n % 3) <= 0;
    if (inside == 0) {
      built.cells.clear(i);
      continue;
    }
    built.cells.set(i);
    if (inside == 27) continue;
    const uint32_t unfit = corner(1, 1, 1) <= 0 ? kUnfitInside : kUnfitOutside;
    built.planes[static_cast<size_t>(i)] = fit_plane(corner, Quadric(built.values, in_leaf)).value_or(unfit);
    built.any = true;
  }
  return built;
}

void Contours::put(LeafPos l, const Built& built) {
  cells_.set_leaf(l, built.cells);
  const auto found = index_.find(l);
  if (!built.any) {
    if (found == index_.end()) return;
    free_.push_back(found->second);
    index_.erase(found);
    return;
  }
  uint32_t slot;
  if (found != index_.end()) {
    slot = found->second;
  } else if (!free_.empty()) {
    slot = free_.back();
    free_.pop_back();
  } else {
    slot = static_cast<uint32_t>(planes_.size());
    planes_.emplace_back();
    if (keep_values_) values_.emplace_back();
  }
  index_[l] = slot;
  planes_[slot] = built.planes;
  if (keep_values_) values_[slot] = built.values;
}

Contours::Contours(const MaskVolume& occupied, std::unique_ptr<SurfaceField> field, bool keep_values)
    : occupied_(&occupied), field_(std::move(field)), keep_values_(keep_values) {
  if (!field_) return;
  field_leaves_ = field_->leaves();
  for (const MaskRegion* region : occupied.regions())
    cells_.put_region(region->pos, std::make_unique<MaskRegion>(*region));
  cells_.finish();
  // Leaves are built side by side and put in order, a batch at a time.
  constexpr size_t kBatch = 1024;
  std::vector<Built> built(std::min(kBatch, field_leaves_.size()));
  for (size_t first = 0; first < field_leaves_.size(); first += kBatch) {
    const size_t count = std::min(kBatch, field_leaves_.size() - first);
    parallel_ranges(count, 16, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) built[i] = build(field_leaves_[first + i]);
    });
    for (size_t i = 0; i < count; ++i) put(field_leaves_[first + i], built[i]);
  }
}

std::vector<LeafPos> Contours::update(std::span<const LeafPos> dirty) {
  std::vector<LeafPos> touched;
  if (!field_) return touched;
  for (const LeafPos& l : dirty)
    for (int i = 0; i < 27; ++i) {
      const LeafPos near = l + LeafPos{i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1};
      if (i == 13 || std::binary_search(field_leaves_.begin(), field_leaves_.end(), near)) touched.push_back(near);
    }
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  for (const LeafPos& l : touched) put(l, build(l));
  return touched;
}

size_t Contours::bytes() const {
  const size_t nodes = index_.size() * (sizeof(LeafPos) + sizeof(uint32_t) + 2 * sizeof(void*)) +
                       (index_.empty() ? 0 : index_.bucket_count() * sizeof(void*));
  return nodes + planes_.capacity() * sizeof(Planes) + values_.capacity() * sizeof(Values) +
         free_.capacity() * sizeof(uint32_t) + cells_.bytes();
}

}  // namespace world
