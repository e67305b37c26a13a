// One rectangle of voxel faces in 8 bytes, the same for C++ and GLSL (there: a uvec2).
//
//   word 0   bits  0..5  z   6..11 y   12..17 x   of the rectangle's voxel with the smallest coordinates, in its chunk
//            bits 18..23 width - 1     24..29 height - 1     30..31 zero
//   word 1   bits  0..15 block id      16..18 face (-X +X -Y +Y -Z +Z)      19..31 zero
//
// width runs along the axis u, height along v:    face axis   x  y  z
//                                                 u           z  z  y
//                                                 v           y  x  x
#ifndef LOAM_FACE_RECORD_SHARED_H
#define LOAM_FACE_RECORD_SHARED_H

#ifdef __cplusplus
#include <cstdint>

#include <glm/vec3.hpp>
#define LOAM_SHARED inline constexpr
namespace render {
using uint = uint32_t;
using glm::uvec3;
#else
#define LOAM_SHARED
#endif

LOAM_SHARED uvec3 face_voxel(uint word0) { return uvec3((word0 >> 12) & 63u, (word0 >> 6) & 63u, word0 & 63u); }
LOAM_SHARED uint face_width(uint word0) { return ((word0 >> 18) & 63u) + 1u; }
LOAM_SHARED uint face_height(uint word0) { return ((word0 >> 24) & 63u) + 1u; }
LOAM_SHARED uint face_block(uint word1) { return word1 & 65535u; }
LOAM_SHARED uint face_direction(uint word1) { return (word1 >> 16) & 7u; }

// Corner 0..3 of the rectangle in voxel corners of the chunk (0..64), counter-clockwise seen from outside.
LOAM_SHARED uvec3 face_corner(uint word0, uint word1, uint corner) {
  uint face = face_direction(word1);
  uint axis = face >> 1;
  // u x v points to -x, +y, -z: the other direction goes round the other way.
  bool turned = ((face & 1u) != 0u) != (axis == 1u);
  bool second = corner == 1u || corner == 2u, third = corner >= 2u;
  uint along_u = (turned ? third : second) ? face_width(word0) : 0u;
  uint along_v = (turned ? second : third) ? face_height(word0) : 0u;
  uint out_of = face & 1u;
  uvec3 offset = axis == 0u   ? uvec3(out_of, along_v, along_u)
                 : axis == 1u ? uvec3(along_v, out_of, along_u)
                              : uvec3(along_v, along_u, out_of);
  return face_voxel(word0) + offset;
}

#ifdef __cplusplus
// A record as the GPU reads it.
struct FaceRecord {
  uint32_t word0 = 0, word1 = 0;
  friend constexpr bool operator==(const FaceRecord&, const FaceRecord&) = default;
};
static_assert(sizeof(FaceRecord) == 8);

// width and height 1..64; x, y, z 0..63.
constexpr FaceRecord make_face_record(uint x, uint y, uint z, uint width, uint height, uint face, uint block) {
  return {z | y << 6 | x << 12 | (width - 1) << 18 | (height - 1) << 24, block | face << 16};
}
}  // namespace render
#endif
#undef LOAM_SHARED
#endif
