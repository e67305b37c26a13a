// What is seen where no surface is.
#ifndef LOAM_RENDER_RASTER_SHADING_SKY_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SKY_GLSL_H
#include "render/raster/shading/luminaires.glsl.h"
#include "world/media/medium.shared.h"

layout(constant_id = kSpecSkyModel) const bool kSkyModel = false;
layout(constant_id = kSpecCloudSteps) const int kCloudSteps = 0;
layout(constant_id = kSpecCloudLightSteps) const int kCloudLightSteps = 0;
layout(constant_id = kSpecCloudsBefore) const bool kCloudsBefore = false;

/// Of the sky that lights surfaces. `direction`: unit.
vec3 sky_radiance(vec3 direction) {
  if (kSkyModel) return sky_model_radiance(picture.sky, direction);
  return linear_sky_radiance(picture.sky_zenith.rgb, picture.sky_horizon.rgb, picture.sky_ground.rgb, direction.y);
}

/// Clouds on t metres of a ray from a place, which is relative to the camera's voxel.
CloudView clouds_up_to(vec3 from, vec3 direction, float t) {
  return clouds_along(picture.clouds, from, direction, sky_radiance(direction), kCloudSteps, kCloudLightSteps, t);
}
/// SkyView::behind_clouds() of the sky.
vec3 behind_clouds(vec3 seen, vec3 from, vec3 direction) {
  return clouds_laid_over(clouds_up_to(from, direction, kMediumFar), vec3(1.0), vec3(0.0), seen);
}

/// SkyView::mirrored()
vec3 mirrored_sky(vec3 from, vec3 direction) {
  const vec3 sky = sky_radiance(direction);
  if (kCloudSteps > 0) return behind_clouds(sky, from, direction);
  return sky;
}

/// With the disks of the sun and the moon, stars, and luminaires at no place: seen_far() of render/trace/transport.h.
vec3 seen_far(vec3 direction) {
  vec3 seen = sky_radiance(direction);
  if (kSkyModel) seen += sky_model_disks(picture.sky, direction);
  if (kLuminaires)
    for (uint i = 0u; i < picture.luminaires_seen.w; ++i)
      seen += far_luminaire_radiance(
          picture.luminaires.x + lighting_word(picture.luminaires_seen.z + i) * kLuminaireWords, direction);
  return seen;
}

#endif
