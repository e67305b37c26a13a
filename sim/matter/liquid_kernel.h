/// The liquid rule on the amounts of one page: what flows through the faces of its voxels. Internal to sim/matter.
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
///
/// A page computes all flows through its faces, those into it too: both pages of a face find the same number. Pairs of
/// rows in which nothing can flow, because all is full or dry around, are only copied.
#pragma once

#include <array>
#include <cstdint>

#include "sim/matter/cells.h"
#include "sim/matter/sides.h"

namespace sim {

/// In place of an amount: nothing of this liquid can enter.
inline constexpr uint16_t kNoEntry = 0xffff;

/// What the rows of a page hold, two and two. Bit k: in rows y = 2k and 2k + 1.
struct LiquidRows {
  uint8_t wet = 0;   // something of the liquid
  uint8_t full = 0;  // no voxel has room for more of it
};

/// The amounts of a liquid in a page, by index_in_leaf; kNoEntry where it can't go. Of ids and amounts (null: all
/// fluids are full), or of a page without ids.
LiquidRows view_amounts(const world::BlockId* blocks, const uint16_t* amounts, world::BlockId liquid, uint16_t* own);
LiquidRows view_planes(const world::LeafMask& occupied, uint16_t* own);
LiquidRows rows_of(const uint16_t* own);

/// How a liquid spreads: its share of a difference, of 65536, by amount / 64.
struct Spread {
  std::array<uint16_t, kFullVoxel / 64 + 1> share;
  uint16_t film = 0;  // a voxel with less wets no dry one
  bool even = false;  // all shares but the first are equal
};
Spread spread_of(double density, double viscosity_pa_s, double tick_s, int film);

/// A page beside the one that is looked at, or itself.
struct LiquidPart {
  const uint16_t* own = nullptr;
  const uint16_t* push = nullptr;  // null: nothing flows out of it in this round
  LiquidRows rows;
};

/// How strongly each voxel pushes to the sides: its share, 0 where it isn't borne, and in the two highest bits the side
/// whose turn it is. Only in these pairs of rows.
void push_of(const uint16_t* own, const uint16_t* below, uint8_t rows, const Spread& spread, uint64_t hash,
             uint16_t* push);

struct LiquidMove {
  LiquidRows rows;        // after it
  bool changed = false;   // next is another state than own
  bool restless = false;  // sideways: something would flow out of it, if its turn came
  uint8_t out = 0;        // what flows out of the page: bit side, bit 4: below
};
inline constexpr uint8_t kOutBelow = 16;

/// A round downwards. `gives`: whether something flows out of the page, and out of that above it.
LiquidMove fall(const LiquidPart& page, const LiquidPart& below, const LiquidPart& above, bool gives, bool above_gives,
                uint16_t* next);
/// A round sideways.
LiquidMove slide(const LiquidPart& page, const LiquidPart (&sides)[kSides], uint16_t film, uint16_t* next);

/// Writes a page's amounts over ids and amounts, where the liquid may be. Returns the voxels that changed.
world::LeafMask write_amounts(const uint16_t* own, world::BlockId liquid, world::BlockId* blocks, uint16_t* amounts);

/// Of a page's amounts: voxels that are full, with less, with at least `most` and less than full, and empty.
struct LiquidMasks {
  world::LeafMask full, part, most, air;
};
void find_masks(const uint16_t* own, uint16_t most, LiquidMasks& masks);

}  // namespace sim
