// The ray of a fragment, for shaders that ask it exactly. Texels where they can be had: software reads a number of a
// uniform buffer lane by lane in a fragment shader, and four of a texel in half of that time.
#ifndef LOAM_RENDER_RASTER_FRAGMENT_RAY_GLSL_H
#define LOAM_RENDER_RASTER_FRAGMENT_RAY_GLSL_H
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecTexelRays) const bool kTexelRays = true;
layout(binding = kBindRays) uniform samplerBuffer rays;

/// Its component along the camera's direction is 1. Needs `picture`.
vec3 fragment_ray() {
  if (kTexelRays)
    return texelFetch(rays, 0).xyz + gl_FragCoord.x * texelFetch(rays, 1).xyz +
           gl_FragCoord.y * texelFetch(rays, 2).xyz;
  return picture.corner.xyz + gl_FragCoord.x * picture.step_x.xyz + gl_FragCoord.y * picture.step_y.xyz;
}

#endif
