#version 460
#extension GL_GOOGLE_include_directive : require
// Four vertices a face between see-through blocks, pulled from its record as in faces.vert.glsl; both sides are drawn.
#include "render/raster/shading/read_picture.glsl.h"
#include "render/extract/face_record.shared.h"
#include "render/raster/transparency.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(binding = kBindLayerFaces, std430) readonly buffer Faces { uvec2 faces[]; };
layout(constant_id = kSpecSortedRecords) const bool kSortedRecords = false;
layout(binding = kBindLayerSorted, std430) readonly buffer Sorted { uvec4 sorted[]; };
layout(binding = kBindLayerChunks) uniform isamplerBuffer chunks;

#include "render/raster/placed_face.glsl.h"
#define EDGES_TO_FRAGMENTS
#include "render/raster/rectangle_edges.glsl.h"

layout(location = 0) flat out uvec3 seen;  // packed interface, plane, which edges' lines are within

void main() {
  read_picture();
  const uint index = uint(gl_VertexIndex) >> 2;
  const uvec2 record = kSortedRecords ? sorted[index].xy : faces[index];
  const uint chunk = kSortedRecords ? sorted[index].z : uint(gl_InstanceIndex);
  const PlacedFace face = place_layer(record, texelFetch(chunks, int(chunk)));
  seen = face.seen;
  if (kExactEdges) {
    const RectangleEdges edges =
        rectangle_edges(face.axis, face.u, face.v, face.offset, vec4(face.low, face.high));
    write_edges(edges);
    seen.z = edges.on_edge;
  }
  const bool high_u = (gl_VertexIndex & 1) != 0, high_v = (gl_VertexIndex & 2) != 0;
  gl_Position = placed_corner(face.axis, face.u, face.v, face.offset, face.low, face.high, high_u, high_v);
}
