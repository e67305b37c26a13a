#version 460
#extension GL_GOOGLE_include_directive : require
// Particles: a square around each ball; the whole picture where the camera is near or in it.
#include "render/raster/raster.shared.h"
#include "render/inhabitants.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindBalls, std430) readonly buffer Balls { DrawnBall balls[]; };
layout(location = 0) flat out int ball;

void main() {
  ball = gl_InstanceIndex;
  const vec4 middle = balls[gl_InstanceIndex].middle;
  const vec2 corner = vec2((gl_VertexIndex & 1) == 0 ? -1 : 1, (gl_VertexIndex & 2) == 0 ? -1 : 1);
  const float depth = dot(picture.clip_w.xyz, middle.xyz), near = depth - middle.w;
  if (near <= 0.01 * middle.w) {
    gl_Position = vec4(corner, 0.5, 1);
    return;
  }
  // A point p of the ball lies at (clip . p) / (its depth), with |clip . (p - middle)| <= |clip| r, and a depth from
  // near to depth + r.
  const vec2 at = vec2(dot(picture.clip_x.xyz, middle.xyz), dot(picture.clip_y.xyz, middle.xyz));
  const vec2 wide = middle.w * vec2(length(picture.clip_x.xyz), length(picture.clip_y.xyz));
  const vec2 low = min((at - wide) / near, (at - wide) / (depth + middle.w));
  const vec2 high = max((at + wide) / near, (at + wide) / (depth + middle.w));
  gl_Position = vec4(mix(low, high, corner * 0.5 + 0.5), 0.5, 1);
}
