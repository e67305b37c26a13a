#version 460
#extension GL_GOOGLE_include_directive : require
// Four vertices a face of a shape, pulled from its 8-byte record and the table of faces. As faces.vert.glsl.
#include "render/raster/raster.shared.h"
#include "render/extract/face_record.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindFaces) uniform usamplerBuffer faces;
layout(binding = kBindChunks) uniform isamplerBuffer chunks;
layout(binding = kBindShapeQuads) uniform samplerBuffer quads;

#define RAY_TO_FRAGMENTS
#include "render/raster/fragment_ray.glsl.h"

layout(location = 0) flat out uvec2 seen;
layout(location = 2) flat out uint detail;
layout(location = 1) flat out vec3 corner;  // relative to the camera

void main() {
  write_ray();
  const uvec2 record = texelFetch(faces, gl_VertexIndex >> 2).xy;
  const int at = int(record.y * kQuadVectors);
  const vec4 first = texelFetch(quads, at), along = texelFetch(quads, at + 3);
  const vec3 u = texelFetch(quads, at + 1).xyz, v = texelFetch(quads, at + 2).xyz;
  const ivec4 chunk = texelFetch(chunks, gl_InstanceIndex);
  const ivec3 voxel = chunk.xyz + ivec3(face_voxel(record.x));
  detail = uint(chunk.w);
  seen = uvec2(kSeenShape | record.y, uint(gl_InstanceIndex) << kSeenChunkShift | (record.x & 0x3ffffu));
  corner = vec3(voxel) - picture.fraction.xyz - picture.fraction_rest.xyz + first.xyz;

  // A face of a box that looks away shrinks to a point; a sheet has two sides.
  const float height = -dot(along.xyz, corner);
  if (floatBitsToInt(along.w) != 6 && height <= 0.0) {
    gl_Position = vec4(0, 0, 1, 1);
    return;
  }
  const bool high_u = (gl_VertexIndex & 1) != 0, high_v = (gl_VertexIndex & 2) != 0;
  vec3 point = corner + (high_u ? u : vec3(0)) + (high_v ? v : vec3(0));
  if (kExactEdges) {
    // Edges move outwards by a little more than vertices are rounded by, so that every pixel that the exact face covers
    // is asked: see faces.vert.glsl.
    const float depth = dot(picture.clip_w.xyz, point);
    if (depth > 0.0) {
      const vec3 unit_u = normalize(u), unit_v = normalize(v);
      const vec3 along_u = unit_u * depth - point * dot(picture.clip_w.xyz, unit_u);
      const vec3 along_v = unit_v * depth - point * dot(picture.clip_w.xyz, unit_v);
      const float scale = picture.screen.z * depth / max(abs(height), kNearestFace);
      const vec2 move = min(scale * vec2(length(along_v), length(along_u)), vec2(0.5 * depth));
      point += (high_u ? move.x : -move.x) * unit_u + (high_v ? move.y : -move.y) * unit_v;
    }
  }
  gl_Position = vec4(dot(picture.clip_x.xyz, point), dot(picture.clip_y.xyz, point), picture.fraction.w,
                     dot(picture.clip_w.xyz, point));
}
