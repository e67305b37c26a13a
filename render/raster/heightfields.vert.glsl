#version 460
#extension GL_GOOGLE_include_directive : require
// Vertices of grids of heights and of their skirts.
#include "render/raster/heightfields.shared.h"
#include "render/raster/raster.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindHeightDraws, std430) readonly buffer Draws { HeightDraw draws[]; };
layout(binding = kBindHeightWords) uniform usamplerBuffer height_words;

#define RAY_TO_FRAGMENTS
#include "render/raster/fragment_ray.glsl.h"

layout(location = 0) flat out ivec4 corner;
layout(location = 1) flat out uint first_word;
// Of the picture: a pixel reads what its vertex says faster than a uniform.
layout(location = 2) flat out vec4 fraction;

void main() {
  write_ray();
  const HeightDraw draw = draws[gl_InstanceIndex];
  corner = draw.corner;
  first_word = draw.words.x;
  fraction = picture.fraction;
  const int step = int(draw.words.z), squares = int(draw.words.w), side = squares + 1;
  const bool of_skirt = gl_VertexIndex >= side * side;
  const ivec2 at = of_skirt ? above_skirt(gl_VertexIndex - side * side, squares)
                            : ivec2(gl_VertexIndex / side, gl_VertexIndex % side);
  const uint word = texelFetch(height_words, int(draw.words.y) + at.x * side + at.y).x;
  const int level = corner.w & int(kChunkLevel);
  const float height = float(of_skirt ? word >> 16 : word & 0xffffu) * (exp2(float(level)) / kHeightParts);
  // From integers, so that what stands beside it has the same bits there.
  const ivec2 column = corner.xz + (at * step << level);
  vec3 point = vec3(column.x, corner.y, column.y) - picture.fraction.xyz;
  point.y += height;
  // A pixel between two chunks must be in one of them, wherever rounding puts their vertices.
  const float outward = max(dot(picture.clip_w.xyz, point), 0.0) * picture.screen.z;
  point.x += at.x == 0 ? -outward : at.x == squares ? outward : 0.0;
  point.z += at.y == 0 ? -outward : at.y == squares ? outward : 0.0;
  gl_Position = vec4(dot(picture.clip_x.xyz, point), dot(picture.clip_y.xyz, point), picture.fraction.w,
                     dot(picture.clip_w.xyz, point));
}
