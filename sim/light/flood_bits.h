/// Small things that the files of FieldFlood share: bits of leaves, and boxes of them. Internal to sim/light.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <tuple>

#include "sim/light/field_flood.h"

namespace sim {

constexpr uint64_t kRow = 0xff;                       // the voxels of a slice x at the bottom
constexpr uint64_t kEachRow = 0x0101010101010101ull;  // times a row: that row at every y
constexpr int kMargin = 2;                            // leaves: 16 voxels, and light reaches 14

/// A row of z for each slice x, byte x: where the sky's light goes through the face between two leaves.
inline uint64_t bottom_row(const world::LightLeafView& leaf, int level) {
  if (!leaf.leaf) return leaf.tile == level ? ~0ull : 0;
  uint64_t row = 0;
  for (int x = 0; x < 8; ++x) row |= (leaf.leaf->equal(x, level) & kRow) << 8 * x;
  return row;
}

/// The voxels that the sky's light reaches straight from above; returns what leaves at the bottom.
inline uint64_t sky_through(const world::LeafMask& stops, uint64_t into, uint64_t* lit) {
  uint64_t out = 0;
  for (int x = 0; x < 8; ++x) {
    uint64_t passes = ~stops.word[x];
    passes &= passes >> 8 | kRow << 56;
    passes &= passes >> 16 | 0xffffull << 48;
    passes &= passes >> 32 | 0xffffffffull << 32;
    lit[x] = passes & (into >> 8 * x & kRow) * kEachRow;
    out |= (lit[x] & kRow) << 8 * x;
  }
  return out;
}

/// A leaf in which the voxels have level `top`, the others none.
inline world::LightLeaf sunlit(const uint64_t* voxels, int top) {
  world::LightLeaf leaf;
  for (int x = 0; x < 8; ++x)
    for (int k = 0; k < 4; ++k) leaf.word[x][k] = top >> k & 1 ? voxels[x] : 0;
  return leaf;
}

/// By columns, each from the top.
inline bool downwards(const world::LeafPos& a, const world::LeafPos& b) {
  return std::tie(a.x, a.z, b.y) < std::tie(b.x, b.z, a.y);
}

inline LeafBox leaf_box(const world::VoxelBox& box, int radius) {
  const world::VoxelPos r{radius, radius, radius};
  return {world::leaf_from_voxel(box.min - r), world::leaf_from_voxel(box.max + r)};
}
inline LeafBox leaf_box(world::RegionPos r, int margin) {
  const world::LeafPos low = world::leaf_from_region(r), m{margin, margin, margin};
  constexpr int kLast = world::kRegionLeaves - 1;
  return {low - m, low + world::LeafPos{kLast, kLast, kLast} + m};
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
inline world::VoxelBox bounds_of(world::LeafPos l, const uint64_t* mask) {
  world::VoxelBox box;
  const world::VoxelPos low = world::voxel_from_leaf(l);
  for (int x = 0; x < 8; ++x) {
    if (!mask[x]) continue;
    uint64_t z = mask[x];
    z |= z >> 32, z |= z >> 16, z |= z >> 8, z &= kRow;
    const int first_y = std::countr_zero(mask[x]) >> 3, last_y = (63 - std::countl_zero(mask[x])) >> 3;
    box.include(low + world::VoxelPos{x, first_y, std::countr_zero(z)});
    box.include(low + world::VoxelPos{x, last_y, 63 - std::countl_zero(z)});
  }
  return box;
}

/// 64 numbers of four bits.
struct Levels {
  uint64_t bit[4];
};
inline Levels levels_of(const world::LightLeafView& leaf, int x) {
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
inline LeafBox bounds_of(world::RegionPos r, const std::array<uint16_t, 256>& rows) {
  LeafBox box{{world::kRegionLeaves, world::kRegionLeaves, world::kRegionLeaves}, {-1, -1, -1}};
  for (int z = 0; z < world::kRegionLeaves; ++z)
    for (int y = 0; y < world::kRegionLeaves; ++y) {
      const unsigned row = rows[static_cast<size_t>(z * world::kRegionLeaves + y)];
      if (!row) continue;
      include(box, {{std::countr_zero(row), y, z}, {31 - std::countl_zero(row), y, z}});
    }
  const world::LeafPos low = world::leaf_from_region(r);
  return {box.min + low, box.max + low};
}

inline constexpr uint64_t kOnes[8] = {~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull};

}  // namespace sim
