/// Floods over leaf masks: what is joined through faces, 512 voxels at a time.
#pragma once

#include <utility>
#include <vector>

#include "world/store/leaf_sets.h"
#include "world/store/leaf_shifts.h"

namespace world {

/// All of `within` that `start`, a part of it, reaches through faces in the leaf.
/// source Peter M. Kogge, Harold S. Stone. A Parallel Algorithm for the Efficient Solution of a General Class of
///        Recurrence Equations. 1973: a line of eight in three steps
constexpr LeafMask touching(LeafMask start, const LeafMask& within) {
  if (within.is_all() && !start.is_none()) return within;
  constexpr uint64_t kLastZMask = kFirstZMask << 7;
  // A plane of constant x: along z within bytes, along y between them.
  const auto plane = [](uint64_t m, uint64_t open) {
    uint64_t up = open & ~kFirstZMask, down = open & ~kLastZMask;
    m |= (up & m << 1) | (down & m >> 1);
    up &= up << 1, down &= down >> 1;
    m |= (up & m << 2) | (down & m >> 2);
    up &= up << 2, down &= down >> 2;
    m |= (up & m << 4) | (down & m >> 4);
    up = down = open;
    m |= (up & m << 8) | (down & m >> 8);
    up &= up << 8, down &= down >> 8;
    m |= (up & m << 16) | (down & m >> 16);
    up &= up << 16, down &= down >> 16;
    m |= (up & m << 32) | (down & m >> 32);
    return m;
  };
  for (;;) {
    const LeafMask before = start;
    for (int x = 0; x < 8; ++x) {
      if (x > 0) start.word[x] |= start.word[x - 1] & within.word[x];
      start.word[x] = plane(start.word[x], within.word[x]);
    }
    for (int x = 6; x >= 0; --x) {
      const uint64_t more = start.word[x + 1] & within.word[x] & ~start.word[x];
      if (more) start.word[x] = plane(start.word[x] | more, within.word[x]);
    }
    if (start == before || start == within) return start;
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
    const LeafMask start = from & here;
    if (start.is_none()) continue;  // reached from elsewhere since it was noted
    const LeafMask fresh = touching(start, here);
    here = without(here, fresh);
    if (!reached(leaf, fresh)) return front.clear();
    const bool all = fresh.is_all();
    for (const Face face : kOrder) {
      if (!all && (fresh & side_of(face)).is_none()) continue;
      const size_t next = beside(leaf, face);
      if (next == kNoLeaf) continue;
      // Bits of the next leaf that touch ours: as seen from there, across its opposite face.
      const LeafMask touched = all ? side_of(opposite_face(face)) : across(kNoneMask, fresh, opposite_face(face));
      if (!(touched & left(next)).is_none()) front.emplace_back(next, touched);
    }
  }
}

}  // namespace world
