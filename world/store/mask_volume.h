/// One bit a voxel for a whole world, derived from the block layer: what extraction, light, matter and rays walk.
///
/// Three levels: a table of regions (128^3); in each region one bit a leaf for "any voxel set" and one for "all set",
/// grouped 4^3 leaves to a 64-bit word; and 64 bytes for each mixed leaf. Empty and full leaves cost no bytes.
/// Readers may run in parallel; set_leaf needs exclusive access. Only the store writes.
#pragma once

#include <array>
#include <memory>
#include <unordered_map>
#include <vector>

#include "world/store/leaf_mask.h"

namespace world {

/// Word of the 4^3 group of leaves that holds the leaf, 0..63: (gx*4 + gy)*4 + gz with g = leaf offset / 4.
constexpr int leaf_group(LeafPos l) { return ((l.x & 15) >> 2) << 4 | ((l.y & 15) >> 2) << 2 | (l.z & 15) >> 2; }
/// Bit within that word, 0..63: (lx*4 + ly)*4 + lz with l = leaf offset mod 4.
constexpr int leaf_group_bit(LeafPos l) { return (l.x & 3) << 4 | (l.y & 3) << 2 | (l.z & 3); }

struct MaskRegion {
  RegionPos pos;
  uint64_t any_groups = 0;                      // bit g: any[g] != 0
  std::array<uint64_t, 64> any{};               // bit: some voxel of the leaf is set
  std::array<uint64_t, 64> full{};              // bit: every voxel of the leaf is set
  std::array<uint16_t, kLeavesPerRegion> slot;  // by index_in_region: place in `masks`, valid where any && !full
  std::vector<LeafMask> masks;
  std::vector<uint16_t> free_slots;

  bool leaf_any(LeafPos l) const { return any[leaf_group(l)] >> leaf_group_bit(l) & 1; }
  bool leaf_full(LeafPos l) const { return full[leaf_group(l)] >> leaf_group_bit(l) & 1; }
  /// The leaf's mask; never null.
  const LeafMask& leaf(LeafPos l) const {
    if (!leaf_any(l)) return kNoneMask;
    if (leaf_full(l)) return kAllMask;
    return masks[slot[index_in_region(l)]];
  }
};

class MaskVolume {
 public:
  /// The region, or null where every voxel of it is clear.
  const MaskRegion* region(RegionPos r) const {
    if (dense_.empty()) {
      const auto found = regions_.find(r);
      return found == regions_.end() ? nullptr : found->second.get();
    }
    const uint32_t x = static_cast<uint32_t>(r.x - dense_min_.x), y = static_cast<uint32_t>(r.y - dense_min_.y),
                   z = static_cast<uint32_t>(r.z - dense_min_.z);
    if (x >= dense_size_[0] || y >= dense_size_[1] || z >= dense_size_[2]) return nullptr;
    return dense_[(size_t{x} * dense_size_[1] + y) * dense_size_[2] + z];
  }
  const LeafMask& leaf(LeafPos l) const {
    const MaskRegion* r = region(region_from_leaf(l));
    return r ? r->leaf(l) : kNoneMask;
  }
  bool test(VoxelPos v) const { return leaf(leaf_from_voxel(v)).test(v); }

  /// Regions with any voxel set, sorted by position.
  std::vector<const MaskRegion*> regions() const;
  /// Inclusive bounds in regions; empty world: max < min.
  RegionPos min_region() const { return min_; }
  RegionPos max_region() const { return max_; }
  bool empty() const { return regions_.empty(); }
  size_t bytes() const;
  uint64_t count() const;  // voxels set
  /// Raised at each change, so that what derives from it can tell.
  uint64_t version() const { return version_; }

  void set_leaf(LeafPos l, const LeafMask& mask);
  /// Takes over a whole region, replacing what was there; null or empty clears it. Call finish() after a batch.
  void put_region(RegionPos pos, std::unique_ptr<MaskRegion> region);
  /// Rebuilds the bounds and the dense table; set_leaf calls it where a region appears or vanishes.
  void finish();

 private:
  std::unordered_map<RegionPos, std::unique_ptr<MaskRegion>, PosHash> regions_;
  std::vector<const MaskRegion*> dense_;  // by position, where the bounds hold at most kDenseLimit regions
  RegionPos dense_min_;
  uint32_t dense_size_[3] = {0, 0, 0};
  RegionPos min_{0, 0, 0}, max_{-1, -1, -1};
  uint64_t version_ = 0;
};

size_t bytes_of(const MaskRegion& region);
/// Sets one leaf of a region, keeping its summary bits and slots.
void set_region_leaf(MaskRegion& region, LeafPos l, const LeafMask& mask);

}  // namespace world
