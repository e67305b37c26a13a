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
  if (kLuminaires || kSkyRays > 0u) sampler_key = sampler_key_of(picture.light_samples.zw, pixel);
  vec3 colour = vec3(0.0);
  float distance = kMediumFar;  // to what is seen, m
  if (kShapes && (seen.x & kSeenShape) != 0u) {
    const float t = shape_distance(seen, ray);
    if (t <= picture.sun.w * inverse_length) {
      distance = t / inverse_length;
      colour = shape_radiance(seen, ray, t);
    }
  } else if (seen.x != 0u) {
    const uint face = seen_face(seen.x), axis = face >> 1;
    const vec3 offsets = float(int(seen.y)) - picture.fraction.xyz - picture.fraction_rest.xyz;
    const float t = axis == 0u ? offsets.x / ray.x : axis == 1u ? offsets.y / ray.y : offsets.z / ray.z;
    if (t <= picture.sun.w * inverse_length) {
      distance = t / inverse_length;
      FacePoint point = face_point(seen_block(seen.x), face, t * ray + picture.fraction.xyz, int(seen.y), -direction);
      if (kTextures != kTextureOff) {
        point.step_x = texture_step(t * ray, ray, picture.step_x.xyz, int(axis));
        point.step_y = texture_step(t * ray, ray, picture.step_y.xyz, int(axis));
      }
      if (seen_level(seen.x) != 0u) lift_point(point, 1 << int(seen_level(seen.x)));
      colour = face_radiance(point);
    }
  }
  if (kLuminaires && picture.luminaires_seen.x != 0u) {
    const SeenLuminaire met = seen_luminaire(pixel, direction, min(distance, picture.sun.w));
    if (met.distance >= 0.0) {
      distance = met.distance;
      colour = met.radiance;
    }
  }
  if (distance == kMediumFar) colour = seen_far(direction);
  if (picture.eye_absorption.w != 0.0) colour *= attenuation(picture.eye_absorption.rgb, distance);
  if (kMedia) {
    const FogView fog = fog_along(picture.camera_voxel.xyz, picture.fraction.xyz, direction, distance);
    colour = fog.value * colour + fog.added;
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
