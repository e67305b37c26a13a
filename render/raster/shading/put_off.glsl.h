// The list of pixels, y * width + x, that are shaded by a dispatch over them alone: groups of 64, and how many pixels.
// Beside it, for tests: how many pixels cast a ray to the sun.
#ifndef LOAM_RENDER_RASTER_SHADING_PUT_OFF_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_PUT_OFF_GLSL_H
#include "render/raster/raster.shared.h"

layout(binding = kBindPutOff, std430) buffer PutOff { uint put_off[]; };
layout(binding = kBindPutOffDispatch, std430) buffer PutOffDispatch {
  uint put_off_groups, one_y, one_z, put_off_count, sun_ray_count;
};

void put_pixel_off(uint place) {
  const uint at = atomicAdd(put_off_count, 1u);
  put_off[at] = place;
  if (at % (kShadeGroup * kShadeGroup) == 0u) atomicAdd(put_off_groups, 1u);
}

#endif
