/// 512 bits, one for each voxel of a leaf: word x, bit y*8 + z. One AVX-512 register.
#pragma once

#include <bit>
#include <cstdint>

#include "world/space/coords.h"

namespace world {

struct alignas(64) LeafMask {
  uint64_t word[8] = {};

  static constexpr LeafMask none() { return {}; }
  static constexpr LeafMask all() {
    LeafMask m;
    for (uint64_t& w : m.word) w = ~0ull;
    return m;
  }
  constexpr bool test(int index) const { return word[index >> 6] >> (index & 63) & 1; }
  constexpr bool test(VoxelPos v) const { return test(index_in_leaf(v)); }
  constexpr void set(int index) { word[index >> 6] |= 1ull << (index & 63); }
  constexpr void clear(int index) { word[index >> 6] &= ~(1ull << (index & 63)); }
  constexpr bool is_none() const {
    uint64_t any = 0;
    for (uint64_t w : word) any |= w;
    return any == 0;
  }
  constexpr bool is_all() const {
    uint64_t every = ~0ull;
    for (uint64_t w : word) every &= w;
    return every == ~0ull;
  }
  constexpr int count() const {
    int n = 0;
    for (uint64_t w : word) n += std::popcount(w);
    return n;
  }
  friend constexpr bool operator==(const LeafMask&, const LeafMask&) = default;
};
static_assert(sizeof(LeafMask) == 64);

inline constexpr LeafMask kNoneMask = LeafMask::none();
inline constexpr LeafMask kAllMask = LeafMask::all();

}  // namespace world
