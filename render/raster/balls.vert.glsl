#version 460
#extension GL_GOOGLE_include_directive : require
// Particles: a rectangle around each ball on all of its way; the whole picture where the camera is near or in it.
#include "render/raster/raster.shared.h"
#include "render/inhabitants.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindBalls, std430) readonly buffer Balls { DrawnBall balls[]; };
layout(location = 0) flat out int ball;

/// Of a ball at rest, the rectangle's corners: low, high. All of the picture where it is near.
vec4 rectangle_of(vec3 middle, float radius) {
  const float depth = dot(picture.clip_w.xyz, middle), near = depth - radius;
  if (near <= 0.01 * radius) return vec4(-1, -1, 1, 1);
  // A point p of the ball lies at (clip . p) / (its depth), with |clip . (p - middle)| <= |clip| r, and a depth from
  // near to depth + r.
  const vec2 at = vec2(dot(picture.clip_x.xyz, middle), dot(picture.clip_y.xyz, middle));
  const vec2 wide = radius * vec2(length(picture.clip_x.xyz), length(picture.clip_y.xyz));
  return vec4(min((at - wide) / near, (at - wide) / (depth + radius)),
              max((at + wide) / near, (at + wide) / (depth + radius)));
}

void main() {
  ball = gl_InstanceIndex;
  const vec4 middle = balls[gl_InstanceIndex].middle, way = balls[gl_InstanceIndex].way;
  const vec2 corner = vec2((gl_VertexIndex & 1) == 0 ? 0 : 1, (gl_VertexIndex & 2) == 0 ? 0 : 1);
  vec4 reach = rectangle_of(middle.xyz - 0.5 * way.xyz, middle.w);
  if (way.w != 0.0) {
    const vec4 to = rectangle_of(middle.xyz + 0.5 * way.xyz, middle.w);
    reach = vec4(min(reach.xy, to.xy), max(reach.zw, to.zw));
  }
  gl_Position = vec4(mix(reach.xy, reach.zw, corner), 0.5, 1);
}
