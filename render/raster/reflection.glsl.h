// What the mirrored direction of an interface or a mirror shows, by the knob `reflection`, and where bent rays lead on
// the screen. `seen_image` and `behind_image` are the includer's.
#ifndef LOAM_RENDER_RASTER_REFLECTION_GLSL_H
#define LOAM_RENDER_RASTER_REFLECTION_GLSL_H
#include "render/raster/followed_rays.glsl.h"

layout(constant_id = kSpecReflection) const uint kReflection = 0u;
layout(constant_id = kSpecRefraction) const uint kRefraction = 0u;
layout(binding = kBindSeen) uniform utexture2D seen_image;
layout(binding = kBindBehind, rgba32f) readonly uniform image2D behind_image;
layout(binding = kBindMirrored, std430) readonly buffer Mirrored { float mirrored_picture[]; };

/// Pixel and view depth of a point relative to the camera.
vec3 projected(vec3 point) {
  const float w = dot(picture.clip_w.xyz, point);
  const vec2 at = vec2(dot(picture.clip_x.xyz, point), dot(picture.clip_y.xyz, point)) / w;
  return vec3((at * 0.5 + 0.5) * picture.screen.xy, w);
}
bool on_screen(vec3 at) {
  return at.z > picture.fraction.w && all(greaterThanEqual(at.xy, vec2(0))) && all(lessThan(at.xy, picture.screen.xy));
}
/// View depth of what is seen at a pixel; 1e30 for the sky.
float seen_depth(ivec2 pixel) {
  return body_t(pixel, seen_t(texelFetch(seen_image, pixel, 0).xy, pixel_ray(vec2(pixel) + 0.5)));
}

/// Steps along a ray that grow with its length, until it lies behind what is seen; then halves the last one. Where it
/// leaves the picture, or passes behind a thing that isn't near it, `otherwise`.
/// source  Morgan McGuire, Michael Mara. Efficient GPU Screen-Space Ray Tracing. 2014 (the idea; steps are in the
/// world)
vec3 screen_radiance(vec3 from, vec3 direction, vec3 otherwise) {
  float before = 0.0, length_of_step = max(0.05, 0.01 * dot(picture.clip_w.xyz, from));
  for (int i = 0; i < 40; ++i) {
    float s = before + length_of_step;
    vec3 at = projected(from + s * direction);
    if (!on_screen(at)) return otherwise;
    if (seen_depth(ivec2(at.xy)) < at.z) {
      float low = before, high = s;
      for (int k = 0; k < 6; ++k) {
        s = 0.5 * (low + high);
        at = projected(from + s * direction);
        if (seen_depth(ivec2(at.xy)) < at.z)
          high = s;
        else
          low = s;
      }
      at = projected(from + high * direction);
      if (!on_screen(at)) return otherwise;
      if (at.z - seen_depth(ivec2(at.xy)) < 1.0 + 0.02 * at.z) return imageLoad(behind_image, ivec2(at.xy)).rgb;
    }
    before += length_of_step;
    length_of_step *= 1.18;
  }
  return otherwise;
}

/// The second picture, taken from behind the mirror; direction is mirrored already. `otherwise` outside of it.
vec3 planar_radiance(vec3 direction, vec3 otherwise) {
  const float w = dot(layers.mirror_w.xyz, direction);
  if (!(w > 0.0)) return otherwise;
  const vec2 at = vec2(dot(layers.mirror_x.xyz, direction), dot(layers.mirror_y.xyz, direction)) / w;
  const ivec2 pixel = ivec2(floor((at * 0.5 + 0.5) * picture.screen.xy)), size = ivec2(picture.screen.xy);
  if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, size))) return otherwise;
  const uint first = 3u * (uint(pixel.y) * uint(size.x) + uint(pixel.x));
  return vec3(mirrored_picture[first], mirrored_picture[first + 1u], mirrored_picture[first + 2u]);
}

/// `hit`: relative to the camera; `at`: the same point of the world; medium: that the ray is mirrored in.
vec3 mirrored_radiance(vec3 hit, FacePoint at, int plane, vec3 direction, uint medium) {
  const uint axis = at.face >> 1u;
  direction[axis] = -direction[axis];
  const vec3 sky = mirrored_sky(hit + picture.fraction.xyz, direction);
  if (kReflection == kReflectionScreen) return screen_radiance(hit, direction, sky);
  if (kReflection == kReflectionTraced) return followed_radiance(at.front, at.fraction, direction, medium, false);
  if (kReflection == kReflectionPlanar && layers.mirror.x == int(axis) && layers.mirror.y == plane)
    return planar_radiance(direction, sky);
  return sky;
}

#endif
