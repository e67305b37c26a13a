#version 460
#extension GL_GOOGLE_include_directive : require
// Four vertices a face, pulled from its 8-byte record. Positions are relative to the camera: an exact integer less the
// fraction of the camera's voxel, so that a picture doesn't depend on the distance from the origin.
#include "render/raster/raster.shared.h"
#include "render/extract/face_record.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindFaces, std430) readonly buffer Faces { uvec2 faces[]; };
layout(binding = kBindChunks, std430) readonly buffer Chunks { ivec4 chunks[]; };

layout(location = 0) flat out uvec2 seen;
layout(location = 2) flat out uint detail;
layout(location = 1) flat out vec4 rectangle;  // low u, low v, high u, high v, relative to the camera

void main() {
  const uvec2 record = faces[uint(gl_VertexIndex) >> 2];
  const int face = int(face_direction(record.y));
  const int axis = face >> 1;
  const int u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
  const ivec4 chunk = chunks[gl_InstanceIndex];
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
  vec3 point;
  // Clipping in float can't place a face whose plane is close for its size. With exact edges such a face, where it is
  // near the camera's foot on its plane, asks all pixels, in front of everything: it is nearer wherever it is seen at
  // more than a tenth of a pixel. Else it is scaled about the camera, which looks the same.
  if (kExactEdges && abs(offset) < kNearestFace && all(lessThan(low, vec2(1))) && all(greaterThan(high, vec2(-1)))) {
    gl_Position = vec4(high_u ? 1 : -1, high_v ? 1 : -1, 1, 1);
    return;
  }
  point[axis] = offset;
  point[u] = high_u ? high.x : low.x;
  point[v] = high_v ? high.y : low.y;
  const float distance = max(abs(offset), kNearestFace);
  point *= distance / abs(offset);
  if (kExactEdges) {
    // Vertices are rounded to 1/256 pixel. Move each edge outwards by a little more on the screen, so that every pixel
    // that the exact face covers is asked; the fragment shader answers exactly. An edge along v that moves by e along u
    // moves by e * (f^2 h / z^3) / |dP/dv| pixels, with |dP/dv| = f / z^2 |v z - p v_forward| and h the distance of the plane.
    const float depth = dot(picture.clip_w.xyz, point);
    if (depth > 0.0) {
      vec3 along_u = -point * picture.clip_w[u], along_v = -point * picture.clip_w[v];
      along_u[u] += depth;
      along_v[v] += depth;
      const float scale = picture.screen.z * depth / distance;
      const vec2 move = min(scale * vec2(length(along_v), length(along_u)), vec2(0.5 * depth));
      point[u] += high_u ? move.x : -move.x;
      point[v] += high_v ? move.y : -move.y;
    }
  }
  // Reversed depth, infinite far plane: depth = near / distance.
  gl_Position = vec4(dot(picture.clip_x.xyz, point), dot(picture.clip_y.xyz, point), picture.fraction.w,
                     dot(picture.clip_w.xyz, point));
}
