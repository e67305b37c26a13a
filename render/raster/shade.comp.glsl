#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Radiance of what was put off, and of bands of a picture that is too large for an image: there of each pixel.
#define PICTURE_READ_FIRST
#include "render/raster/shading/pixel.glsl.h"
#include "render/raster/shading/put_off.glsl.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = kSpecToImage) const bool kToImage = false;
layout(constant_id = kSpecPutOff) const bool kPutOff = false;
layout(constant_id = kSpecCountsRays) const bool kCountsRays = false;
layout(push_constant) uniform Band {
  uvec2 first_group;     // of the band, or x: of the list
  uint first_row, rows;  // where all pixels are shaded: of the buffer that is bound
};
layout(binding = kBindRadiance, std430) writeonly buffer Radiance { float radiance[]; };
layout(binding = kBindColour, rgba32f) writeonly uniform image2D colour_image;

void main() {
  read_picture();
  const uint width = uint(picture.screen.x);
  uvec2 of_band = kShadeGroup * first_group + gl_GlobalInvocationID.xy;
  if (kPutOff) {
    const uint place = (first_group.x + gl_WorkGroupID.x) * kShadeGroup * kShadeGroup + gl_LocalInvocationIndex;
    if (place >= put_off_list.listed) return;
    const uint at = put_off[place];
    of_band = uvec2(at % width, at / width);
  }
  if (of_band.x >= width || of_band.y >= rows) return;
  const uvec2 pixel = of_band + uvec2(0, first_row);
  const vec3 colour = pixel_radiance(pixel, texelFetch(seen_image, ivec2(pixel), 0).xy);
  if (kCountsRays && sun_ray_cast) atomicAdd(put_off_list.counted, 1u);
  if (kToImage) {
    imageStore(colour_image, ivec2(pixel), vec4(colour, 1));
    return;
  }
  const uint at = 3u * (of_band.y * width + pixel.x);
  radiance[at] = colour.r;
  radiance[at + 1u] = colour.g;
  radiance[at + 2u] = colour.b;
}
