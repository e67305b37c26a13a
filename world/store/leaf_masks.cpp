#include "world/store/leaf_masks.h"

#include <cstring>

#include <fmt/format.h>

namespace world {

std::unique_ptr<MaskRegion> build_mask_region(const RegionSlot& slot, RegionPos pos, std::span<const uint8_t> bits,
                                              int kind) {
  auto region = std::make_unique<MaskRegion>();
  region->pos = pos;
  region->masks.reserve(slot.node ? slot.node->getChildMask().countOn() : slot.packed->mixed_leaves());
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    LeafMask mask;
    if (slot.node) {
      const LeafBlocks leaf = leaf_of(*slot.node, i);
      if (!leaf.values && leaf.uniform == kAir) continue;
      mask = leaf_mask_of_kind(leaf, bits, kind);
    } else {
      mask = slot.packed->mask(i, bits, kind);
    }
    if (!mask.is_none()) set_region_leaf(*region, leaf_offset_in_region(i), mask);
  }
  region->masks.shrink_to_fit();
  return region;
}

void count_region(const RegionSlot& slot, size_t palette_size, RegionCensus& census) {
  std::vector<int64_t> counts(palette_size, 0);
  if (slot.packed) {
    slot.packed->count(counts);
  } else {
    // Four tables: neighbours are often alike, and additions to one counter wait for each other.
    std::vector<int64_t> more(3 * palette_size, 0);
    int64_t* const table[] = {counts.data(), more.data(), more.data() + palette_size, more.data() + 2 * palette_size};
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LeafBlocks leaf = leaf_of(*slot.node, i);
      if (!leaf.values) {
        counts[leaf.uniform] += kLeafVoxels;
        continue;
      }
      // Most rows of eight hold one block: one addition for them instead of eight.
      for (const BlockId* row = leaf.values; row != leaf.values + kLeafVoxels; row += kLeafSize) {
        uint64_t half[2];
        std::memcpy(half, row, sizeof half);
        if (half[0] == half[1] && half[0] == row[0] * uint64_t{0x0001000100010001})
          counts[row[0]] += kLeafSize;
        else
          for (int v = 0; v < kLeafSize; ++v) ++table[v & 3][row[v]];
      }
    }
    for (size_t b = 0; b < more.size(); ++b) counts[b % palette_size] += more[b];
  }
  for (size_t b = 1; b < palette_size; ++b)
    if (counts[b]) census.counts.emplace_back(static_cast<BlockId>(b), counts[b]);
}

std::string fmt_edit_outside(const VoxelBox& b) {
  return fmt::format(
      "an edit of ({}, {}, {})..({}, {}, {}) leaves the world, whose border is +-{}: nothing was changed", b.min.x,
      b.min.y, b.min.z, b.max.x, b.max.y, b.max.z, kWorldBorder);
}

}  // namespace world
