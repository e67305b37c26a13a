/// A leaf's mask as seen from the next voxel: what rules over masks ask of neighbours. Bits as in leaf_mask.h.
#pragma once

#include "world/store/leaf_mask.h"

namespace world {

inline constexpr uint64_t kFirstZMask = 0x0101010101010101ull;  // of a word: voxels with z = 0 in the leaf
inline constexpr uint64_t kFirstYMask = 0xffull;                // y = 0

/// Bit v: the voxel beside v across the face is set in `mask`, or in `beyond`, the leaf on that side.
constexpr LeafMask across(const LeafMask& mask, const LeafMask& beyond, int face) {
  LeafMask m;
  for (int x = 0; x < 8; ++x) {
    const uint64_t w = mask.word[x], b = beyond.word[x];
    switch (face) {
      case kFaceNegX:
        m.word[x] = x > 0 ? mask.word[x - 1] : beyond.word[7];
        break;
      case kFacePosX:
        m.word[x] = x < 7 ? mask.word[x + 1] : beyond.word[0];
        break;
      case kFaceNegY:
        m.word[x] = w << 8 | b >> 56;
        break;
      case kFacePosY:
        m.word[x] = w >> 8 | b << 56;
        break;
      case kFaceNegZ:
        m.word[x] = (w & ~(kFirstZMask << 7)) << 1 | (b >> 7 & kFirstZMask);
        break;
      default:
        m.word[x] = (w >> 1 & ~(kFirstZMask << 7)) | (b & kFirstZMask) << 7;
        break;
    }
  }
  return m;
}

/// The voxels of a leaf that touch its side.
constexpr LeafMask side_of(int face) {
  LeafMask m;
  for (int x = 0; x < 8; ++x) {
    switch (face) {
      case kFaceNegX:
        m.word[x] = x == 0 ? ~0ull : 0;
        break;
      case kFacePosX:
        m.word[x] = x == 7 ? ~0ull : 0;
        break;
      case kFaceNegY:
        m.word[x] = kFirstYMask;
        break;
      case kFacePosY:
        m.word[x] = kFirstYMask << 56;
        break;
      case kFaceNegZ:
        m.word[x] = kFirstZMask;
        break;
      default:
        m.word[x] = kFirstZMask << 7;
        break;
    }
  }
  return m;
}

}  // namespace world
