#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// How much of a pixel a particle hides, with what is in front of it and behind.
#include "render/raster/raster.shared.h"
#include "render/inhabitants.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindBalls, std430) readonly buffer Balls { DrawnBall balls[]; };
layout(binding = kBindDepth) uniform texture2D depth_image;
layout(location = 0) flat in int ball;
layout(location = 0) out vec4 colour;

void main() {
  const vec3 ray = picture.corner.xyz + gl_FragCoord.x * picture.step_x.xyz + gl_FragCoord.y * picture.step_y.xyz;
  const float size = length(ray), depth = texelFetch(depth_image, ivec2(gl_FragCoord.xy), 0).x;
  // Depth is near plane / view depth; a ray is `size` long at a view depth of 1.
  const float end = depth > 0.0 ? picture.fraction.w / depth * size : 1e30;
  const DrawnBall b = balls[ball];
  const float opacity = ball_opacity(b, ray / size, end);
  if (!(opacity > 0.0)) discard;
  colour = vec4(b.radiance.rgb * opacity, opacity);
}
