/// Floods over leaf masks: what is joined through faces, 512 voxels at a time.
#pragma once

#include <utility>
#include <vector>

#include "world/store/leaf_sets.h"
#include "world/store/leaf_shifts.h"

namespace world {

/// All of `within` that touches `start` through it; start itself too.
inline LeafMask touching(const LeafMask& start, const LeafMask& within) {
  LeafMask mask = start;
  if (!mask.is_none() && within.is_all()) return within;
  for (;;) {
    LeafMask more = mask;
    for (int face = 0; face < kFaces; ++face) more = more | across(mask, kNoneMask, face);
    more = (more & within) | mask;
    if (more == mask) return mask;
    mask = more;
  }
}

constexpr size_t kNoLeaf = SIZE_MAX;

/// Where a flood has got to: leaves by whatever number the caller gives them, and voxels there from which it goes on.
using LeafFront = std::vector<std::pair<size_t, LeafMask>>;

/// Floods from `front`, downwards first, and leaves it empty.
///   left(leaf)            LeafMask&, what may be reached there; what is reached is taken out of it
///   beside(leaf, face)    the leaf on that side, or kNoLeaf
///   reached(leaf, fresh)  false: stop
template <class Left, class Beside, class Reached>
void flood_leaves(LeafFront& front, Left left, Beside beside, Reached reached) {
  // The last one comes first.
  constexpr Face kOrder[] = {kFaceNegX, kFacePosX, kFaceNegZ, kFacePosZ, kFacePosY, kFaceNegY};
  while (!front.empty()) {
    const auto [leaf, from] = front.back();
    front.pop_back();
    LeafMask& here = left(leaf);
    const LeafMask fresh = touching(from & here, here);
    if (fresh.is_none()) continue;
    here = without(here, fresh);
    if (!reached(leaf, fresh)) return front.clear();
    for (const Face face : kOrder) {
      if ((fresh & side_of(face)).is_none()) continue;
      const size_t next = beside(leaf, face);
      if (next == kNoLeaf) continue;
      // Bits of the next leaf that touch ours: as seen from there, across its opposite face.
      const LeafMask touched = across(kNoneMask, fresh, opposite_face(face));
      if (!(touched & left(next)).is_none()) front.emplace_back(next, touched);
    }
  }
}

}  // namespace world
