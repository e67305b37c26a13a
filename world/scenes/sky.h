/// The sky's radiance along a direction: what every model of light agrees on.
#pragma once

#include "world/scenes/environment.h"

namespace world {

/// `cosine` is the y component of the unit direction that looks at the sky.
inline Radiance3 sky_radiance(const Environment& e, double cosine) {
  if (cosine < 0) return e.sky_ground;
  return e.sky_horizon + (e.sky_zenith - e.sky_horizon) * static_cast<float>(cosine);
}

}  // namespace world
