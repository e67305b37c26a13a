// One rectangle of voxel faces in 8 bytes, the same for C++ and GLSL (there: a uvec2).
//
//   word 0   bits  0..5  z   6..11 y   12..17 x   of the rectangle's voxel with the smallest coordinates, in its chunk
//            bits 18..23 width - 1     24..29 height - 1     30..31 zero
//   word 1   bits  0..15 block id      16..18 face (-X +X -Y +Y -Z +Z)      19..31 zero
//
// Bit 30 of word 0 is set where the face is one of a liquid that doesn't fill its voxel, or is partly hidden by one: a
// top lies at so many sixteenths of the voxel, a side reaches from one height to another. The upper of the two stands
// in word 1 (16 as 0), in bits 19..22 of opaque blocks' faces, in bits 12..15 of those of see-through ones; the lower
// one, of a side, where its extent along y would stand, which is 1.
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

LOAM_SHARED bool face_is_part(uint word0) { return (word0 & 0x40000000u) != 0u; }
// Whether the height, or else the width, of such a record is the lower end of a side, in sixteenths.
LOAM_SHARED bool part_in_height(uint word0, uint word1) { return face_is_part(word0) && face_direction(word1) < 2u; }
LOAM_SHARED bool part_in_width(uint word0, uint word1) { return face_is_part(word0) && face_direction(word1) > 3u; }
// Its ends in sixteenths from the voxel's bottom; `upper`: the four bits of word 1.
LOAM_SHARED uint part_bottom(uint word0, uint word1) {
  return part_in_height(word0, word1)  ? face_height(word0) - 1u
         : part_in_width(word0, word1) ? face_width(word0) - 1u
                                       : 0u;
}
LOAM_SHARED uint part_top(uint upper) { return upper == 0u ? 16u : upper; }
LOAM_SHARED uint opaque_part_upper(uint word1) { return (word1 >> 19) & 15u; }
LOAM_SHARED uint see_through_part_upper(uint word1) { return (word1 >> 12) & 15u; }
LOAM_SHARED uint see_through_kind(uint word1) { return word1 & 0xfffu; }
LOAM_SHARED uint see_through_beyond(uint word1) { return (word1 >> 19) & 0xfffu; }

// Corner 0..3 of the rectangle in voxel corners of the chunk (0..64), counter-clockwise seen from outside. A part's are
// those of the whole face.
LOAM_SHARED uvec3 face_corner(uint word0, uint word1, uint corner) {
  uint face = face_direction(word1);
  uint axis = face >> 1;
  // u x v points to -x, +y, -z: the other direction goes round the other way.
  bool turned = ((face & 1u) != 0u) != (axis == 1u);
  bool second = corner == 1u || corner == 2u, third = corner >= 2u;
  uint width = part_in_width(word0, word1) ? 1u : face_width(word0);
  uint height = part_in_height(word0, word1) ? 1u : face_height(word0);
  uint along_u = (turned ? third : second) ? width : 0u;
  uint along_v = (turned ? second : third) ? height : 0u;
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
