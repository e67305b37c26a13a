/// Sets of voxels of a leaf, as masks: what two have in common, both, one without the other, and each voxel in turn.
#pragma once

#include <bit>

#include "world/store/leaf_mask.h"

namespace world {

constexpr LeafMask operator&(const LeafMask& a, const LeafMask& b) {
  LeafMask m;
  for (int x = 0; x < 8; ++x) m.word[x] = a.word[x] & b.word[x];
  return m;
}
constexpr LeafMask operator|(const LeafMask& a, const LeafMask& b) {
  LeafMask m;
  for (int x = 0; x < 8; ++x) m.word[x] = a.word[x] | b.word[x];
  return m;
}
constexpr LeafMask without(const LeafMask& a, const LeafMask& b) {
  LeafMask m;
  for (int x = 0; x < 8; ++x) m.word[x] = a.word[x] & ~b.word[x];
  return m;
}

/// The first voxel of a mask that isn't none.
inline int first_index(const LeafMask& mask) {
  int x = 0;
  while (mask.word[x] == 0) ++x;
  return x * 64 + std::countr_zero(mask.word[x]);
}

/// Calls visit(index_in_leaf) for each voxel of the mask, in order.
template <class Visit>
void for_each_voxel(const LeafMask& mask, Visit visit) {
  for (int x = 0; x < 8; ++x)
    for (uint64_t bits = mask.word[x]; bits; bits &= bits - 1) visit(x * 64 + std::countr_zero(bits));
}

}  // namespace world
