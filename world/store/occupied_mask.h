/// Which voxels of a leaf are not air, straight from its ids.
#pragma once

#include <cstring>

#include "world/blocks/block.h"
#include "world/store/leaf_mask.h"

namespace world {

/// Bit i: values[i] is not air, of 512.
inline LeafMask occupied_mask(const BlockId* values) {
  LeafMask mask;
  for (int w = 0; w < 8; ++w) {
    uint64_t bits = 0;
    for (int b = 0; b < 64; b += 4) {
      // Four at a time: the top bit of each 16 says "not air", and a product moves the four bits together.
      uint64_t four;
      std::memcpy(&four, values + w * 64 + b, sizeof four);
      constexpr uint64_t kTop = 0x8000800080008000ull;
      const uint64_t any = (((four & ~kTop) + ~kTop) | four) & kTop;
      bits |= ((any >> 15) * 0x0001000200040008ull >> 48 & 15) << b;
    }
    mask.word[w] = bits;
  }
  return mask;
}

}  // namespace world
