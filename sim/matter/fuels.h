/// What each block of a palette is to fire. Internal to sim/matter.
#pragma once

#include "sim/matter/thermal.h"

namespace sim {

struct FireTraits {
  bool fuel = false;   // a solid that ignites
  bool flame = false;  // the block fire
  bool air = false;    // flames may stand there: air, smoke
  bool feeds = false;  // lets air to a fire: air, fire, smoke
  bool hot = false;    // lights fuels beside it: lava, magma rock, embers, fire
  world::BlockId leaves = world::kAir;
  double energy = 0;  // units that a voxel gives in all
  double hours = 12;
  float ignition = 1e9f;  // K above rest
};

class FireBlocks {
 public:
  FireBlocks(const world::BlockPalette& palette, const std::vector<Reaction>& more, double rest_k = kRestKelvin);
  void follow();
  const FireTraits& operator[](world::BlockId id) const { return traits_[id]; }
  ThermalTraits& thermal() { return thermal_; }
  world::BlockId fire() const { return fire_; }
  world::BlockId smoke() const { return smoke_; }

 private:
  const world::BlockPalette* palette_;
  std::vector<FireTraits> traits_;
  ThermalTraits thermal_;
  world::BlockId fire_ = world::kAir, smoke_ = world::kAir;  // air where the palette has none
};

}  // namespace sim
