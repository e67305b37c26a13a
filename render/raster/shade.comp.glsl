#version 460
#extension GL_GOOGLE_include_directive : require
// Radiance of each pixel from what it sees: the formula of render/shading.h, and the sky where it sees nothing.
#include "render/raster/raster.shared.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = kSpecSunShadow) const bool kSunShadow = false;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindMaterials, std430) readonly buffer Materials { vec4 materials[]; };
layout(binding = kBindSeen, rg32ui) readonly uniform uimage2D seen_image;
layout(push_constant) uniform Band { uint first_row; };  // the rows of this dispatch; `radiance` starts at them
layout(binding = kBindRadiance, std430) writeonly buffer Radiance { float radiance[]; };

vec3 sky(vec3 ray) {
  const float cosine = ray.y / length(ray);
  if (cosine < 0.0) return picture.sky_ground.rgb;
  return picture.sky_horizon.rgb + (picture.sky_zenith.rgb - picture.sky_horizon.rgb) * cosine;
}

void main() {
  const uvec2 pixel = gl_GlobalInvocationID.xy + uvec2(0, first_row);
  const uint width = uint(picture.screen.x), height = uint(picture.screen.y);
  if (pixel.x >= width || pixel.y >= height) return;
  const uvec2 seen = imageLoad(seen_image, ivec2(pixel)).xy;
  const vec3 ray = picture.corner.xyz + (float(pixel.x) + 0.5) * picture.step_x.xyz +
                   (float(pixel.y) + 0.5) * picture.step_y.xyz;
  vec3 colour = sky(ray);
  if (seen.x != 0u) {
    const uint face = seen.x >> kSeenFaceShift, axis = face >> 1, block = seen.x & 0xffffu;
    const float t = (float(int(seen.y)) - picture.fraction[axis]) / ray[axis];
    if (t * length(ray) <= picture.sun.w) {
      vec3 lit = picture.sky_lit[face].rgb;
      if (!kSunShadow || picture.sun_lit[face].w == 0.0) lit += picture.sun_lit[face].rgb;
      colour = materials[2u * block].rgb * lit + materials[2u * block + 1u].rgb;
    }
  }
  const uint at = 3u * (gl_GlobalInvocationID.y * width + pixel.x);
  radiance[at] = colour.r;
  radiance[at + 1u] = colour.g;
  radiance[at + 2u] = colour.b;
}
