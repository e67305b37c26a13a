/// Communicating vessels: liquid under pressure rises in one place by what sinks in another.
///
/// Voxels that are full and touch are one body; its tops are where air or less than a full voxel lies above it, or
/// beside it. Voxels under a ceiling or under full ones that hold some of it are parts of the body too, and those that
/// are nearly full under others: that is how a pipe fills. A fall isn't: pressure doesn't act through it. It acts at
/// once through all of a body, so that its highest tops give to its lowest: half of the difference, at most a quarter
/// of a voxel each, then the next ones, until no two differ by more than one unit. Those beside it only take. Amounts
/// are moved, never made.
///
/// Bodies are looked at within tiles of 128^3 voxels, whose corners lie at multiples of 128 in one round and 64 beside
/// that in the next: so the cost of a bucket poured into the sea is bounded, and levels still agree across tiles.
///
/// cost   about 0.3 us a leaf of the body, and the sorting of its tops
/// error  bodies that are joined only by a full passage longer than a tile don't communicate; what lies open levels out
///        across tiles over several rounds
/// source Blaise Pascal's law; the pairing is ours
#pragma once

#include <span>
#include <vector>

#include "sim/matter/cells.h"

namespace sim {

/// A round of levelling over the tiles that hold one of the pages. Returns, for each page, whether something moved in
/// a body that it holds a part of; the pages of moved voxels are stirred.
class LiquidLevels {
 public:
  struct Result {
    uint64_t voxels_changed = 0;
    std::vector<uint8_t> moved;  // by entry of `pages`
  };
  Result level(Cells& cells, world::BlockId liquid, std::span<const PageId> pages, uint64_t round, uint64_t seed);

 private:
  struct Top {
    int32_t head_y = 0;      // of the voxel in which the surface lies
    int32_t amount = 0;      // in it
    uint64_t order = 0;      // by hash: between equals
    world::VoxelPos v;       // the voxel whose amount is `amount`; air has 0
    bool below_air = false;  // nothing lies in v: what is given comes from the full voxel under it
    bool beside = false;     // of v: it lies beside the body, and only takes
  };
  struct Leaf {
    PageId page = kClosedPage;
    uint64_t read = 0;                      // the tile, counted, for which it was read
    world::LeafMask full, part, most, air;  // part: less than full; most: three quarters of it; air: and nothing else
    world::LeafMask conduit, left;          // part, and of a body; full or conduit, and of no body so far
    world::LeafMask body;                   // of the body in hand, where in_body is its number
    uint64_t in_body = 0;
    bool moved = false;  // something moved in a body that has a part of it
  };
  void read(Cells& cells, world::BlockId liquid, Leaf& leaf);
  Leaf& leaf_at(Cells& cells, world::LeafPos low, world::LeafPos d);
  void find_tops(Cells& cells, world::LeafPos low, uint64_t round, uint64_t seed);
  bool level_body(Cells& cells, world::BlockId liquid, uint64_t& changed);

  std::vector<Leaf> leaves_;  // of a tile, 16^3
  std::vector<size_t> body_;  // indices in leaves_
  std::vector<Top> tops_, beside_;
  world::BlockId liquid_ = world::kAir;
  uint64_t tile_ = 0, number_ = 0;  // of the tile and the body in hand
};

}  // namespace sim
