/// What one gas does in a page and a tick: amounts of the page and of the voxels beside it in, amounts out. Internal to
/// sim/matter.
///
/// Between two voxels that touch flows a whole number of units, which is a function of their two amounts a and b and of
/// nothing else: no hash, no turn. So both find the same flow, and nothing is lost in any order; a plume is as
/// symmetric as what is round it; and what is at rest stays so whether it is looked at or not.
///
///   diffusion  from more to less, by d = a - b:  min(ceil(d / 32) + p / 16, (d - 1) / 6), where p is the difference of
///              what is beyond a full voxel: pressure. Up to six units a voxel are level. A flow of less than d / 6
///              across all six sides at once makes the sum of squares smaller, so that none goes round for ever.
///   buoyancy   up where lighter than air, down where heavier: share * a * (full - b) / full. With it nothing is
///   rounded
///              up, and a unit of the net flow stays behind, for the same reason.
///   thinning   of a gas that mixes with air, what a voxel holds below kThinGas loses a part in a tick, and a unit at
///              least. That is the rule's to book.
///
/// share is the way of a parcel of a metre that rises at sqrt(g h (rho_air - rho) / rho_air), in voxels a tick; at most
/// 1/4. Diffusion by 1/32 of a difference is 0.6 m^2/s, that of slow turbulence. At rest a gas is a full layer under
/// the ceiling or on the floor, with a soft edge of 1/32 / share voxels (the Fermi function): both are the mean field
/// of an exclusion process with drift. source John Turner. Buoyancy Effects in Fluids. 1973, chapter 6; Frank Spitzer.
/// Interaction of Markov Processes. 1970
#pragma once

#include <algorithm>
#include <cstdint>

#include "sim/matter/cells.h"

namespace sim {

/// In place of an amount: none of this gas can enter. No voxel comes to hold so much: none becomes fuller than the
/// fullest beside it.
inline constexpr uint16_t kNoGas = 0xffff;
inline constexpr int kThinGas = kFullVoxel / 16;

/// Amounts of one gas by index_in_leaf, and of the neighbours' voxels that touch the page, by face, in the order of
/// their own leaf's indices.
struct GasView {
  alignas(64) uint16_t own[world::kLeafVoxels];
  alignas(64) uint16_t beside[6][64];
};

struct GasNature {
  uint16_t share = 0;     // of 65536, that go up or down in a tick
  bool rises = false;     // else it sinks
  uint16_t thins_of = 0;  // of 65536, what thin gas loses to the air in a tick; 0: it doesn't
};
/// Densities in kg/m^3 at rest; `thins_per_s`: part of thin gas.
GasNature gas_nature(double density, double air_density, double thins_per_s, double tick_s);

struct GasFlow {
  bool flows = false;    // anything, or is lost
  uint32_t reaches = 0;  // bit f: something crosses the page's face f, out or in
  uint32_t lost = 0;     // units, to the air
};
/// next: what each voxel holds then; kNoGas stays.
GasFlow flow_gas(const GasView& view, const GasNature& nature, uint16_t* next);

/// The amounts of a gas in a page of such ids; amounts null: all full. Voxels of air hold 0.
void view_gas(const world::BlockId* blocks, const uint16_t* amounts, world::BlockId gas, uint16_t* own);
/// Writes what became other than it was; returns which voxels did.
world::LeafMask store_gas(const uint16_t* own, const uint16_t* next, world::BlockId gas, world::BlockId* blocks,
                          uint16_t* amounts);

/// Where 512 ids are a block.
world::LeafMask mask_of(const world::BlockId* ids, world::BlockId block);

// ---- the same, a voxel at a time ---------------------------------------------------------------------------------

constexpr int gas_diffusion(int difference, int pressure) {
  if (difference <= 0) return 0;
  return std::min((std::min(difference + 31, 65535) >> 5) + (pressure >> 4), (difference - 1) * 10923 >> 16);
}

/// Units that go from a voxel with a to the one across `face` with b; below 0: that come.
constexpr int gas_flow(int a, int b, int face, const GasNature& nature) {
  if (a == kNoGas || b == kNoGas || (a == 0 && b == 0)) return 0;
  const int pressure = std::max(a - kFullVoxel, 0) - std::max(b - kFullVoxel, 0);
  const int even = gas_diffusion(a - b, pressure) - gas_diffusion(b - a, -pressure);
  if (face != world::kFacePosY && face != world::kFaceNegY) return even;
  const bool ahead = (face == world::kFacePosY) == nature.rises;  // b is where a's gas tends to
  const int source = ahead ? a : b, target = ahead ? b : a;
  const int room = std::max(kFullVoxel - 1 - target, 0) << 4;
  const int drift = static_cast<int>(
      (static_cast<uint32_t>(source) * static_cast<uint32_t>(room) >> 16) * static_cast<uint32_t>(nature.share) >> 16);
  if (drift == 0) return even;
  const auto along = [](int d, int p) { return (std::max(d, 0) >> 5) + (std::max(p, 0) >> 4); };
  const int sign = ahead ? 1 : -1;
  const int net = drift + along(sign * (a - b), sign * pressure) - along(sign * (b - a), -sign * pressure);
  return sign * (net > 1 ? net - 1 : net < -1 ? net + 1 : 0);
}

}  // namespace sim
