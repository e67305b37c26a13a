/* A map of what the sun sees first: how far its light gets along each of many parallel rays, and what that says of a
 * point.
 *
 *   place   of a point p, relative to the map's corner: texels along u and v, metres along w, the way of the light
 *   lit     the part of four texels around it, weighed bilinearly, whose light gets as far as the point, less a bias
 *   bias    what the depth of a plane may differ by over the width of those texels: texel * tan of the angle between
 *           its normal and the light, and half of that again where the two lie askew to the map's axes
 *
 * source  Lance Williams. Casting Curved Shadows on Curved Surfaces. 1978
 *         William Reeves, David Salesin, Robert Cook. Rendering Antialiased Shadows with Depth Maps. 1987 (the mean of
 *         comparisons, not of depths)
 */
#ifndef LOAM_RENDER_LIGHT_SUN_MAP_SHARED_H
#define LOAM_RENDER_LIGHT_SUN_MAP_SHARED_H
#include "world/base/shared.h"
SHARED_NAMESPACE(render)

struct SunMapFrame {
  vec4 u, v, w;  // unit axes; in u.w and v.w what is subtracted from texels, in w.w the texel, m
  ivec4 low;     // voxel at the map's corner
  ivec4 size;    // x, y: texels
};

SHARED vec3 sun_map_place(SHARED_IN(SunMapFrame) frame, vec3 p) {
  return vec3(dot(p, vec3(frame.u)) / frame.w.w - frame.u.w, dot(p, vec3(frame.v)) / frame.w.w - frame.v.w,
              dot(p, vec3(frame.w)));
}

/// How far before a point light may end and still reach it; `cosine` is that of its surface's normal with the sun.
SHARED float sun_map_bias(float texel, float cosine) {
  float tangent = sqrt(max(1.0f - cosine * cosine, 0.0f)) / max(cosine, 1e-3f);
  return texel * (1.5f * tangent + 0.1f) + 1e-3f;
}

/// The same for the mean of `filter` places a side: the plane's depth differs by more over their width.
SHARED float sun_map_filtered_bias(float texel, float cosine, int filter_size) {
  return filter_size <= 1 ? sun_map_bias(texel, cosine)
                          : sun_map_bias(texel * (1.0f + 0.5f * float(filter_size - 1)), cosine);
}

/// Depths of four texels, and where the point lies between their middles.
SHARED float sun_map_lit(vec4 depths, vec2 between, float reach) {
  float a = depths.x >= reach ? 1.0f : 0.0f, b = depths.y >= reach ? 1.0f : 0.0f;
  float c = depths.z >= reach ? 1.0f : 0.0f, d = depths.w >= reach ? 1.0f : 0.0f;
  return mix(mix(a, b, between.x), mix(c, d, between.x), between.y);
}

SHARED_NAMESPACE_END
#endif
