// Radiance of a face of a shape that a pixel sees: its light is that of the cell it stands in.
#ifndef LOAM_RENDER_RASTER_SHADING_SHAPE_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SHAPE_GLSL_H
#include "render/extract/face_record.shared.h"
#include "render/raster/shading/surface.glsl.h"
#include "render/raster/shape_quads.glsl.h"

layout(binding = kBindChunks) uniform isamplerBuffer chunks;
layout(binding = kBindShapeLit) uniform samplerBuffer shape_lit;

/// Distance along the ray in its lengths; the face may lie beyond the view distance.
float shape_distance(uvec2 seen, vec3 ray) {
  const int at = int((seen.x & ~kSeenShape) * kQuadVectors);
  const ivec3 voxel = texelFetch(chunks, int(seen.y >> kSeenChunkShift)).xyz + ivec3(face_voxel(seen.y));
  const vec3 corner = vec3(voxel) - picture.fraction.xyz - picture.fraction_rest.xyz + texelFetch(quads, at).xyz;
  const vec3 normal = texelFetch(quads, at + 3).xyz;
  return dot(normal, corner) / dot(normal, ray);
}

/// The voxel of the world that the shape stands in, and a place in it; `hit`: relative to the camera.
ivec3 shape_cell(uvec2 seen) {
  return picture.camera_voxel.xyz + texelFetch(chunks, int(seen.y >> kSeenChunkShift)).xyz + ivec3(face_voxel(seen.y));
}
vec3 shape_fraction(ivec3 cell, vec3 hit) {
  return clamp(hit + picture.fraction.xyz - vec3(cell - picture.camera_voxel.xyz), vec3(0), vec3(1));
}

/// Of a face of the shape in a voxel, at a place in that.
vec3 shape_radiance_at(uint quad, ivec3 cell, vec3 fraction, vec3 ray) {
  const int at = int(quad * kQuadVectors);
  const vec4 normal = texelFetch(quads, at + 3);
  const uint block = floatBitsToUint(texelFetch(quads, at + 1).w);
  uint lit = floatBitsToUint(texelFetch(quads, at).w);
  vec3 side = normal.xyz;
  if (floatBitsToInt(normal.w) == 6 && dot(normal.xyz, ray) > 0.0) lit += 1u, side = -side;

  const vec3 size = abs(side);
  const uint axis = size.x >= size.y && size.x >= size.z ? 0u : size.y >= size.z ? 1u : 2u;
  const uint face = axis * 2u + (side[axis] > 0.0 ? 1u : 0u);
  const vec4 in_sun = texelFetch(shape_lit, int(2u * lit + 1u));
  bool visible = in_sun.w != 0.0;
  vec3 light = texelFetch(shape_lit, int(2u * lit)).rgb;
  if (kLight != kLightNone) {
    // The face that looks the same way, or any: they have the light of the cell.
    uint code = light_code(cell, face);
    for (uint f = 0u; f < 6u && code == kLightUnknown; ++f) code = light_code(cell, f);
    if (code != kLightUnknown) light = decode_light(code, face);
    if (kSunShadow == kSunShadowSkyLight) visible = visible && sees_whole_sky(code);
  }
  if (kSunShadow == kSunShadowRay && visible) visible = sun_visible(cell, fraction, kNoTriangle);
  vec3 sun = vec3(visible ? 1.0 : 0.0);
  if (kSunShadow == kSunShadowMap && visible) sun = vec3(sun_by_map(cell, fraction, axis, kNoTriangle));
  if (kSunBlockers) {  // one condition each: specialised, it takes all that it holds out of the shader
    if (visible) sun *= sun_let_through(cell, fraction);
  }
  if (kCloudShadows && visible) sun *= sun_through_clouds(cell, fraction);
  LitPoint p;
  p.voxel = cell;
  p.fraction = fraction;
  p.normal = p.side = side;
  p.triangle = kNoTriangle;
  p.lift = 0.0;
  p.to_eye = -normalize(ray);
  if (kSkyRays > 0u) light *= open_sky(p);
  const Material material = material_of(block);
  const vec3 emitted = material.emitted * texelFetch(quads, at + 2).w;
  if (kBsdf) return emitted + scattered_light(p, scatterer_of(block), light, sun);
  return material.albedo * (light + sun * in_sun.rgb) + emitted;
}
vec3 shape_radiance(uvec2 seen, vec3 ray, float t) {
  const ivec3 cell = shape_cell(seen);
  return shape_radiance_at(seen.x & ~kSeenShape, cell, shape_fraction(cell, t * ray), ray);
}

#endif
