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

/// What a ray asks of one.
struct ShapeFace {
  vec4 along_u, along_v, plane;
};
ShapeFace shape_face(uint face) {
  const int at = int(face * kQuadVectors);
  return ShapeFace(texelFetch(quads, at + 4), texelFetch(quads, at + 5), texelFetch(quads, at + 6));
}

/// Where the line of a ray from the origin meets a face of the shape whose voxel's corner is there; -1e30: nowhere.
float meet(const ShapeFace face, vec3 corner, vec3 ray) {
  const float t = (dot(face.plane.xyz, corner) + face.plane.w) / dot(face.plane.xyz, ray);
  const vec3 place = t * ray - corner;
  const vec2 on =
      vec2(dot(place, face.along_u.xyz), dot(place, face.along_v.xyz)) - vec2(face.along_u.w, face.along_v.w);
  return lies_within(on) ? t : -1e30;
}

/// The nearest of the faces that it meets between `least` and `t`, which is then where; or kNoQuad. From outside of
/// boxes: their faces that look away lie behind those that don't.
uint nearest_face(uint first, uint faces, vec3 corner, vec3 ray, float least, inout float t) {
  uint nearest = kNoQuad;
  for (uint face = first; face < first + faces; ++face) {
    const float met = meet(shape_face(face), corner, ray);
    if (met > least && met < t) {
      t = met;
      nearest = face;
    }
  }
  return nearest;
}

#endif
