#version 460
#extension GL_GOOGLE_include_directive : require
// Four vertices a face, pulled from its 8-byte record. Positions are relative to the camera: an exact integer less the
// fraction of the camera's voxel, so that a picture doesn't depend on the distance from the origin.
#include "render/raster/raster.shared.h"
#include "render/extract/face_record.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindFaces) uniform usamplerBuffer faces;
layout(binding = kBindChunks) uniform isamplerBuffer chunks;

#include "render/raster/face_vertex.glsl.h"

layout(location = 0) flat out uvec2 seen;
layout(location = 2) flat out uint detail;
layout(location = 1) flat out vec4 rectangle;  // low u, low v, high u, high v, relative to the camera

void main() {
  const uvec2 record = texelFetch(faces, gl_VertexIndex >> 2).xy;
  const int face = int(face_direction(record.y));
  const int axis = face >> 1;
  const int u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
  const ivec4 chunk = texelFetch(chunks, gl_InstanceIndex);
  const int level = chunk.w & int(kChunkLevel);
  detail = uint(chunk.w);
  const ivec3 voxel = chunk.xyz + (ivec3(face_voxel(record.x)) << level);
  const int plane = voxel[axis] + ((face & 1) << level);
  const float offset = float(plane) - picture.fraction[axis] - picture.fraction_rest[axis];
  seen = uvec2(face_block(record.y) | uint(face) << kSeenFaceShift | uint(level) << kSeenLevelShift, uint(plane));

  // From integers, so that the common edge of two faces has the same bits in both.
  const vec2 fraction = vec2(picture.fraction[u], picture.fraction[v]);
  const vec2 low = vec2(voxel[u], voxel[v]) - fraction;
  const vec2 high = vec2(voxel[u] + (int(face_width(record.x)) << level),
                         voxel[v] + (int(face_height(record.x)) << level)) - fraction;
  rectangle = vec4(low, high);

  // A face that looks away shrinks to a point.
  if ((face & 1) == 1 ? offset >= 0.0 : offset <= 0.0) {
    gl_Position = vec4(0, 0, 1, 1);
    return;
  }
  const bool high_u = (gl_VertexIndex & 1) != 0, high_v = (gl_VertexIndex & 2) != 0;
  gl_Position = placed_corner(axis, u, v, offset, low, high, high_u, high_v);
}
