/// What surrounds a world: the sun and the sky, in SI units, three bands, linear; and how warm it is at rest.
#pragma once

#include "world/scenes/clouds.h"
#include "world/space/world_point.h"
#include "world/units/quantity.h"

namespace world {

constexpr double kHighestTemperature = 6000;  // K; above all that blocks know of: rock boils at 3000

/// A directional sun, and a hemisphere sky whose radiance goes linearly with the cosine from the zenith; below the
/// horizon it goes over into the ground's: linear_sky.shared.h.
struct Environment {
  Vec3d sun_direction = glm::normalize(Vec3d(0.45, 0.72, 0.36));  // towards the sun, unit length
  Irradiance3 sun_irradiance{560.0f, 520.0f, 450.0f};             // W/m^2 on a surface that faces the sun
  Radiance3 sky_zenith{10.0f, 22.0f, 54.0f};
  Radiance3 sky_horizon{36.0f, 50.0f, 70.0f};
  // Sunlit land of albedo 1/4 in haze: what lies beyond a world, far below its horizon, and the light that it sends up.
  Radiance3 sky_ground{35.0f, 46.0f, 61.0f};
  Kelvin temperature{288.15};  // of all matter at rest, in (0, kHighestTemperature]; at first the standard atmosphere's
  Clouds clouds;

  friend bool operator==(const Environment&, const Environment&) = default;
};

}  // namespace world
