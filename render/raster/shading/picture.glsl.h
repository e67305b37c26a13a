// What every part of shading reads: the picture's constants, what it is compiled for, materials.
#ifndef LOAM_RENDER_RASTER_SHADING_PICTURE_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_PICTURE_GLSL_H
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecSunShadow) const uint kSunShadow = 0u;
layout(constant_id = kSpecLight) const uint kLight = 0u;
layout(constant_id = kSpecInterpolation) const uint kInterpolation = 0u;
layout(constant_id = kSpecLiquidLevels) const bool kLiquidLevels = false;
layout(constant_id = kSpecCoarseFaces) const bool kCoarseFaces = true;
layout(constant_id = kSpecViewEnds) const bool kViewEnds = true;
layout(constant_id = kSpecCornerOcclusion) const bool kCornerOcclusion = false;

#if defined(PICTURE_FROM_VERTICES) || defined(PICTURE_READ_FIRST)
#include "render/raster/shading/read_picture.glsl.h"
#else
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
#define picture_arrays picture
#endif
layout(binding = kBindMaterials) uniform usamplerBuffer materials;
layout(binding = kBindFaceLit) uniform samplerBuffer face_lit;

// Software runs both sides of a branch that isn't constant, for all pixels: what a picture has no use for is left out
// by a constant, and what both sides need is done once.

/// Of a ray with the plane of a face of a cube that a pixel sees; INFINITY and NaN where they are parallel. level: of a
/// liquid's top, in sixteenths high in its voxel below the plane; 0: it is on the plane.
float level_plane_t(uint axis, int plane, uint level, vec3 ray) {
  const vec3 whole = picture.fraction.xyz, rest = picture.fraction_rest.xyz;
  float offset = float(plane);
  if (kLiquidLevels) offset -= level == 0u ? 0.0 : 1.0 - float(level) / 16.0;
  offset -= axis == 0u ? whole.x : axis == 1u ? whole.y : whole.z;
  offset -= axis == 0u ? rest.x : axis == 1u ? rest.y : rest.z;
  return offset / (axis == 0u ? ray.x : axis == 1u ? ray.y : ray.z);
}
float seen_cube_t(uvec2 seen, vec3 ray) {
  const float t = level_plane_t(seen_face(seen.x) >> 1, int(seen.y), seen.x >> kSeenLiquidShift & 15u, ray);
  return kCoarseFaces && (seen.x & kSeenPlaced) != 0u ? uintBitsToFloat(seen.y) : t;
}
/// Of the face, relative to the camera's voxel. hit: relative to the camera.
int seen_plane(uvec2 seen, vec3 hit) {
  const uint axis = seen_face(seen.x) >> 1;
  return kCoarseFaces && (seen.x & kSeenPlaced) != 0u ? int(round(hit[axis] + picture.fraction[axis])) : int(seen.y);
}

/// Of a block.
struct Material {
  vec3 albedo, emitted;
  uint tiles;      // where its texture's begin in the texels; 0: it has none
  float contrast;  // of its texture
};
Material material_of(uint block) {
  const uvec4 first = texelFetch(materials, int(2u * block)), second = texelFetch(materials, int(2u * block + 1u));
  return Material(uintBitsToFloat(first.rgb), uintBitsToFloat(second.rgb), first.w, uintBitsToFloat(second.w));
}

/// Radiance of an albedo of 1 under the sky alone, by face.
vec3 sky_lit(uint face) { return texelFetch(face_lit, int(face)).rgb; }
/// What the sun adds where it is visible; w: 1 where the face looks towards it.
vec4 sun_lit(uint face) { return texelFetch(face_lit, int(6u + face)); }

#endif
