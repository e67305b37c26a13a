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
/// A passage that fills leaves no further than their walls is followed beyond the tile, and what lies at its other end:
/// up to 1024 leaves, and half a kilometre up or down.
///
/// What a round does follows from how things lie before it, not from who was asked first, or at all: a body that is
/// level may be left out. So a voxel is a top of one body only, whatever else is beside it: of the one below it, else
/// of the first of those at its sides, in an order that the round draws. Nothing is stored before the round ends. Where
/// a passage makes a body a part of two tiles, the later one waits for the next round, and every second pair of rounds
/// begins with the last tile.
///
/// A narrow mouth below a wide basin would give no more than what flows off its own voxels to the sides: where the
/// difference is two voxels and more, a top that has become full lifts liquid into the air above it, up to two voxels.
///
/// cost   about 0.2 us a leaf of the body, and 30 ns for each of its tops
/// error  bodies that are joined by wide passages longer than a tile, full to the ceiling, don't communicate; what lies
///        open levels out across tiles over several rounds
/// source Blaise Pascal's law; the pairing is ours
#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include "sim/matter/liquid_heat.h"
#include "sim/matter/liquid_pages.h"
#include "world/base/function_ref.h"
#include "world/store/leaf_flood.h"

namespace sim {

/// A round of levelling over the tiles that hold one of the list. Returns, for each of it, whether something moved in a
/// body that it holds a part of; the pages of moved voxels are stored and stirred.
class LiquidLevels {
 public:
  struct Result {
    uint64_t voxels_changed = 0;
    std::vector<uint8_t> moved;  // by entry of the list
  };
  /// Bodies that hold a part of a page for which `is_wavy` says so are left alone. What moves takes its `heat` along:
  /// all that the tops of a body give is shared among those that take.
  const Result& level(Cells& cells, LiquidPages& pages, LiquidHeat& heat, std::span<const PageId> list, uint64_t round,
                      uint64_t seed, world::FunctionRef<bool(PageId)> is_wavy);

 private:
  /// A voxel in which the surface of a body lies.
  struct Top {
    static constexpr unsigned kBeside = 1u << 15;  // of index: it lies beside the body, and only takes
    uint64_t key;    // its head, above 512 voxels under the tile's floor in units of amount, then bits of a hash
    PageId page;     // of the voxel
    uint16_t index;  // in its leaf, and kBeside
    uint16_t amount;
    int voxel() const { return index & 511; }
    bool is_beside() const { return index & kBeside; }
    int head() const { return static_cast<int>(key >> 22); }
  };
  struct Leaf {
    world::LeafPos place;  // in the tile, or beside it
    PageId page = kClosedPage;
    uint64_t read = 0;  // the tile, counted, for which it was read
    const LiquidMasks* masks = nullptr;
    world::LeafMask conduit, left;  // part, and of a body; full or conduit, and of no body so far
    world::LeafMask body;           // of the body in hand, where in_body is its number
    world::LeafMask full_body;      // and full
    uint64_t in_body = 0;
    bool moved = false;  // something moved in a body that has a part of it
  };
  /// A leaf in which tops may lie, and its place in the tile, or beside it.
  struct Surface {
    PageId page;
    world::LeafPos place;
  };
  /// Voxels that are tops of the body in hand, unless they are another's.
  struct Rim {
    Surface in;
    world::LeafMask above, beside;
  };
  /// Tops found by one task.
  struct Part {
    std::vector<Top> tops;
    std::vector<Rim> rims;
  };
  PageId page_beside(Cells& cells, PageId p, int dx, int dy, int dz) const;
  const LiquidMasks& masks_beside(Cells& cells, PageId p);
  world::LeafMask conduits(Cells& cells, PageId p);
  Leaf& leaf_at(Cells& cells, world::LeafPos low, size_t index);
  void flood(Cells& cells, world::LeafPos low, size_t start, const world::LeafMask& seed_mask);
  void find_tops(Cells& cells, world::LeafPos low, uint64_t round, uint64_t seed);
  size_t index_of(world::LeafPos place) const;
  size_t beside(Cells& cells, world::LeafPos low, size_t index, int face);
  const world::LeafMask* full_of_body(world::LeafPos place) const;
  bool in_body(size_t index) const { return leaves_[index].read == tile_ && leaves_[index].in_body == number_; }
  /// No part of the body in hand lies in the leaf.
  bool is_of_others(world::LeafPos place) const { return full_of_body(place) == nullptr; }
  void add_tops(const Surface& in, world::LeafPos low, uint64_t salt, const world::LeafMask& above,
                const world::LeafMask& beside, std::vector<Top>& tops) const;
  void tops_of_leaf(const Surface& in, world::LeafPos low, uint64_t salt, Part& into) const;
  void leave_to_others(Cells& cells, uint64_t turn, Rim& rim);
  void sort_by_key();
  void sort_tops(const Cells& cells);
  bool has_full_side(Cells& cells, PageId p, int index);
  bool level_body(Cells& cells);
  void change(Cells& cells, PageId p, int index, int by);
  void store_changes(Cells& cells);

  LiquidPages* pages_ = nullptr;
  LiquidHeat* heat_ = nullptr;
  std::vector<Leaf> leaves_;                                           // of a tile, 16^3, and those beyond it
  std::unordered_map<world::LeafPos, size_t, world::PosHash> beyond_;  // their indices
  std::vector<size_t> body_;                                           // indices in leaves_
  size_t beyond_body_ = 0;                                             // of them, those beyond the tile
  std::vector<Surface> surfaces_;
  std::vector<uint64_t> seen_;  // by page: the last body of which it is one
  world::LeafFront front_;
  std::vector<Part> parts_;  // of tops, by a few leaves
  std::vector<Top> tops_, scratch_;
  std::vector<uint64_t> order_;
  std::vector<PageId> touched_;
  std::vector<uint8_t> is_touched_;  // by page
  std::vector<uint64_t> moved_in_;   // by page: the last tile in which a body moved that has a part of it
  std::vector<std::pair<world::LeafPos, size_t>> by_tile_;
  Result result_;
  uint64_t tile_ = 0, number_ = 0;  // of the tile and the body in hand
};

}  // namespace sim
