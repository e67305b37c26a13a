/// What each block is to heat, and the unit of it.
///
/// A voxel's heat is what it holds beyond a voxel of its block as it is born: 0 is the world's temperature at rest
/// (temperature_k of a scene, 288.15 K by default), and 1400 K for lava. So
/// heat needs no storage where nothing was heated or cooled, and moves along with what holds it.
///
/// The unit is 20 J for all, so that energy is exact: a voxel of any block holds 0..6000 K in 32 bits (the heaviest,
/// 6.3 MJ/K, 6817 K above its birth). It is worth 17 mK in a voxel of air, 61 mK in fire, 5 µK in water, 6 µK in iron.
///
/// A block that melts or boils stays at that temperature until it holds the heat of the change too (enthalpy method).
/// source Vaughan Voller, Mark Cross. Accurate solutions of moving boundary problems using the enthalpy method. 1981
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "sim/matter/cells.h"
#include "sim/matter/reactions.h"

namespace sim {

inline constexpr double kHeatUnitJ = 20;

/// Temperatures are in K above rest.
struct Thermal {
  float born = 0;
  float capacity = 1;              // units of heat a K and full voxel
  float conductivity = 1;          // W/(m K)
  float low = -1e9f, high = 1e9f;  // where it freezes or condenses; where it melts or boils
  float ignition = 1e9f;
};

/// The numbers of one voxel: its temperature is clamp(heat * inverse + born, low, high).
struct ThermalVoxel {
  float inverse = 0;  // K a unit
  float born = 0, low = 0, high = 0;
  float resistance = 1;  // of half a voxel, K/W
  float share = 0;       // units a K: a sixth of its capacity
  friend bool operator==(const ThermalVoxel&, const ThermalVoxel&) = default;
};

class ThermalTraits {
 public:
  /// `rest_k`: of the world where nothing heats or cools it, K.
  ThermalTraits(const world::BlockPalette& palette, const std::vector<Reaction>& more, double rest_k = kRestKelvin);
  double rest_k() const { return rest_k_; }
  /// Takes blocks in that the palette has gained.
  void follow();
  const Thermal& operator[](world::BlockId id) const { return traits_[id]; }
  /// Of a voxel with so much of a fluid (the rest is air), or a full one.
  ThermalVoxel voxel(world::BlockId id, int amount = kFullVoxel) const;
  /// Units a K of such a voxel.
  double capacity(world::BlockId id, int amount = kFullVoxel) const {
    return 1.0 / static_cast<double>(voxel(id, amount).inverse);
  }
  /// What such a voxel holds at `kelvin`, in units.
  int64_t heat_at(world::BlockId id, int amount, double kelvin) const;
  /// The largest diffusivity of the palette's blocks, m^2/s. Not of those that are present: that would change in a
  /// tick.
  double largest_diffusivity() const { return largest_diffusivity_; }

 private:
  const world::BlockPalette* palette_;
  std::vector<Reaction> more_;
  double rest_k_;
  std::vector<Thermal> traits_;
  double largest_diffusivity_ = 0;
};

inline float temperature(const ThermalVoxel& v, int32_t heat) {
  const float t = static_cast<float>(heat) * v.inverse + v.born;
  return std::min(std::max(t, v.low), v.high);
}

/// By block: 1 where it is born warmer or colder than rest.
std::vector<uint8_t> blocks_out_of_rest(const world::BlockPalette& palette, double rest_k = kRestKelvin);

}  // namespace sim
