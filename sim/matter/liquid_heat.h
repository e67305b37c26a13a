/// Heat that moves with a liquid. Internal to sim/matter.
///
/// What flows out of a voxel takes the part of the voxel's heat that it is of the liquid there: heat * out / amount,
/// cut off towards 0. Heat counts from the temperature at which a block is born (thermal.h), so that what lava holds at
/// its birth is in its amount, and goes with it already; the sum of heats stays the same, to the unit. The air that
/// shares a voxel with a liquid has a 3000th of its capacity, and its heat goes along.
///
/// cost   nothing in a world without heat; else of each page of a movement a look whether it has heat, and of warm
///        voxels a flow once more, one by one
#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sim/matter/liquid_pages.h"

namespace sim {

class LiquidHeat {
 public:
  /// Of a round of falls or flows sideways (liquid_kernel.h) that was found, before the pages follow it: `moves` of
  /// `flowing`, of which those give whose gives is `round`.
  void fall(Cells& cells, const LiquidPages& pages, std::span<const PageId> flowing, std::span<const LiquidMove> moves,
            uint64_t round);
  void slide(Cells& cells, const LiquidPages& pages, std::span<const PageId> flowing, std::span<const LiquidMove> moves,
             uint64_t round, uint16_t film);

  /// Of liquid that goes from some voxels to others all at once: take() says what leaves a voxel, of how much there is,
  /// give() what comes to one, and settle() shares out what was taken by what was given.
  void take(Cells& cells, PageId p, int index, int amount, int there);
  void give(PageId p, int index, int amount);
  void settle(Cells& cells);

  /// Puts units into a voxel.
  void add(Cells& cells, PageId p, int index, int64_t units);

  /// Units that 32 bits didn't hold since this was asked last: not there any more.
  int64_t take_lost() { return std::exchange(lost_, 0); }

 private:
  struct Given {
    PageId page;
    int index, amount;
  };
  template <class Find>
  void carry(Cells& cells, std::span<const PageId> flowing, std::span<const LiquidMove> moves, Find find);
  static bool is_warm(const Cells& cells, PageId p);

  std::vector<std::unique_ptr<Cells::Heats>> changes_;  // by flowing page: what comes less what goes
  std::vector<uint8_t> warms_;                          // by flowing page
  std::vector<Given> given_;
  int64_t taken_ = 0;
  int64_t lost_ = 0;
};

}  // namespace sim
