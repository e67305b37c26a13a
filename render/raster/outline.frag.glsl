#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Where nothing lies before the box. Depth is near plane / view depth, but for what its format rounds.
#include "render/raster/raster.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindDepth) uniform texture2D seen_depth_image;
layout(push_constant) uniform Push { vec4 low, high, colour; };
layout(location = 0) in float view_depth;
layout(location = 0) out vec4 colour_out;

void main() {
  const float seen = texelFetch(seen_depth_image, ivec2(gl_FragCoord.xy), 0).x, own = picture.fraction.w / view_depth;
  if (seen > own * 1.0005) discard;
  colour_out = vec4(colour.rgb * colour.a, colour.a);
}
