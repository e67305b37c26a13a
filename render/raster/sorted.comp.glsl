#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Puts what layers show over what was seen behind them, and the eye's own medium over both.
#include "render/raster/block_grid.glsl.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(push_constant) uniform Slice { uvec2 first_group; };
layout(binding = kBindColour, rgba32f) uniform image2D colour_image;
layout(binding = kBindLayerShown) uniform texture2D shown_image;
layout(binding = kBindLayerDepth) uniform texture2D passed_image;

void main() {
  const ivec2 pixel = ivec2(8u * first_group + gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(picture.screen.xy)))) return;
  const vec3 behind = imageLoad(colour_image, pixel).rgb;
  vec3 colour = texelFetch(shown_image, pixel, 0).rgb + texelFetch(passed_image, pixel, 0).rgb * behind;
  const vec3 absorption = eye_absorption().xyz;
  if (absorption != vec3(0)) {
    const vec3 ray = pixel_ray(vec2(pixel) + 0.5);
    colour *= absorbed_along(absorption, run_length(picture.camera_voxel.xyz, picture.fraction.xyz, normalize(ray),
                                                    uint(layers.eye.x)));
  }
  imageStore(colour_image, pixel, vec4(colour, 1));
}
