#version 460
#extension GL_GOOGLE_include_directive : require
// A triangle over the whole picture, infinitely far, with the picture's constants.
#define PICTURE_TO_FRAGMENTS
#include "render/raster/shading/read_picture.glsl.h"

void main() {
  gl_Position = vec4(gl_VertexIndex == 1 ? 3 : -1, gl_VertexIndex == 2 ? 3 : -1, 0, 1);
  write_picture();
}
