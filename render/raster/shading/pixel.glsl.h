// Radiance of a pixel from what it sees: a surface (surface.glsl.h), a face of a shape, a triangle, or the sky.
#ifndef LOAM_RENDER_RASTER_SHADING_PIXEL_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_PIXEL_GLSL_H
#include "render/raster/shading/mesh.glsl.h"
#include "render/raster/shading/shape.glsl.h"
#include "render/raster/shading/surface.glsl.h"
#include "render/raster/shading/veil.glsl.h"

layout(constant_id = kSpecShapes) const bool kShapes = false;
layout(constant_id = kSpecMeshPixels) const bool kMeshPixels = false;
layout(constant_id = kSpecShadedPart) const uint kShadedPart = kShadedAll;
layout(binding = kBindSeen) uniform utexture2D seen_image;
/// Through the middle of a pixel; its component along the camera's direction is 1.
vec3 pixel_middle_ray(uvec2 pixel) {
  return picture.corner.xyz + (float(pixel.x) + 0.5) * picture.step_x.xyz + (float(pixel.y) + 0.5) * picture.step_y.xyz;
}

/// `hit`: relative to the camera.
FacePoint seen_face_point(uvec2 seen, vec3 hit, vec3 direction) {
  FacePoint point =
      face_point(seen_block(seen.x), seen_face(seen.x), hit + picture.fraction.xyz, seen_plane(seen, hit), -direction);
  if (kCoarseFaces && (seen_level(seen.x) != 0u || (seen.x & kSeenPlaced) != 0u))
    lift_point(point, 1 << int(seen_level(seen.x)));
  if (kLiquidLevels && (!kCoarseFaces || (seen.x & kSeenPlaced) == 0u)) point.level = seen.x >> kSeenLiquidShift & 15u;
  return point;
}

vec3 pixel_radiance(uvec2 pixel, uvec2 seen) {
  const vec3 ray = pixel_middle_ray(pixel);
  const float inverse_length = inversesqrt(dot(ray, ray));
  const vec3 direction = ray * inverse_length;
  if (kLuminaires || kSkyRays > 0u) sampler_key = sampler_key_of(picture.light_samples.zw, pixel);
  if (kFogShafts) fog_shift = fog_shaft_shift(float(pixel.x), float(pixel.y));
  vec3 colour = vec3(0.0);
  float distance = kMediumFar;  // to what is seen, m
  const float view_end = picture.sun.w * inverse_length;
  if (kShapes && (seen.x & kSeenShape) != 0u) {
    const float t = shape_distance(seen, ray);
    if (!kViewEnds || t <= view_end) {
      distance = t / inverse_length;
      colour = shape_radiance(seen, ray, t);
    }
  } else if (kMeshPixels && (seen.x & kSeenNoFace) == kSeenMesh) {
    const float t = uintBitsToFloat(seen.y);
    if (!kViewEnds || t <= view_end) {
      distance = t / inverse_length;
      colour = mesh_radiance(seen, ray, t);
    }
  } else if (kShadedPart == kShadedSurfaces || (kShadedPart == kShadedAll && seen.x != 0u)) {
    const int axis = int(seen_face(seen.x) >> 1);
    const float t = min(seen_cube_t(seen, ray), 1e9);  // also where a plane that a ray runs along was seen
    if (!kViewEnds || t <= view_end) {
      distance = t / inverse_length;
      FacePoint point = seen_face_point(seen, t * ray, direction);
      if (kTextures != kTextureOff) {
        point.step_x = texture_step(t * ray, ray, picture.step_x.xyz, axis);
        point.step_y = texture_step(t * ray, ray, picture.step_y.xyz, axis);
      }
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
  if ((kViewEnds || kShadedPart == kShadedAll || kShadedPart == kShadedSky) && distance == kMediumFar) {
    colour = seen_far(direction);
    if (kCloudSteps > 0 && !kCloudsBefore) colour = behind_clouds(colour, picture.fraction.xyz, direction);
  }
  if (kBsdf && picture.eye_absorption.w != 0.0) colour *= attenuation(picture.eye_absorption.rgb, distance);
  if (kVeiled) {
    const FogView veil = veil_before(direction, distance);
    colour = veil.value * colour + veil.added;
  }
  return colour;
}

#endif
