// What is seen where no surface is.
#ifndef LOAM_RENDER_RASTER_SHADING_SKY_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SKY_GLSL_H
#include "render/raster/shading/luminaires.glsl.h"

layout(constant_id = kSpecSkyModel) const bool kSkyModel = false;

/// Of the sky that lights surfaces. `direction`: unit.
vec3 sky_radiance(vec3 direction) {
  if (kSkyModel) return sky_model_radiance(picture.sky, direction);
  return linear_sky_radiance(picture.sky_zenith.rgb, picture.sky_horizon.rgb, picture.sky_ground.rgb, direction.y);
}

/// With the disks of the sun and the moon, stars, and luminaires at no place: seen_far() of render/trace/transport.h.
vec3 seen_far(vec3 direction) {
  vec3 seen = sky_radiance(direction);
  if (kSkyModel) seen += sky_model_disks(picture.sky, direction);
  if (kLuminaires)
    for (uint i = 0u; i < picture.luminaires_seen.w; ++i)
      seen += far_luminaire_radiance(picture.luminaires.x + lighting[picture.luminaires_seen.z + i] * kLuminaireWords,
                                     direction);
  return seen;
}

#endif
