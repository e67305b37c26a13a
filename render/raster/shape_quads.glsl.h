// Rays against the faces of shapes, as the table has them (render/raster/shape_table.h).
#ifndef LOAM_RENDER_RASTER_SHAPE_QUADS_GLSL_H
#define LOAM_RENDER_RASTER_SHAPE_QUADS_GLSL_H
#include "render/raster/raster.shared.h"

layout(binding = kBindShapeQuads) uniform samplerBuffer quads;

/// Faces that meet overlap by this, so that rounding leaves no gap between them.
const float kOverlap = 1e-5;

/// on: a place in the face's own axes, 0..1 on it.
bool lies_within(vec2 on) {
  return all(greaterThanEqual(on, vec2(-kOverlap))) && all(lessThanEqual(on, vec2(1.0 + kOverlap)));
}

uint faces_of_shape(uint first) { return floatBitsToUint(texelFetch(quads, int(first * kQuadVectors) + 7).w); }

/// Where the line of a ray from the origin meets a face of the shape whose voxel's corner is there; -1e30: nowhere.
float meet_face(uint face, vec3 corner, vec3 ray) {
  const int at = int(face * kQuadVectors);
  const vec4 along_u = texelFetch(quads, at + 4), along_v = texelFetch(quads, at + 5),
             plane = texelFetch(quads, at + 6);
  const float t = (dot(plane.xyz, corner) + plane.w) / dot(plane.xyz, ray);
  const vec3 place = t * ray - corner;
  const vec2 on = vec2(dot(place, along_u.xyz), dot(place, along_v.xyz)) - vec2(along_u.w, along_v.w);
  return lies_within(on) ? t : -1e30;
}

/// The nearest of the faces that it meets between `least` and `t`, which is then where; or kNoQuad. From outside of
/// boxes: their faces that look away lie behind those that don't.
uint nearest_face(uint first, uint faces, vec3 corner, vec3 ray, float least, inout float t) {
  uint nearest = kNoQuad;
  for (uint face = first; face < first + faces; ++face) {
    const float met = meet_face(face, corner, ray);
    if (met > least && met < t) {
      t = met;
      nearest = face;
    }
  }
  return nearest;
}

#endif
