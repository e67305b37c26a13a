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
layout(binding = kBindLayerChunks, std430) readonly buffer Chunks { ivec4 chunks[]; };

#include "render/raster/face_vertex.glsl.h"
#define EDGES_TO_FRAGMENTS
#include "render/raster/rectangle_edges.glsl.h"

layout(location = 0) flat out uvec3 seen;  // packed interface, plane, which edges' lines are within

void main() {
  read_picture();
  const uint index = uint(gl_VertexIndex) >> 2;
  const uvec2 record = kSortedRecords ? sorted[index].xy : faces[index];
  const uint chunk = kSortedRecords ? sorted[index].z : uint(gl_InstanceIndex);
  const int face = int(face_direction(record.y));
  const int axis = face >> 1;
  const int u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
  const ivec3 voxel = chunks[chunk].xyz + ivec3(face_voxel(record.x));
  const int plane = voxel[axis] + (face & 1);
  const uint upper = see_through_part_upper(record.y), level = face == 3 ? upper : 0u;
  const float offset = float(plane) - level_drop(level) - picture.fraction[axis] - picture.fraction_rest[axis];
  seen = uvec3(packed_interface(see_through_kind(record.y), uint(face), see_through_beyond(record.y), level),
               uint(plane), 0u);

  // From integers, so that the common edge of two faces has the same bits in both.
  const vec2 fraction = vec2(picture.fraction[u], picture.fraction[v]);
  vec2 low, high;
  face_extent(record.x, record.y, upper, voxel[u], voxel[v], fraction, low, high);
  const vec2 rest = vec2(picture.fraction_rest[u], picture.fraction_rest[v]);
  low -= rest, high -= rest;
  if (kExactEdges) {
    const RectangleEdges edges = rectangle_edges(axis, u, v, offset, vec4(low, high));
    write_edges(edges);
    seen.z = edges.on_edge;
  }

  const bool high_u = (gl_VertexIndex & 1) != 0, high_v = (gl_VertexIndex & 2) != 0;
  gl_Position = placed_corner(axis, u, v, offset, low, high, high_u, high_v);
}
