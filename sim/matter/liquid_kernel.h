/// The liquid rule on the amounts of one page: what flows out of each voxel, and what is left. Internal to sim/matter.
///
/// Amounts are integers in units of 1/4096 of a voxel. A tick of one liquid has two rounds, each of flows that are
/// found from the state before it, then taken from one voxel and given to the next: nothing is lost, in any order.
///
///   down   as much as fits under it: min(m, full - m below)
///   sides  from a voxel that is borne (below it is full, or nothing can enter), to each of the four sides that holds
///          less: a share of the difference, rounded down, but up for one of the four sides, chosen by a hash; at most
///          a quarter of what fits. What differs by one unit is level.
///
/// The share is 1/5, at which no voxel ends below or above all of its neighbours, or less for what is viscous: a layer
/// of depth h spreads by its own weight with the diffusivity g rho h^3 / (3 mu).
/// source Herbert Huppert. The propagation of two-dimensional and axisymmetric viscous gravity currents over a rigid
///        horizontal surface. 1982, eq. 2.4 (lubrication)
#pragma once

#include <array>
#include <cstdint>

#include "sim/matter/cells.h"
#include "sim/matter/sides.h"

namespace sim {

/// In place of an amount: nothing of this liquid can enter.
inline constexpr uint16_t kNoEntry = 0xffff;

/// The amounts of one liquid in a page and in the voxels beside it, by index_in_leaf; kNoEntry where it can't go.
struct LiquidView {
  alignas(64) uint16_t own[world::kLeafVoxels];
  alignas(64) uint16_t below[64], side[kSides][64];  // of the neighbours' voxels that touch the page
};
/// Index of a voxel of a side among 64: y * 8 + z beside x, x * 8 + y beside z; x * 8 + z below.
constexpr int beside_x(int index) { return index & 63; }
constexpr int beside_z(int index) { return index >> 3; }
constexpr int beside_y(int index) { return (index >> 6) << 3 | (index & 7); }

struct LiquidFlow {
  alignas(64) uint16_t down[world::kLeafVoxels], side[kSides][world::kLeafVoxels];  // out of each voxel
};

/// How a liquid spreads: its share of a difference, of 65536, by amount / 64.
struct Spread {
  std::array<uint16_t, kFullVoxel / 64 + 1> share;
  uint16_t film = 0;  // a voxel with less wets no dry one
  bool even = false;  // all shares but the first are equal
};
Spread spread_of(double density, double viscosity_pa_s, double tick_s, int film);

/// Returns whether anything flows.
bool flow_down(const LiquidView& view, LiquidFlow& flow);
/// Whether anything flows; and whether anything would, if its turn came.
struct SideFlow {
  bool flows = false, restless = false;
};
SideFlow flow_sideways(const LiquidView& view, const Spread& spread, uint64_t hash, LiquidFlow& flow);
/// Of 512 ids and amounts (null: all are full): voxels full of the liquid, with less, with at least `most` and less
/// than full, and of air.
struct LiquidMasks {
  world::LeafMask full, part, most, air;
};
LiquidMasks masks_of(const world::BlockId* blocks, const uint16_t* amounts, world::BlockId liquid, uint16_t most);
/// Whether any of 512 ids is that one.
bool holds_block(const world::BlockId* blocks, world::BlockId block);

/// What flows into voxels of the page from beyond it, by the same index as LiquidView's; zeros where nothing does.
struct LiquidInflow {
  alignas(64) uint16_t above[64] = {}, side[kSides][64] =
                                           {};  // side[d]: by sliding to d, out of the page on the other side
};
/// own[v] less what flows out and with what flows in; returns the voxels that changed. No voxel's amount is kNoEntry
/// where something flows.
world::LeafMask apply_down(const LiquidFlow& flow, const LiquidInflow& inflow, uint16_t* own);
world::LeafMask apply_sideways(const LiquidFlow& flow, const LiquidInflow& inflow, uint16_t* own);

}  // namespace sim
