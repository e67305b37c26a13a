// What is seen where no surface is.
#ifndef LOAM_RENDER_RASTER_SHADING_SKY_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SKY_GLSL_H
#include "render/raster/shading/picture.glsl.h"

/// `direction`: unit.
vec3 sky_radiance(vec3 direction) {
  if (direction.y < 0.0) return picture.sky_ground.rgb;
  return picture.sky_horizon.rgb + (picture.sky_zenith.rgb - picture.sky_horizon.rgb) * direction.y;
}

#endif
