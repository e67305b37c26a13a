#version 460
#extension GL_GOOGLE_include_directive : require
// Says which triangle a pixel sees, and how far its own ray goes to the triangle's plane.
#include "render/raster/raster.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };

#include "render/raster/mirror.glsl.h"

layout(location = 0) flat in uint triangle;
layout(location = 1) flat in vec4 plane;
layout(location = 2) flat in vec2 depths;
layout(location = 0) out uvec2 seen_out;

void main() {
  const vec3 ray = picture.corner.xyz + gl_FragCoord.x * picture.step_x.xyz + gl_FragCoord.y * picture.step_y.xyz;
  // Seen from its edge a triangle has any depth between those of its corners.
  const float t = clamp(plane.w / dot(plane.xyz, ray), depths.x, depths.y);
  if (behind_mirror(t * ray)) discard;
  seen_out = uvec2(kSeenMesh | triangle, floatBitsToUint(t));
}
