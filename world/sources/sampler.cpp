#include "world/sources/sampler.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/matrix.hpp>

#include "world/base/jobs.h"
#include "world/base/text.h"
#include "world/store/leaf_mask.h"

namespace world {
namespace {

constexpr size_t kMostRegions = size_t{1} << 15;  // a region's node alone takes 33 KiB: 1 GiB of them

/// One shape, as it lies in the voxels.
class Descent {
 public:
  Descent(const Shape& shape, const Placement& placement, const Sampling& sampling, BlockId block, VoxelBox clip)
      : shape_(shape),
        origin_(placement.position),
        source_from_voxel_(sampling.voxel_size_m * glm::inverse(placement.transform)),
        sampling_(sampling),
        block_(block),
        clip_(clip) {
    const int n = sampling.supersampling;
    needed_ = std::max(1, static_cast<int>(std::ceil(sampling.coverage * n * n * n - 1e-9)));
  }

  /// Regions that hold any of the solid, in the cube of 2^level regions at `low`. False where there are too many.
  bool collect(RegionPos low, int level, std::vector<RegionPos>& found) {
    const int64_t size = int64_t{kRegionSize} << level;
    const VoxelPos first = voxel_from_region(low);
    const VoxelBox box{first,
                       {static_cast<int32_t>(first.x + size - 1), static_cast<int32_t>(first.y + size - 1),
                        static_cast<int32_t>(first.z + size - 1)}};
    if (apart(box)) return true;
    if (cube(first, size) == Cover::outside) return true;
    if (level == 0) {
      found.push_back(low);
      return found.size() <= kMostRegions;
    }
    for (int i = 0; i < 8; ++i) {
      const int half = 1 << (level - 1);
      if (!collect(low + RegionPos{(i >> 2) * half, (i >> 1 & 1) * half, (i & 1) * half}, level - 1, found))
        return false;
    }
    return true;
  }

  /// Fills the region's part of the solid; `region` already holds what was there.
  void fill(RegionBuilder& region) { descend(region, {0, 0, 0}, kRegionSize); }

  const SamplingReport& report() const { return report_; }

 private:
  bool apart(const VoxelBox& box) const {
    for (int a = 0; a < 3; ++a) {
      if (box.max[a] < clip_.min[a] || box.min[a] > clip_.max[a]) return true;
    }
    return false;
  }
  bool within_clip(VoxelPos low, int64_t size) const {
    const int32_t last = static_cast<int32_t>(size - 1);
    return clip_.contains(low) && clip_.contains(low + VoxelPos{last, last, last});
  }
  /// A point of the voxels, given by a voxel and an offset from its low corner, in the source's space.
  Vec3d source_point(VoxelPos v, const Vec3d& offset) const {
    return source_from_voxel_ * (WorldPoint{v, Vec3d(0.0)} - origin_ + offset);
  }
  Cover cube(VoxelPos low, int64_t size) {
    ++report_.queries;
    const double half = 0.5 * static_cast<double>(size);
    const Vec3d centre = source_point(low, Vec3d(half));
    Vec3d reach(0.0);
    for (int column = 0; column < 3; ++column) reach += half * glm::abs(source_from_voxel_[column]);
    // Rounding of the transform must not push a corner out of the box.
    reach += 1e-14 * (glm::abs(centre) + reach);
    return shape_.classify({centre - reach, centre + reach});
  }

  bool sample(VoxelPos v) {
    const int n = sampling_.supersampling;
    if (sampling_.coverage <= 0) return cube(v, 1) != Cover::outside;
    if (n == 1) {
      ++report_.queries;
      return shape_.contains(source_point(v, Vec3d(0.5)));
    }
    const Cover whole = cube(v, 1);
    if (whole != Cover::mixed) return whole == Cover::inside;
    int inside = 0, left = n * n * n;
    for (int x = 0; x < n; ++x) {
      for (int y = 0; y < n; ++y) {
        for (int z = 0; z < n; ++z, --left) {
          if (inside >= needed_) return true;
          if (inside + left < needed_) return false;
          ++report_.queries;
          inside += shape_.contains(source_point(v, (Vec3d(x, y, z) + 0.5) / static_cast<double>(n)));
        }
      }
    }
    return inside >= needed_;
  }

  /// `low` counts from the region's corner.
  void descend(RegionBuilder& region, VoxelPos low, int size) {
    const VoxelPos at = voxel_from_region(region.pos()) + low;
    const VoxelBox box{at, at + VoxelPos{size - 1, size - 1, size - 1}};
    if (apart(box)) return;
    const Cover cover = cube(at, size);
    if (cover == Cover::outside) return;
    if (cover == Cover::inside && within_clip(at, size)) {
      const int leaves = size / kLeafSize;
      for (int i = 0; i < leaves * leaves * leaves; ++i) {
        const LeafPos l{i / (leaves * leaves), i / leaves % leaves, i % leaves};
        region.set_uniform(index_in_region(leaf_from_voxel(low) + l), block_);
      }
      report_.voxels += static_cast<uint64_t>(size) * static_cast<uint64_t>(size) * static_cast<uint64_t>(size);
      return;
    }
    if (size > kLeafSize) {
      const int half = size / 2;
      for (int i = 0; i < 8; ++i)
        descend(region, low + VoxelPos{(i >> 2) * half, (i >> 1 & 1) * half, (i & 1) * half}, half);
      return;
    }
    LeafMask mask;
    mark(at, {0, 0, 0}, kLeafSize, cover, mask);
    if (mask.is_none()) return;
    const int leaf = index_in_region(leaf_from_voxel(low));
    const LeafBlocks old = region.leaf(leaf);
    BlockId values[kLeafVoxels];
    for (int i = 0; i < kLeafVoxels; ++i) values[i] = mask.test(i) ? block_ : old[i];
    report_.voxels += static_cast<uint64_t>(mask.count());
    region.set_leaf(leaf, values);
  }

  /// Marks the voxels of a cube within a leaf, of which `cover` is known.
  void mark(VoxelPos leaf_low, VoxelPos low, int size, Cover cover, LeafMask& mask) {
    if (cover == Cover::outside) return;
    if (cover == Cover::inside) {
      for (int i = 0; i < size * size * size; ++i) {
        const VoxelPos v = low + VoxelPos{i / (size * size), i / size % size, i % size};
        if (clip_.contains(leaf_low + v)) mask.set(index_in_leaf(v));
      }
      return;
    }
    const int half = size / 2;
    for (int i = 0; i < 8; ++i) {
      const VoxelPos at = low + VoxelPos{(i >> 2) * half, (i >> 1 & 1) * half, (i & 1) * half};
      if (half > 1) {
        mark(leaf_low, at, half, cube(leaf_low + at, half), mask);
      } else if (clip_.contains(leaf_low + at) && sample(leaf_low + at)) {
        mask.set(index_in_leaf(at));
      }
    }
  }

  const Shape& shape_;
  WorldPoint origin_;
  glm::dmat3 source_from_voxel_;
  Sampling sampling_;
  BlockId block_;
  VoxelBox clip_;
  int needed_ = 1;
  SamplingReport report_;
};

/// The voxels that a shape's bounds meet, cut at the clip box. Fails where that is no box of the world.
Result<VoxelBox> voxel_bounds(const Shape& shape, const Placement& placement, const Sampling& sampling,
                              const VoxelBox* clip) {
  const ShapeBox bounds = shape.bounds();
  if (!bounds.finite() && !clip)
    return input_error(
        "the solid is not bounded: give the voxels that it may fill, min = [x, y, z] and max = [x, y, z]");
  VoxelBox box;
  box.min = {-kWorldBorder, -kWorldBorder, -kWorldBorder};
  box.max = {kWorldBorder - 1, kWorldBorder - 1, kWorldBorder - 1};
  if (bounds.finite()) {
    const Vec3d half = 0.5 * (bounds.max - bounds.min) / sampling.voxel_size_m;
    const Vec3d centre = placement.position.fraction + placement.transform * (bounds.centre() / sampling.voxel_size_m);
    Vec3d reach(1e-6);
    for (int column = 0; column < 3; ++column) reach += half[column] * glm::abs(placement.transform[column]);
    for (int a = 0; a < 3; ++a) {
      const double low = std::floor(centre[a] - reach[a]) + placement.position.voxel[a],
                   high = std::floor(centre[a] + reach[a]) + placement.position.voxel[a];
      const bool in = low >= -kWorldBorder && high < kWorldBorder;
      if (!in && !clip)
        return input_error(fmt::format("the solid reaches past the world's border of {} voxels", kWorldBorder));
      box.min[a] = static_cast<int32_t>(std::clamp(low, double(-kWorldBorder), double(kWorldBorder - 1)));
      box.max[a] = static_cast<int32_t>(std::clamp(high, double(-kWorldBorder), double(kWorldBorder - 1)));
    }
  } else if (bounds.empty()) {
    return VoxelBox{};
  }
  if (clip) {
    for (int a = 0; a < 3; ++a) {
      box.min[a] = std::max(box.min[a], clip->min[a]);
      box.max[a] = std::min(box.max[a], clip->max[a]);
    }
  }
  return box;
}

}  // namespace

Result<SamplingReport> sample_shape(Store& store, const Shape& shape, const Placement& placement,
                                    const Sampling& sampling, BlockId block, const VoxelBox* clip) {
  if (!(sampling.voxel_size_m > 0) || !std::isfinite(sampling.voxel_size_m) || sampling.supersampling < 1 ||
      sampling.supersampling > kMostSupersampling || !(sampling.coverage >= 0 && sampling.coverage <= 1))
    return usage_error(fmt::format(
        "sampling needs a voxel size above 0, supersampling in 1..{} and a coverage in [0, 1]", kMostSupersampling));
  TRY(const VoxelBox box, voxel_bounds(shape, placement, sampling, clip));
  SamplingReport total;
  if (box.empty()) return total;

  // Which regions: serial, since it asks about whole regions only.
  const RegionPos low = region_from_voxel(box.min), high = region_from_voxel(box.max);
  int level = 0;
  const int64_t widest = std::max({int64_t{high.x} - low.x, int64_t{high.y} - low.y, int64_t{high.z} - low.z}) + 1;
  while ((int64_t{1} << level) < widest) ++level;
  level = std::min(level, 22);  // the border's own size is 2^23 regions; cubes beyond it would wrap
  Descent search(shape, placement, sampling, block, box);
  std::vector<RegionPos> regions;
  const int64_t step = int64_t{1} << level;
  for (int64_t x = low.x; x <= high.x; x += step) {
    for (int64_t y = low.y; y <= high.y; y += step) {
      for (int64_t z = low.z; z <= high.z; z += step) {
        // A cube that would leave the world is divided until none does.
        if (!search.collect({static_cast<int32_t>(x), static_cast<int32_t>(y), static_cast<int32_t>(z)}, level,
                            regions))
          return input_error(
              fmt::format("the solid covers more than {} regions of 128^3 voxels, and they don't fit in "
                          "memory: choose a larger voxel size",
                          with_thousands(kMostRegions)));
      }
    }
  }
  total.queries = search.report().queries;

  std::vector<SamplingReport> reports(regions.size());
  const std::vector<RegionPos> held = store.regions();
  constexpr size_t kBatch = 64;  // regions built before any is adopted: reading the store while it is edited is a bug
  for (size_t first = 0; first < regions.size(); first += kBatch) {
    const size_t count = std::min(kBatch, regions.size() - first);
    std::vector<std::unique_ptr<RegionBuilder>> built(count);
    parallel_for(count, [&](size_t i) {
      const RegionPos r = regions[first + i];
      auto region = std::make_unique<RegionBuilder>(r);
      if (std::binary_search(held.begin(), held.end(), r)) {
        StoreReader reader(store);
        for (int l = 0; l < kLeavesPerRegion; ++l) {
          const LeafBlocks leaf = reader.leaf(leaf_from_region(r) + leaf_offset_in_region(l));
          if (leaf.values)
            region->set_leaf(l, std::span<const BlockId, kLeafVoxels>(leaf.values, kLeafVoxels));
          else if (leaf.uniform != kAir)
            region->set_uniform(l, leaf.uniform);
        }
      }
      Descent descent(shape, placement, sampling, block, box);
      descent.fill(*region);
      reports[first + i] = descent.report();
      built[i] = std::move(region);
    });
    for (size_t i = 0; i < count; ++i) {
      if (reports[first + i].voxels) store.adopt(std::move(*built[i]));
    }
  }
  for (const SamplingReport& report : reports) {
    total.voxels += report.voxels;
    total.queries += report.queries;
  }
  return total;
}

}  // namespace world
