#version 460
#extension GL_GOOGLE_include_directive : require
// Which face a pixel sees on an impostor. The pixel's own ray meets the plane of that face; where this is far from where
// the texel's ray met it, as on a plane that is seen edge on, the texel's distance stands instead.
#include "render/raster/impostors.shared.h"
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecBlends) const bool kBlends = false;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindImpostorTexels) uniform usamplerBuffer texels;

#include "render/raster/fragment_ray.glsl.h"

layout(location = 0) flat in vec4 row_x;
layout(location = 1) flat in vec4 row_y;
layout(location = 2) flat in vec4 row_w;
layout(location = 3) flat in vec4 depth;
layout(location = 4) flat in ivec4 chunk;
layout(location = 5) flat in uvec4 first;
layout(location = 6) flat in vec4 fraction;
layout(location = 7) flat in vec3 fraction_rest;
layout(location = 0) out uvec2 seen_out;

void main() {
  if (kBlends && !chunk_shown(uint(chunk.w), floor(gl_FragCoord.xy))) discard;
  const vec3 pixel = vec3(gl_FragCoord.xy, 1);
  const vec2 at = floor(vec2(dot(row_x.xyz, pixel), dot(row_y.xyz, pixel)) / dot(row_w.xyz, pixel));
  if (any(lessThan(at, vec2(0))) || any(greaterThanEqual(at, vec2(first.yz)))) discard;
  const uvec2 texel = texelFetch(texels, int(first.x + uint(at.y) * first.y + uint(at.x))).xy;
  if (texel.x == 0u) discard;
  const uint face = texel.x >> kTexelFaceShift & 7u, axis = face >> 1;
  const int level = chunk.w & int(kChunkLevel);
  const int plane = chunk[axis] + (int(texel.x >> kTexelPlaneShift) << level);
  const vec3 ray = fragment_ray();
  const float on_plane = (float(plane) - fraction[axis] - fraction_rest[axis]) / ray[axis];
  const float there = (depth.x + depth.y * (at.x + 0.5) + depth.z * (at.y + 0.5)) * row_x.w / uintBitsToFloat(texel.y) -
                      depth.w;
  const bool meets = abs(on_plane - there) <= 0.0625 * there;
  const float t = meets ? on_plane : there;
  seen_out = uvec2(seen_block(texel.x) | face << kSeenFaceShift | uint(level) << kSeenLevelShift |
                       (meets ? 0u : kSeenPlaced),
                   meets ? uint(plane) : floatBitsToUint(t));
  gl_FragDepth = fraction.w / t;
}
