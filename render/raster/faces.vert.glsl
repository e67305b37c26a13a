#version 460
#extension GL_GOOGLE_include_directive : require
// Four vertices a face, pulled from its 8-byte record. Positions are relative to the camera: an exact integer less the
// fraction of the camera's voxel, so that a picture doesn't depend on the distance from the origin.
#include "render/raster/shading/read_picture.glsl.h"
#include "render/extract/face_record.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(binding = kBindFaces) uniform usamplerBuffer faces;
layout(binding = kBindChunks) uniform isamplerBuffer chunks;

#include "render/raster/placed_face.glsl.h"
#define EDGES_TO_FRAGMENTS
#include "render/raster/rectangle_edges.glsl.h"

layout(location = 0) flat out uvec3 seen;  // as seen_image; the chunk's detail, and which edges' lines are within

/// With exact edges a face narrower than this on the screen, px, is one triangle that holds it, and the other has no
/// area: setting a triangle up costs more than the pixels that this one asks beside the face. 4 and 16 gain as much. A
/// point in its place, a vertex and no triangle, costs more in pixels than it saves: 18 to 22 ms in the valley at 256 m.
const float kSmallFace = 8.0;
/// The triangle's legs in sides of the face: 2, and as much more as rounding may take.
const float kTriangleLeg = 2.25;

bool small_on_screen(float offset, vec2 low, vec2 high) {
  const vec2 nearest = clamp(vec2(0), low, high), size = high - low;
  const float widest = max(size.x, size.y), metres_at_1m = kSmallFace * kVertexSteps * picture.screen.z;
  return widest * widest < metres_at_1m * metres_at_1m * (dot(nearest, nearest) + offset * offset);
}

void main() {
  read_picture();
  const PlacedFace face = place_face(texelFetch(faces, gl_VertexIndex >> 2).xy, texelFetch(chunks, gl_InstanceIndex));
  seen = face.seen;
  if (kExactEdges) {
    const RectangleEdges edges =
        rectangle_edges(face.axis, face.u, face.v, face.offset, vec4(face.low, face.high));
    write_edges(edges);
    seen.z |= edges.on_edge;
  }

  // A face that looks away shrinks to a point.
  if (face.away) {
    gl_Position = vec4(0, 0, 1, 1);
    return;
  }
  bool high_u = (gl_VertexIndex & 1) != 0, high_v = (gl_VertexIndex & 2) != 0;
  vec2 far_corner = face.high;  // of what the triangles span
  if (kExactEdges && small_on_screen(face.offset, face.low, face.high)) {
    far_corner = face.low + kTriangleLeg * (face.high - face.low);
    high_u = high_u && !high_v;
  }
  gl_Position = placed_corner(face.axis, face.u, face.v, face.offset, face.low, far_corner, high_u, high_v);
}
