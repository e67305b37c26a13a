#version 460
#extension GL_GOOGLE_include_directive : require
// Each face of a body has one radiance.
#include "render/raster/raster.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
#include "render/raster/mirror.glsl.h"

layout(location = 0) flat in vec3 radiance;
layout(location = 1) in vec3 hit;  // relative to the camera
layout(location = 0) out vec4 colour;

void main() {
  if (behind_mirror(hit)) discard;
  colour = vec4(radiance, 1);
}
