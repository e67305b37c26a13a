#version 460
#extension GL_GOOGLE_include_directive : require
// Four vertices a face, pulled from its 8-byte record. Positions are relative to the camera: an exact integer less the
// fraction of the camera's voxel, so that a picture doesn't depend on the distance from the origin.
#include "render/raster/raster.shared.h"
#include "render/extract/face_record.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(constant_id = kSpecLiquidLevels) const bool kLiquidLevels = false;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindFaces) uniform usamplerBuffer faces;
layout(binding = kBindChunks) uniform isamplerBuffer chunks;

#include "render/raster/face_vertex.glsl.h"
#define EDGES_TO_FRAGMENTS
#include "render/raster/rectangle_edges.glsl.h"

layout(location = 0) flat out uvec3 seen;  // as seen_image; the chunk's detail

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
  const uvec2 record = texelFetch(faces, gl_VertexIndex >> 2).xy;
  const int face = int(face_direction(record.y));
  const int axis = face >> 1;
  const int u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
  const ivec4 chunk = texelFetch(chunks, gl_InstanceIndex);
  const int level = chunk.w & int(kChunkLevel);
  const ivec3 voxel = chunk.xyz + (ivec3(face_voxel(record.x)) << level);
  const int plane = voxel[axis] + ((face & 1) << level);
  const uint upper = kLiquidLevels ? opaque_part_upper(record.y) : 0u, liquid = face == 3 ? upper : 0u;
  const float drop = kLiquidLevels ? level_drop(liquid) : 0.0;
  const float offset = float(plane) - drop - picture.fraction[axis] - picture.fraction_rest[axis];
  seen = uvec3(face_block(record.y) | uint(face) << kSeenFaceShift | uint(level) << kSeenLevelShift |
                   liquid << kSeenLiquidShift,
               uint(plane), uint(chunk.w));

  // From integers, so that the common edge of two faces has the same bits in both.
  const vec2 fraction = vec2(picture.fraction[u], picture.fraction[v]);
  vec2 low = vec2(voxel[u], voxel[v]) - fraction;
  vec2 high = vec2(voxel[u] + (int(face_width(record.x)) << level),
                   voxel[v] + (int(face_height(record.x)) << level)) - fraction;
  if (kLiquidLevels && face_is_part(record.x))
    face_extent(record.x, record.y, upper, voxel[u], voxel[v], fraction, low, high);
  const vec2 rest = vec2(picture.fraction_rest[u], picture.fraction_rest[v]);
  low -= rest, high -= rest;
  if (kExactEdges) write_edges(axis, u, v, offset, vec4(low, high));

  // A face that looks away shrinks to a point.
  if ((face & 1) == 1 ? offset >= 0.0 : offset <= 0.0) {
    gl_Position = vec4(0, 0, 1, 1);
    return;
  }
  bool high_u = (gl_VertexIndex & 1) != 0, high_v = (gl_VertexIndex & 2) != 0;
  vec2 far_corner = high;  // of what the triangles span
  if (kExactEdges && small_on_screen(offset, low, high)) {
    far_corner = low + kTriangleLeg * (high - low);
    high_u = high_u && !high_v;
  }
  gl_Position = placed_corner(axis, u, v, offset, low, far_corner, high_u, high_v);
}
