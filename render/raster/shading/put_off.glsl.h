// Lists of pixels, y * width + x in their band, for a dispatch over them alone: groups of 64, and how many pixels.
//   rays     are shaded as lit by the sun; a ray says whether they are
//   put_off  are shaded by themselves
#ifndef LOAM_RENDER_RASTER_SHADING_PUT_OFF_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_PUT_OFF_GLSL_H
#include "render/raster/raster.shared.h"

layout(binding = kBindSunRays, std430) buffer SunRays { uint sun_rays[]; };
layout(binding = kBindSunRaysDispatch, std430) buffer SunRaysDispatch { uint ray_groups, ray_y, ray_z, ray_count; };
layout(binding = kBindPutOff, std430) buffer PutOff { uint put_off[]; };
layout(binding = kBindPutOffDispatch, std430) buffer PutOffDispatch {
  uint put_off_groups, one_y, one_z, put_off_count;
};

void list_sun_ray(uint place) {
  const uint at = atomicAdd(ray_count, 1u);
  sun_rays[at] = place;
  if (at % (kShadeGroup * kShadeGroup) == 0u) atomicAdd(ray_groups, 1u);
}
void put_pixel_off(uint place) {
  const uint at = atomicAdd(put_off_count, 1u);
  put_off[at] = place;
  if (at % (kShadeGroup * kShadeGroup) == 0u) atomicAdd(put_off_groups, 1u);
}

#endif
