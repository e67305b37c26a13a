/// A leaf's 512 bits as the eight slices across an axis.
#pragma once

#include <cstdint>

namespace world {

/// Byte i of word j becomes byte j of word i.
inline void transpose_bytes(uint64_t w[8]) {
  const auto swap = [&](int i, int j, int shift, uint64_t mask) {
    const uint64_t t = (w[i] >> shift ^ w[j]) & mask;
    w[j] ^= t, w[i] ^= t << shift;
  };
  for (int i = 0; i < 4; ++i) swap(i, i + 4, 32, 0x00000000ffffffffull);
  for (int i : {0, 1, 4, 5}) swap(i, i + 2, 16, 0x0000ffff0000ffffull);
  for (int i : {0, 2, 4, 6}) swap(i, i + 1, 8, 0x00ff00ff00ff00ffull);
}

/// Bit 8 i + j becomes bit 8 j + i.
inline uint64_t transpose_bits(uint64_t w) {
  uint64_t t = (w ^ w >> 7) & 0x00aa00aa00aa00aaull;
  w ^= t ^ t << 7;
  t = (w ^ w >> 14) & 0x0000cccc0000ccccull;
  w ^= t ^ t << 14;
  t = (w ^ w >> 28) & 0x00000000f0f0f0f0ull;
  return w ^ t ^ t << 28;
}

/// Of a leaf's 16 words in a BrickVolume. Word k holds bit row * 8 + column of slice k; rows and columns are the other
/// two axes in ascending order.
inline void slices_of_leaf(const uint32_t words[16], int axis, uint64_t slices[8]) {
  for (int y = 0; y < 8; y += 2) {
    uint64_t even = 0, odd = 0;  // a byte each x
    for (int half = 0; half < 2; ++half) {
      const uint32_t low = words[half * 8 + y], high = words[half * 8 + y + 1];  // z 0..3, 4..7
      even |= static_cast<uint64_t>((low & 0x0f0f0f0f) | (high & 0x0f0f0f0f) << 4) << (32 * half);
      odd |= static_cast<uint64_t>((low >> 4 & 0x0f0f0f0f) | (high & 0xf0f0f0f0)) << (32 * half);
    }
    slices[y] = even, slices[y + 1] = odd;
  }
  if (axis == 1) return;
  transpose_bytes(slices);
  if (axis == 0) return;
  for (int x = 0; x < 8; ++x) slices[x] = transpose_bits(slices[x]);
  transpose_bytes(slices);
}

}  // namespace world
