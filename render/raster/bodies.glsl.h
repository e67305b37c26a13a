// Bodies: before what the first pass saw they are in the depth image alone; rays look for them among all.
#ifndef LOAM_RENDER_RASTER_BODIES_GLSL_H
#define LOAM_RENDER_RASTER_BODIES_GLSL_H
#include "render/inhabitants.shared.h"
#include "render/raster/shading/picture.glsl.h"
#include "render/raster/transparency.shared.h"

layout(constant_id = kSpecBodies) const bool kBodies = false;
layout(binding = kBindDepth) uniform texture2D seen_depth_image;
layout(binding = kBindBoxes, std430) readonly buffer Boxes { DrawnBox boxes[]; };

/// t of a body before what a pixel's ray ends on at `t`; else `t`. Depths are near plane / t, but for rounding.
float body_t(ivec2 pixel, float t) {
  if (!kBodies) return t;
  const float depth = texelFetch(seen_depth_image, pixel, 0).x;
  const float on_body = depth > 0.0 ? picture.fraction.w / depth : 1e30;
  return on_body < t * (1.0 - 1e-4) ? on_body : t;
}

/// A body that a ray meets.
struct BodyMet {
  float t;  // 1e30: none
  vec3 radiance;
};
/// The first along a unit direction from a point of a voxel.
BodyMet first_body(ivec3 start, vec3 fraction, vec3 direction) {
  BodyMet first;
  first.t = 1e30;
  first.radiance = vec3(0);
  const vec3 from =
      vec3(start - picture.camera_voxel.xyz) + (fraction - picture.fraction.xyz - picture.fraction_rest.xyz);
  for (int i = 0; i < boxes.length(); ++i) {
    const BoxHit met = meet_box(boxes[i].low.xyz - from, boxes[i].high.xyz - from, direction);
    if (!(met.distance > 0.0 && met.distance < first.t)) continue;
    first.t = met.distance;
    first.radiance = boxes[i].radiance[met.face].rgb;
  }
  return first;
}

#endif
