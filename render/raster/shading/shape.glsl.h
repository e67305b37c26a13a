// Radiance of a face of a shape that a pixel sees: its light is that of the cell it stands in.
#ifndef LOAM_RENDER_RASTER_SHADING_SHAPE_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SHAPE_GLSL_H
#include "render/extract/face_record.shared.h"
#include "render/raster/shading/surface.glsl.h"

layout(binding = kBindChunks, std430) readonly buffer Chunks { ivec4 chunks[]; };
layout(binding = kBindShapeQuads, std430) readonly buffer Quads { vec4 quads[]; };
layout(binding = kBindShapeLit, std430) readonly buffer ShapeLit { vec4 shape_lit[]; };

/// Distance along the ray in its lengths; the face may lie beyond the view distance.
float shape_distance(uvec2 seen, vec3 ray) {
  const uint at = (seen.x & ~kSeenShape) * kQuadVectors;
  const ivec3 voxel = chunks[seen.y >> kSeenChunkShift].xyz + ivec3(face_voxel(seen.y));
  const vec3 corner = vec3(voxel) - picture.fraction.xyz - picture.fraction_rest.xyz + quads[at].xyz;
  const vec3 normal = quads[at + 3u].xyz;
  return dot(normal, corner) / dot(normal, ray);
}

vec3 shape_radiance(uvec2 seen, vec3 ray, float t) {
  const uint at = (seen.x & ~kSeenShape) * kQuadVectors;
  const ivec3 voxel = chunks[seen.y >> kSeenChunkShift].xyz + ivec3(face_voxel(seen.y));
  const vec4 normal = quads[at + 3u];
  const uint block = floatBitsToUint(quads[at + 1u].w);
  uint lit = floatBitsToUint(quads[at].w);
  vec3 side = normal.xyz;
  if (floatBitsToInt(normal.w) == 6 && dot(normal.xyz, ray) > 0.0) lit += 1u, side = -side;

  const vec3 size = abs(side);
  const uint axis = size.x >= size.y && size.x >= size.z ? 0u : size.y >= size.z ? 1u : 2u;
  const uint face = axis * 2u + (side[axis] > 0.0 ? 1u : 0u);
  const ivec3 cell = picture.camera_voxel.xyz + voxel;
  const vec3 fraction = clamp(t * ray + picture.fraction.xyz - vec3(voxel), vec3(0), vec3(1));
  bool visible = shape_lit[2u * lit + 1u].w != 0.0;
  vec3 light = shape_lit[2u * lit].rgb;
  if (kLight != kLightNone) {
    // The face that looks the same way, or any: they have the light of the cell.
    uint code = light_code(cell, face);
    for (uint f = 0u; f < 6u && code == kLightUnknown; ++f) code = light_code(cell, f);
    if (code != kLightUnknown) light = decode_light(code, face);
    if (kSunShadow == kSunShadowSkyLight) visible = visible && sees_whole_sky(code);
  }
  if (kSunShadow == kSunShadowRay && visible) visible = sun_visible(cell, fraction);
  float sun = visible ? 1.0 : 0.0;
  if (kSunShadow == kSunShadowMap && visible) sun = sun_map_at(cell, fraction, axis);
  LitPoint p;
  p.voxel = cell;
  p.fraction = fraction;
  p.normal = side;
  p.to_eye = -normalize(ray);
  if (kSkyRays > 0u) light *= open_sky(p);
  const vec3 emitted = materials[2u * block + 1u].rgb * quads[at + 2u].w;
  if (kBsdf) return emitted + scattered_light(p, scatterer_of(block), light, sun);
  return materials[2u * block].rgb * (light + sun * shape_lit[2u * lit + 1u].rgb) + emitted;
}

#endif
