/* A map of what a spot light meets first: how far its light gets along rays through the texels of a square before it.
 *
 *   place   of a direction from the light: texels along right and up
 *   lit     the part of the four texels around it whose light gets as far as the point, less a bias; as sun_map_lit()
 * source  as sun_map.shared.h */
#ifndef LOAM_RENDER_LIGHT_SPOT_MAP_SHARED_H
#define LOAM_RENDER_LIGHT_SPOT_MAP_SHARED_H
#include "render/light/sun_map.shared.h"
SHARED_NAMESPACE(render)

/* Wider cones than this have no map, since its texels would grow without bound: tan(80 degrees). */
SHARED_CONST float kWidestSpotMap = 5.67f;

/* Half the square's edge at distance 1: a texel more than the cone, so that its edge lies between texels. */
SHARED float spot_map_half(float tan_half_angle, float texels) { return tan_half_angle * (1.0f + 2.0f / texels); }

/* The ray through the middle of a texel; not of unit length: 1 along the axis. */
SHARED vec3 spot_map_ray(vec3 axis, vec3 right, vec3 up, float half_edge, float texels, vec2 texel) {
  vec2 at = ((texel + 0.5f) * (2.0f / texels) - 1.0f) * half_edge;
  return axis + at.x * right + at.y * up;
}

/* In texels, from the middle of the first. `direction`: from the light; before it. */
SHARED vec2 spot_map_place(vec3 direction, vec3 axis, vec3 right, vec3 up, float half_edge, float texels) {
  vec2 at = vec2(dot(direction, right), dot(direction, up)) / max(dot(direction, axis), 1e-6f);
  return (at / half_edge + 1.0f) * (0.5f * texels) - 0.5f;
}

/* Width of a texel at a distance, m. */
SHARED float spot_map_texel(float half_edge, float texels, float distance) {
  return 2.0f * half_edge * distance / texels;
}

SHARED_NAMESPACE_END
#endif
