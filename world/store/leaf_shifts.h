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

/// Bit v: any of the six voxels beside v is set; `beyond[face]`: the leaf on that side.
constexpr LeafMask across_any(const LeafMask& mask, const LeafMask* const* beyond) {
  constexpr uint64_t kLastZMask = kFirstZMask << 7;
  LeafMask m;
  for (int x = 0; x < 8; ++x) {
    const uint64_t w = mask.word[x];
    m.word[x] = (x > 0 ? mask.word[x - 1] : beyond[kFaceNegX]->word[7]) |
                (x < 7 ? mask.word[x + 1] : beyond[kFacePosX]->word[0]) | w << 8 | beyond[kFaceNegY]->word[x] >> 56 |
                w >> 8 | beyond[kFacePosY]->word[x] << 56 | (w & ~kLastZMask) << 1 |
                (beyond[kFaceNegZ]->word[x] >> 7 & kFirstZMask) | (w >> 1 & ~kLastZMask) |
                (beyond[kFacePosZ]->word[x] & kFirstZMask) << 7;
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
