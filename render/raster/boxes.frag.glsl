#version 460
#extension GL_GOOGLE_include_directive : require
// Each face of a body has one radiance, which media dim.
#include "render/raster/shading/media.glsl.h"
#include "render/raster/mirror.glsl.h"

layout(location = 0) flat in vec3 radiance;
layout(location = 1) in vec3 hit;  // relative to the camera
layout(location = 0) out vec4 colour;

void main() {
  if (behind_mirror(hit)) discard;
  colour = vec4(radiance, 1);
  if (kMedia) {
    if (kFogShafts) fog_shift = fog_shaft_shift(floor(gl_FragCoord.x), floor(gl_FragCoord.y));
    const float distance = length(hit);
    const FogView fog = fog_along(picture.camera_voxel.xyz, picture.fraction.xyz, hit / distance, distance);
    colour.rgb = fog.value * radiance + fog.added;
  }
}
