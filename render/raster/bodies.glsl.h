// Bodies before what the first pass saw: they are in the depth image alone.
#ifndef LOAM_RENDER_RASTER_BODIES_GLSL_H
#define LOAM_RENDER_RASTER_BODIES_GLSL_H
#include "render/raster/shading/picture.glsl.h"
#include "render/raster/transparency.shared.h"

layout(constant_id = kSpecBodies) const bool kBodies = false;
layout(binding = kBindDepth) uniform texture2D seen_depth_image;

/// t of a body before what a pixel's ray ends on at `t`; else `t`. Depths are near plane / t, but for rounding.
float body_t(ivec2 pixel, float t) {
  if (!kBodies) return t;
  const float depth = texelFetch(seen_depth_image, pixel, 0).x;
  const float on_body = depth > 0.0 ? picture.fraction.w / depth : 1e30;
  return on_body < t * (1.0 - 1e-4) ? on_body : t;
}

#endif
