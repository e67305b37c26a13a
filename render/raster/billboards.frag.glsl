#version 460
#extension GL_GOOGLE_include_directive : require
// Which face a pixel sees on a plane of a billboard cloud. Where the pixel's own ray meets the plane of that face near
// by, it sees it there; else where the billboard is.
#include "render/raster/billboards.shared.h"
#include "render/raster/impostors.shared.h"
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecBlends) const bool kBlends = false;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindBillboardTexels) uniform usamplerBuffer texels_of;

#include "render/raster/fragment_ray.glsl.h"

layout(location = 0) flat in vec4 normal;
layout(location = 1) flat in vec4 along_u;
layout(location = 2) flat in vec4 along_v;
layout(location = 3) flat in ivec4 tree;
layout(location = 4) flat in uvec4 texels;
layout(location = 5) flat in vec4 fraction;
layout(location = 6) flat in vec3 fraction_rest;
layout(location = 0) out uvec2 seen_out;

void main() {
  if (kBlends && !chunk_shown(uint(tree.w), floor(gl_FragCoord.xy))) discard;
  const vec3 ray = fragment_ray();
  const float towards = dot(normal.xyz, ray);
  if (towards == 0.0) discard;  // seen edge on
  const float there = normal.w / towards;
  const vec2 at = floor((there * vec2(dot(along_u.xyz, ray), dot(along_v.xyz, ray)) - vec2(along_u.w, along_v.w)) /
                        kBillboardTexel);
  if (any(lessThan(at, vec2(0))) || any(greaterThanEqual(at, vec2(texels.yz)))) discard;
  const uint side = towards < 0.0 ? 0u : texels.y * texels.z;
  const uint texel = texelFetch(texels_of, int(texels.x + side + uint(at.y) * texels.y + uint(at.x))).x;
  if (texel == 0u) discard;
  const uint face = texel >> kTexelFaceShift & 7u, axis = face >> 1;
  const int plane = tree[axis] + int(texel >> kTexelPlaneShift);
  const float on_plane = (float(plane) - fraction[axis] - fraction_rest[axis]) / ray[axis];
  const bool faces_eye = (face & 1u) != 0u ? ray[axis] < 0.0 : ray[axis] > 0.0;
  const bool meets = faces_eye && abs(on_plane - there) <= 2.0 * uintBitsToFloat(texels.w);
  const float t = meets ? on_plane : there;
  seen_out = uvec2(seen_block(texel) | face << kSeenFaceShift | kSeenPlaced, floatBitsToUint(t));
  gl_FragDepth = fraction.w / t;
}
