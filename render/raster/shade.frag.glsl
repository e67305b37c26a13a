#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Radiance of each pixel, over the whole picture: the test of depth lets the sky's through, or the others.
#define PICTURE_FROM_VERTICES
#include "render/raster/shading/pixel.glsl.h"
#include "render/raster/shading/put_off.glsl.h"

layout(early_fragment_tests) in;
layout(constant_id = kSpecSeenPutOff) const uint kSeenPutOff = 0u;
layout(constant_id = kSpecCountsRays) const bool kCountsRays = false;
layout(location = 0) out vec4 colour_out;

void main() {
  read_picture();
  const uvec2 pixel = uvec2(gl_FragCoord.xy);
  const uvec2 seen = kShadedPart == kShadedSky ? uvec2(0) : texelFetch(seen_image, ivec2(pixel), 0).xy;
  // A face has none of the bits, a shape may have any below its own.
  const uint kind = (seen.x & kSeenShape) != 0u ? kSeenShape : seen.x & kSeenMesh;
  const bool later = kSeenPutOff != 0u && (kind & kSeenPutOff) != 0u;
  colour_out = vec4(pixel_radiance(pixel, later ? uvec2(0) : seen), 1);
  const uint place = pixel.y * uint(picture.screen.x) + pixel.x;
  if (kCountsRays && sun_ray_cast) atomicAdd(put_off_list.counted, 1u);
  if (later) put_pixel_off(place);
}
