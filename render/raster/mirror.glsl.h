// A picture that is seen in a plane shows nothing from behind it.
#ifndef LOAM_RENDER_RASTER_MIRROR_GLSL_H
#define LOAM_RENDER_RASTER_MIRROR_GLSL_H
#include "render/raster/transparency.shared.h"

layout(constant_id = kSpecClips) const bool kClips = false;

/// hit: relative to the camera. What lies in the plane is kept.
bool behind_mirror(vec3 hit) {
  if (!kClips) return false;
  const int axis = picture.light.y;
  const float height = hit[axis] - (float(picture.light.z) - picture.fraction[axis]);
  return height * float(picture.light.w) < -1e-3;
}

#endif
