/// The sky's radiance along a direction: what every model of light agrees on.
#pragma once

#include "world/scenes/environment.h"
#include "world/scenes/linear_sky.shared.h"

namespace world {

inline glm::vec3 vec3_of(const Radiance3& l) { return {l.r, l.g, l.b}; }

/// `cosine` is the y component of the unit direction that looks at the sky.
inline Radiance3 sky_radiance(const Environment& e, double cosine) {
  const glm::vec3 seen = shared::linear_sky_radiance(vec3_of(e.sky_zenith), vec3_of(e.sky_horizon),
                                                     vec3_of(e.sky_ground), static_cast<float>(cosine));
  return {seen.r, seen.g, seen.b};
}

}  // namespace world
