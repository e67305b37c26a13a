/// What changes places as a whole because of gases. Internal to sim/matter.
///
/// A gas under a liquid, or under a denser gas, changes places with it, with all that both voxels hold. So does a gas
/// beside a liquid that could fall there: one under other liquid, or at the edge of the solid that bears it. The
/// topmost layer of a liquid is borne by the gas beside it.
///
/// Pairs of even ticks are vertical, by turns from even and from odd heights; those of odd ticks lie along x or z, and
/// begin at even or odd places, as a hash of seed and tick says. So no voxel is in two.
#pragma once

#include <span>
#include <vector>

#include "sim/matter/changed_voxels.h"
#include "sim/matter/rule.h"

namespace sim {

enum class FluidRole : uint8_t { other, open, gas, liquid };  // open: air
struct FluidBlocks {                                          // by block
  std::vector<FluidRole> roles;
  std::vector<float> densities;  // kg/m^3
};

/// Where a page holds gases, and liquids.
struct FluidMasks {
  uint32_t changes = 0;  // of the content, when they were made
  bool ready = false, wanted = false;
  world::LeafPos pos;
  world::LeafMask liquid, gas;
  std::vector<std::pair<world::BlockId, world::LeafMask>> gases;
};

class GasSwaps {
 public:
  /// `rule`: whose awake set it fills.
  explicit GasSwaps(size_t rule) : rule_(rule) {}
  /// Of pages with ids, whose neighbours are open; `met`: gases and liquids that may be there. Returns the pages in
  /// which something changed, and tells cells.stir() of them; pages in which something may change in some tick stay
  /// awake.
  const std::vector<PageId>& step(Cells& cells, const Tick& tick, std::span<const PageId> pages,
                                  std::span<const world::BlockId> met, const FluidBlocks& blocks,
                                  uint64_t& voxels_changed);

 private:
  struct Swap {
    PageId p, q;
    int i, j;
  };
  void find_fluids(Cells& cells, std::span<const PageId> pages, std::span<const world::BlockId> met);
  bool find(const Cells& cells, PageId p, const Tick& tick, std::vector<Swap>& swaps) const;
  FluidRole role(world::BlockId id) const { return blocks_->roles[id]; }

  const size_t rule_;
  const FluidBlocks* blocks_ = nullptr;   // of this step
  std::vector<FluidMasks> fluids_;        // by page
  std::vector<PageId> stale_;             // those of which masks are to be made
  std::vector<std::vector<Swap>> swaps_;  // by page of the step
  std::vector<uint8_t> may_swap_;
  ChangedVoxels changed_;
};

}  // namespace sim
