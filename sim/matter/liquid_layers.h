/// Several liquids in one place: what is denser sinks under what is lighter. Internal to sim/matter.
///
/// A voxel holds one liquid, so that they change places as whole voxels, in turns:
///   ticks 0, 2 of four  with the voxel below, where that is lighter: every second pair of a column, by the tick
///   tick 1  from the foot of a column, where something as dense presses on the voxel from above, with the voxel on one
///           side, by a hash of the tick, where that is lighter: every second pair along the axis
///   tick 3  from its top, where the way on that side goes down within 7 voxels of lighter liquid
/// Pairs have no voxel in common: the order doesn't matter. Exchanges lower what lies too high, or bring it nearer to
/// where it will: they end.
/// error  the boundary between two liquids at rest slopes by one voxel in eight at most; it isn't always level
/// cost   nothing in a world of one liquid; else a look at each awake page, and some us for one with two liquids
#pragma once

#include <span>
#include <vector>

#include "sim/matter/changed_voxels.h"

namespace sim {

class LiquidLayers {
 public:
  /// Exchanges; pages that may go on next time stay awake for the rule. Returns the voxels that changed.
  uint64_t exchange(Cells& cells, std::span<const PageId> pages, size_t rule, uint64_t tick, uint64_t seed);

 private:
  struct Place {
    PageId page;
    int index;
  };
  struct Pair {
    Place a, b;
  };
  static Place beside(const Cells& cells, Place at, int face);
  /// kg/m^3 of the liquid there, 0 where there is none.
  static float density(const Cells& cells, Place at);
  static bool is_lighter(const Cells& cells, Place at, float than) {
    const float there = density(cells, at);
    return there > 0 && there < than;
  }
  enum class Way { none, foot, top };
  static Way way(const Cells& cells, Place from, float own, int face);
  static bool holds_two(const Cells& cells, PageId p);
  static uint64_t changes_around(const Cells& cells, PageId p);
  bool find_pairs(const Cells& cells, PageId p, uint64_t tick, uint64_t turn);

  /// A page that holds two liquids, and the changes in it and around it when it was looked at last: it is looked at
  /// again after any of them, as ways go further than what wakes a page.
  struct Mixed {
    PageId page;
    uint64_t changes;
  };
  std::vector<Mixed> mixed_;
  std::vector<uint8_t> is_mixed_;  // by page
  std::vector<PageId> list_;
  std::vector<Pair> pairs_;
  ChangedVoxels changed_;
};

}  // namespace sim
