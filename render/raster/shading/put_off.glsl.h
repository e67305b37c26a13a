// The list of pixels, y * width + x, that are shaded by dispatches over them alone, in groups of 64. Counted beside
// them, for tests: pixels that cast a ray to the sun.
#ifndef LOAM_RENDER_RASTER_SHADING_PUT_OFF_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_PUT_OFF_GLSL_H
#include "render/gpu/time_slices.shared.h"
#include "render/raster/raster.shared.h"

layout(binding = kBindPutOff, std430) buffer PutOff { uint put_off[]; };
layout(binding = kBindPutOffDispatch, std430) buffer PutOffDispatch {
  ListHead put_off_list;
  uint put_off_slices[];
};

void put_pixel_off(uint place) {
  const uint at = atomicAdd(put_off_list.listed, 1u), group = at / (kShadeGroup * kShadeGroup);
  put_off[at] = place;
  if (at % (kShadeGroup * kShadeGroup) == 0u)
    atomicAdd(put_off_slices[kSliceWords * (group / put_off_list.slice_groups)], 1u);
}

#endif
