#version 460
#extension GL_GOOGLE_include_directive : require
// Strips of the mirror's plane, each five times: as it is, and moved by a pixel and a half along both diagonals, so
// that no pixel on its edge is missed.
#include "render/raster/raster.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindMirrorStrips, std430) readonly buffer Strips { vec4 strips[]; };  // low and high, without the axis

void main() {
  const vec4 strip = strips[gl_InstanceIndex / 5];
  const int corner = gl_VertexIndex % 6, moved = gl_InstanceIndex % 5, axis = picture.light.y;
  const bool u = corner == 1 || corner == 3 || corner == 4, v = corner == 2 || corner == 4 || corner == 5;
  vec3 point;
  point[axis] = float(picture.light.z) - picture.fraction[axis];
  point[(axis + 1) % 3] = u ? strip.z : strip.x;
  point[(axis + 2) % 3] = v ? strip.w : strip.y;
  const float w = dot(picture.clip_w.xyz, point);
  vec2 aside = vec2(0);
  if (moved > 0) aside = vec2((moved & 1) != 0 ? 3.0 : -3.0, (moved & 2) != 0 ? 3.0 : -3.0) / picture.screen.xy;
  gl_Position = vec4(vec2(dot(picture.clip_x.xyz, point), dot(picture.clip_y.xyz, point)) + aside * w, 0.0, w);
}
