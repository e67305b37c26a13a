#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Nothing but the stencil, where a pixel sees more than the sky.
#include "render/raster/raster.shared.h"

layout(binding = kBindSeen) uniform utexture2D seen_image;

void main() {
  if (texelFetch(seen_image, ivec2(gl_FragCoord.xy), 0).x == 0u) discard;
}
