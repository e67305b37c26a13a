#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Radiance of each pixel from what it sees: a surface (render/raster/shading/surface.glsl.h), or the sky.
#include "render/raster/shading/shape.glsl.h"
#include "render/raster/shading/sky.glsl.h"
#include "render/raster/shading/surface.glsl.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = kSpecShapes) const bool kShapes = false;
layout(constant_id = kSpecToImage) const bool kToImage = false;
layout(binding = kBindSeen) uniform utexture2D seen_image;
layout(push_constant) uniform Band { uint first_row; };  // the rows of this dispatch; `radiance` starts at them
layout(binding = kBindRadiance, std430) writeonly buffer Radiance { float radiance[]; };
layout(binding = kBindColour, rgba32f) writeonly uniform image2D colour_image;

void main() {
  const uvec2 pixel = gl_GlobalInvocationID.xy + uvec2(0, first_row);
  const uint width = uint(picture.screen.x), height = uint(picture.screen.y);
  if (pixel.x >= width || pixel.y >= height) return;
  const uvec2 seen = texelFetch(seen_image, ivec2(pixel), 0).xy;
  const vec3 ray = picture.corner.xyz + (float(pixel.x) + 0.5) * picture.step_x.xyz +
                   (float(pixel.y) + 0.5) * picture.step_y.xyz;
  const float inverse_length = inversesqrt(dot(ray, ray));
  const vec3 direction = ray * inverse_length;
  vec3 colour = sky_radiance(direction);
  if (kShapes && (seen.x & kSeenShape) != 0u) {
    const float t = shape_distance(seen, ray);
    if (t <= picture.sun.w * inverse_length) colour = shape_radiance(seen, ray, t);
  } else if (seen.x != 0u) {
    const uint face = seen_face(seen.x), axis = face >> 1;
    const vec3 offsets = float(int(seen.y)) - picture.fraction.xyz - picture.fraction_rest.xyz;
    const float t = axis == 0u ? offsets.x / ray.x : axis == 1u ? offsets.y / ray.y : offsets.z / ray.z;
    if (t <= picture.sun.w * inverse_length)
    {
      FacePoint point = face_point(seen_block(seen.x), face, t * ray + picture.fraction.xyz, int(seen.y), -direction);
      if (seen_level(seen.x) != 0u) lift_point(point, 1 << int(seen_level(seen.x)));
      colour = face_radiance(point);
    }
  }
  if (kToImage) {
    imageStore(colour_image, ivec2(pixel), vec4(colour, 1));
    return;
  }
  const uint at = 3u * (gl_GlobalInvocationID.y * width + pixel.x);
  radiance[at] = colour.r;
  radiance[at + 1u] = colour.g;
  radiance[at + 2u] = colour.b;
}
