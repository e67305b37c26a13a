/// A layer of clouds: lumps of droplets between two heights, endless to all sides.
#pragma once

#include <cstdint>

#include "world/space/world_point.h"

namespace world {

/// Lengths are in m, heights are y of the world.
struct Clouds {
  float cover = 0;           // share of the sky that they take, seen from far below, in [0, 1]; 0: there are none
  float height = 900;        // of their base
  float thickness = 250;     // of the layer, above 0
  float size = 700;          // of the largest lumps, above 0
  float extinction = 0.04f;  // 1/m, where they are densest
  Vec3d drift{9, 0, 4};      // m/s; y does nothing
  Vec3d drifted{0};          // m: where they are by now
  uint32_t seed = 1;

  friend bool operator==(const Clouds&, const Clouds&) = default;
};

}  // namespace world
