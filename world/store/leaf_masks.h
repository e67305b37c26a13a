/// From block ids to the bits derived from them, a leaf or a region at a time. Internal to world/store.
#pragma once

#include <memory>
#include <span>

#include "world/store/store.h"
#include "world/store/tree.h"

namespace world {

/// Bit i: predicate of block i. The predicate is pure.
template <class Predicate>
LeafMask leaf_mask(const LeafBlocks& leaf, Predicate predicate) {
  if (!leaf.values) return predicate(leaf.uniform) ? kAllMask : kNoneMask;
  LeafMask mask;
  for (int w = 0; w < 8; ++w) {
    uint64_t bits = 0;
    for (int b = 0; b < 64; ++b) bits |= static_cast<uint64_t>(predicate(leaf.values[w * 64 + b])) << b;
    mask.word[w] = bits;
  }
  return mask;
}

/// `bits` by block id, as BlockPalette::masks() gives them.
inline LeafMask leaf_mask_of_kind(const LeafBlocks& leaf, std::span<const uint8_t> bits, int kind) {
  return leaf_mask(leaf, [&](BlockId b) { return (bits[b] >> kind & 1) != 0; });
}

std::unique_ptr<MaskRegion> build_mask_region(const RegionSlot& slot, RegionPos pos, std::span<const uint8_t> bits,
                                              int kind);
void count_region(const RegionSlot& slot, size_t palette_size, RegionCensus& census);

std::string fmt_edit_outside(const VoxelBox& box);

}  // namespace world
