/// Small things that the files of FieldFlood share: names, bits of leaves, and boxes of them. Internal to sim/light.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <tuple>

#include "sim/light/field_flood.h"

namespace sim {

using world::kLeafSize;
using world::kMaxLight;
using world::kRegionLeaves;
using world::LeafMask;
using world::LeafPos;
using world::LightField;
using world::LightLeaf;
using world::LightLeafView;
using world::LightRegion;
using world::RegionPos;
using world::VoxelBox;
using world::VoxelPos;

constexpr uint64_t kRow = 0xff;                       // the voxels of a slice x at the bottom
constexpr uint64_t kEachRow = 0x0101010101010101ull;  // times a row: that row at every y
constexpr int kMargin = 2;                            // leaves: 16 voxels, and light reaches 14

/// Which voxels of a leaf have one level, slice by slice: the comparison of LightLeafView, made ready.
class AtLevel {
 public:
  AtLevel(const LightLeafView& leaf, int level) : leaf_(leaf.leaf), tile_(leaf.tile == level ? ~0ull : 0) {
    for (int k = 0; k < 4; ++k) zeros_[k] = level >> k & 1 ? 0 : ~0ull;
  }
  uint64_t operator[](int x) const {
    if (!leaf_) return tile_;
    const uint64_t* w = leaf_->word[x];
    return (w[0] ^ zeros_[0]) & (w[1] ^ zeros_[1]) & (w[2] ^ zeros_[2]) & (w[3] ^ zeros_[3]);
  }

 private:
  const LightLeaf* leaf_;
  uint64_t tile_, zeros_[4];
};

/// A row of z for each slice x, byte x: where the sky's light goes through the face between two leaves.
inline uint64_t bottom_row(const LightLeafView& leaf, int level) {
  if (!leaf.leaf) return leaf.tile == level ? ~0ull : 0;
  const AtLevel lit(leaf, level);
  uint64_t row = 0;
  for (int x = 0; x < 8; ++x) row |= (lit[x] & kRow) << 8 * x;
  return row;
}

/// The voxels that the sky's light reaches straight from above; returns what leaves at the bottom.
inline uint64_t sky_through(const LeafMask& stops, uint64_t into, uint64_t* lit) {
  uint64_t out = 0;
  for (int x = 0; x < 8; ++x) {
    const uint64_t row = into >> 8 * x & kRow;
    if (stops.word[x] == 0 || row == 0) {  // most are of air or in the dark
      lit[x] = row * kEachRow;
      out |= row << 8 * x;
      continue;
    }
    uint64_t passes = ~stops.word[x];
    passes &= passes >> 8 | kRow << 56;
    passes &= passes >> 16 | 0xffffull << 48;
    passes &= passes >> 32 | 0xffffffffull << 32;
    lit[x] = passes & row * kEachRow;
    out |= (lit[x] & kRow) << 8 * x;
  }
  return out;
}

/// A leaf in which the voxels have level `top`, the others none.
inline LightLeaf sunlit(const uint64_t* voxels, int top) {
  LightLeaf leaf;
  for (int x = 0; x < 8; ++x)
    for (int k = 0; k < 4; ++k) leaf.word[x][k] = top >> k & 1 ? voxels[x] : 0;
  return leaf;
}

/// Whether all six neighbours are of the same region.
inline bool is_inside_region(LeafPos l) {
  for (int a = 0; a < 3; ++a)
    if (const int along = l[a] & (kRegionLeaves - 1); along == 0 || along == kRegionLeaves - 1) return false;
  return true;
}

/// By columns, each from the top.
inline bool downwards(const LeafPos& a, const LeafPos& b) { return std::tie(a.x, a.z, b.y) < std::tie(b.x, b.z, a.y); }

inline LeafBox leaf_box(const VoxelBox& box, int radius) {
  const VoxelPos r{radius, radius, radius};
  return {world::leaf_from_voxel(box.min - r), world::leaf_from_voxel(box.max + r)};
}
inline LeafBox leaf_box(RegionPos r, int margin) {
  const LeafPos low = world::leaf_from_region(r), m{margin, margin, margin};
  constexpr int kLast = kRegionLeaves - 1;
  return {low - m, low + LeafPos{kLast, kLast, kLast} + m};
}
inline LeafBox common(const LeafBox& a, const LeafBox& b) {
  LeafBox box;
  for (int i = 0; i < 3; ++i) box.min[i] = std::max(a.min[i], b.min[i]), box.max[i] = std::min(a.max[i], b.max[i]);
  return box;
}
inline bool is_empty(const LeafBox& box) {
  return box.max.x < box.min.x || box.max.y < box.min.y || box.max.z < box.min.z;
}
inline void include(LeafBox& box, const LeafBox& more) {
  for (int i = 0; i < 3; ++i)
    box.min[i] = std::min(box.min[i], more.min[i]), box.max[i] = std::max(box.max[i], more.max[i]);
}

/// Bits low to high of a row; 0 <= low <= high <= 31.
inline uint32_t bit_range(int low, int high) { return (~0u >> (31 - high)) & ~0u << low; }

/// Smallest box of the voxels of a mask, which isn't empty.
inline VoxelBox bounds_of(LeafPos l, const uint64_t* mask) {
  VoxelBox box;
  const VoxelPos low = world::voxel_from_leaf(l);
  for (int x = 0; x < 8; ++x) {
    if (!mask[x]) continue;
    uint64_t z = mask[x];
    z |= z >> 32, z |= z >> 16, z |= z >> 8, z &= kRow;
    const int first_y = std::countr_zero(mask[x]) >> 3, last_y = (63 - std::countl_zero(mask[x])) >> 3;
    box.include(low + VoxelPos{x, first_y, std::countr_zero(z)});
    box.include(low + VoxelPos{x, last_y, 63 - std::countl_zero(z)});
  }
  return box;
}

/// 64 numbers of four bits.
struct Levels {
  uint64_t bit[4];
};
inline Levels levels_of(const LightLeafView& leaf, int x) {
  Levels levels;
  for (int k = 0; k < 4; ++k) levels.bit[k] = leaf.leaf ? leaf.leaf->word[x][k] : leaf.tile >> k & 1 ? ~0ull : 0;
  return levels;
}
inline Levels masked(const Levels& a, uint64_t mask) {
  return {{a.bit[0] & mask, a.bit[1] & mask, a.bit[2] & mask, a.bit[3] & mask}};
}
inline Levels highest_of(const Levels& a, const Levels& b) {
  uint64_t higher = 0, equal = ~0ull;
  for (int k = 3; k >= 0; --k) {
    higher |= equal & a.bit[k] & ~b.bit[k];
    equal &= ~(a.bit[k] ^ b.bit[k]);
  }
  Levels levels;
  for (int k = 0; k < 4; ++k) levels.bit[k] = (a.bit[k] & higher) | (b.bit[k] & ~higher);
  return levels;
}
/// a - n, or 0 where that would be negative.
inline Levels less(const Levels& a, int n) {
  Levels levels;
  uint64_t borrow = 0;
  for (int k = 0; k < 4; ++k) {
    const uint64_t b = n >> k & 1 ? ~0ull : 0;
    levels.bit[k] = a.bit[k] ^ b ^ borrow;
    borrow = (~a.bit[k] & (b | borrow)) | (b & borrow);
  }
  return masked(levels, ~borrow);
}

/// Leaves of a region whose bits are set, by rows z*16 + y; empty where none is.
inline LeafBox bounds_of(RegionPos r, const std::array<uint16_t, 256>& rows) {
  LeafBox box{{kRegionLeaves, kRegionLeaves, kRegionLeaves}, {-1, -1, -1}};
  for (int z = 0; z < kRegionLeaves; ++z)
    for (int y = 0; y < kRegionLeaves; ++y) {
      const unsigned row = rows[static_cast<size_t>(z * kRegionLeaves + y)];
      if (!row) continue;
      include(box, {{std::countr_zero(row), y, z}, {31 - std::countl_zero(row), y, z}});
    }
  const LeafPos low = world::leaf_from_region(r);
  return {box.min + low, box.max + low};
}

/// The level of all voxels, or -1 where they differ.
inline int tile_of(const LightLeaf& leaf) {
  int level = 0;
  for (int k = 0; k < 4; ++k) {
    uint64_t all = ~0ull, any = 0;
    for (int x = 0; x < 8; ++x) all &= leaf.word[x][k], any |= leaf.word[x][k];
    if (all != any) return -1;
    if (all) level |= 1 << k;
  }
  return level;
}

inline constexpr uint64_t kOnes[8] = {~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull};

}  // namespace sim
