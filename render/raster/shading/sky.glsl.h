// What is seen where no surface is.
#ifndef LOAM_RENDER_RASTER_SHADING_SKY_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SKY_GLSL_H
#include "render/raster/shading/luminaires.glsl.h"

layout(constant_id = kSpecSkyModel) const bool kSkyModel = false;
layout(constant_id = kSpecCloudSteps) const int kCloudSteps = 0;
layout(constant_id = kSpecCloudLightSteps) const int kCloudLightSteps = 0;

/// Of the sky that lights surfaces. `direction`: unit.
vec3 sky_radiance(vec3 direction) {
  if (kSkyModel) return sky_model_radiance(picture.sky, direction);
  return linear_sky_radiance(picture.sky_zenith.rgb, picture.sky_horizon.rgb, picture.sky_ground.rgb, direction.y);
}

/// Clouds before what is seen of the sky from a place, which is relative to the camera's voxel: SkyView::clouded().
vec3 clouded(vec3 seen, vec3 sky, vec3 from, vec3 direction) {
  const vec4 layer = clouds_along(picture.clouds, from, direction, sky, kCloudSteps, kCloudLightSteps);
  return layer.w * seen + layer.rgb;
}

/// SkyView::mirrored()
vec3 mirrored_sky(vec3 from, vec3 direction) {
  const vec3 sky = sky_radiance(direction);
  if (kCloudSteps > 0) return clouded(sky, sky, from, direction);
  return sky;
}

/// With the disks of the sun and the moon, stars, clouds, and luminaires at no place: seen_far() of
/// render/trace/transport.h.
vec3 seen_far(vec3 from, vec3 direction) {
  const vec3 sky = sky_radiance(direction);
  vec3 seen = sky;
  if (kSkyModel) seen += sky_model_disks(picture.sky, direction);
  if (kCloudSteps > 0) seen = clouded(seen, sky, from, direction);
  if (kLuminaires)
    for (uint i = 0u; i < picture.luminaires_seen.w; ++i)
      seen += far_luminaire_radiance(picture.luminaires.x + lighting[picture.luminaires_seen.z + i] * kLuminaireWords,
                                     direction);
  return seen;
}

#endif
