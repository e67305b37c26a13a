#version 460
#extension GL_GOOGLE_include_directive : require
// The window of an impostor: four vertices, placed by the processor.
#include "render/raster/impostors.shared.h"
#include "render/raster/raster.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindImpostors, std430) readonly buffer Impostors { ImpostorDraw impostors[]; };

#define RAY_TO_FRAGMENTS
#include "render/raster/fragment_ray.glsl.h"

layout(location = 0) flat out vec4 row_x;
layout(location = 1) flat out vec4 row_y;
layout(location = 2) flat out vec4 row_w;
layout(location = 3) flat out vec4 depth;
layout(location = 4) flat out ivec4 chunk;
layout(location = 5) flat out uvec4 first;
layout(location = 6) flat out vec4 fraction;  // of the camera's voxel, as in PictureConstants
layout(location = 7) flat out vec3 fraction_rest;

void main() {
  write_ray();
  const uint i = uint(gl_VertexIndex) >> 2;
  row_x = impostors[i].row_x;
  row_y = impostors[i].row_y;
  row_w = impostors[i].row_w;
  depth = impostors[i].depth;
  chunk = impostors[i].chunk;
  first = impostors[i].texels;
  fraction = picture.fraction;
  fraction_rest = picture.fraction_rest.xyz;
  gl_Position = impostors[i].corners[gl_VertexIndex & 3];
}
