#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Puts the sums of weighted.frag.glsl over what was seen behind the layers.
#include "render/raster/bodies.glsl.h"
#include "render/raster/transparency.glsl.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(push_constant) uniform Slice { uvec2 first_group; };
layout(binding = kBindSeen) uniform utexture2D seen_image;
layout(binding = kBindColour, rgba32f) uniform image2D colour_image;
layout(binding = kBindLayerShown) uniform texture2D shown_image;
layout(binding = kBindLayerDepth) uniform texture2D depth_image;
layout(binding = kBindLayerRest) uniform texture2D rest_image;

void main() {
  const ivec2 pixel = ivec2(8u * first_group + gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(picture.screen.xy)))) return;
  const vec3 ray = pixel_ray(vec2(pixel) + 0.5);
  const float inverse_length = inversesqrt(dot(ray, ray)), metres = dot(ray, ray) * inverse_length;
  const uvec2 seen = texelFetch(seen_image, pixel, 0).xy;
  const float t_end = body_t(pixel, min(picture.sun.w * inverse_length, seen_t(seen, ray)));
  const vec4 shown = texelFetch(shown_image, pixel, 0), depth = texelFetch(depth_image, pixel, 0);
  // What is entered and never left; sums that should be 0 are off by rounding.
  const vec4 eye = eye_absorption(), changed = texelFetch(rest_image, pixel, 0);
  vec3 rest = eye.xyz + changed.xyz;
  rest = mix(rest, vec3(0), lessThan(rest, vec3(1e-4)));
  vec3 passed;
  for (int b = 0; b < 3; ++b)
    passed[b] = exp(-max(depth[b] + (rest[b] > 0.0 ? rest[b] * min(t_end * metres, 1e30) : 0.0), 0.0));
  const vec3 behind = imageLoad(colour_image, pixel).rgb;
  const vec3 layered = shown.rgb / max(shown.a, 1e-5) * (1.0 - exp(-depth.a));
  imageStore(colour_image, pixel, vec4(layered + passed * radiance_scale(eye.w, eye.w + changed.w) * behind, 1));
}
