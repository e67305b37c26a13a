/// Blocks and skies for tests of flux.
#pragma once

#include <string>

#include "world/world.h"

namespace sim {

inline world::Block matte(const std::string& name, float r, float g, float b) {
  world::Block block;
  block.name = name;
  block.albedo = {r, g, b};
  return block;
}

inline world::Environment night() {
  world::Environment e;
  e.sun_irradiance = {0, 0, 0};
  e.sky_zenith = e.sky_horizon = e.sky_ground = {0, 0, 0};
  return e;
}

}  // namespace sim
