#include "render/extract/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/extract/kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace render {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using world::BlockId;
using world::LeafMask;

constexpr uint64_t kLastZ = 0x8080808080808080ull;   // z = 7 in each y
constexpr uint64_t kFirstZ = 0x0101010101010101ull;  // z = 0 in each y

using Words = hn::CappedTag<uint64_t, 8>;

// The words before and after each word of a leaf along x, for one piece of it.
HWY_INLINE void words_beside(Words d, const LeafMask& self, uint64_t before, uint64_t after, const uint64_t* padded,
                             size_t at, hn::Vec<Words>& below, hn::Vec<Words>& above) {
  if (hn::Lanes(d) == 8) {
    alignas(64) static constexpr uint64_t kDown[8] = {0, 0, 1, 2, 3, 4, 5, 6};
    alignas(64) static constexpr uint64_t kUp[8] = {1, 2, 3, 4, 5, 6, 7, 7};
    const auto v = hn::Load(d, self.word);
    below =
        hn::IfThenElse(hn::FirstN(d, 1), hn::Set(d, before), hn::TableLookupLanes(v, hn::SetTableIndices(d, kDown)));
    above = hn::IfThenElse(hn::FirstN(d, 7), hn::TableLookupLanes(v, hn::SetTableIndices(d, kUp)), hn::Set(d, after));
  } else {
    below = hn::LoadU(d, padded + at);
    above = hn::LoadU(d, padded + at + 2);
  }
}

void OpaqueFaces(const LeafNeighbourhood* leaves, size_t count, LeafFaces* faces) {
  const Words d;
  const auto last_z = hn::Set(d, kLastZ), first_z = hn::Set(d, kFirstZ);
  for (size_t i = 0; i < count; ++i) {
    const LeafNeighbourhood& n = leaves[i];
    LeafFaces& out = faces[i];
    uint64_t padded[10];
    if (hn::Lanes(d) != 8) {
      padded[0] = n.neighbour[0]->word[7];
      for (int x = 0; x < 8; ++x) padded[x + 1] = n.self->word[x];
      padded[9] = n.neighbour[1]->word[0];
    }
    for (size_t w = 0; w < 8; w += hn::Lanes(d)) {
      const auto self = hn::Load(d, n.self->word + w);
      hn::Vec<Words> below, above;
      words_beside(d, *n.self, n.neighbour[0]->word[7], n.neighbour[1]->word[0], padded, w, below, above);
      hn::Store(hn::AndNot(below, self), d, out.face[0].word + w);
      hn::Store(hn::AndNot(above, self), d, out.face[1].word + w);
      // One y is one byte of a word.
      const auto from_below_y = hn::ShiftRight<56>(hn::Load(d, n.neighbour[2]->word + w));
      const auto from_above_y = hn::ShiftLeft<56>(hn::Load(d, n.neighbour[3]->word + w));
      hn::Store(hn::AndNot(hn::Or(hn::ShiftLeft<8>(self), from_below_y), self), d, out.face[2].word + w);
      hn::Store(hn::AndNot(hn::Or(hn::ShiftRight<8>(self), from_above_y), self), d, out.face[3].word + w);
      // One z is one bit of a byte.
      const auto from_below_z = hn::ShiftRight<7>(hn::And(hn::Load(d, n.neighbour[4]->word + w), last_z));
      const auto from_above_z = hn::ShiftLeft<7>(hn::And(hn::Load(d, n.neighbour[5]->word + w), first_z));
      const auto up_z = hn::ShiftLeft<1>(hn::AndNot(last_z, self));
      const auto down_z = hn::ShiftRight<1>(hn::AndNot(first_z, self));
      hn::Store(hn::AndNot(hn::Or(up_z, from_below_z), self), d, out.face[4].word + w);
      hn::Store(hn::AndNot(hn::Or(down_z, from_above_z), self), d, out.face[5].word + w);
    }
  }
}

uint64_t CountFaces(const LeafFaces* faces, size_t count) {
  const Words d;
  auto sum = hn::Zero(d);
  for (size_t i = 0; i < count; ++i)
    for (const LeafMask& mask : faces[i].face)
      for (size_t w = 0; w < 8; w += hn::Lanes(d)) sum = hn::Add(sum, hn::PopulationCount(hn::Load(d, mask.word + w)));
  return hn::GetLane(hn::SumOfLanes(d, sum));
}

#if HWY_TARGET == HWY_SCALAR

void EqualNeighbours(const BlockId* ids, const BlockId* const next[3], LeafMask out[3]) {
  constexpr int kStep[3] = {64, 8, 1};
  for (int axis = 0; axis < 3; ++axis) {
    out[axis] = LeafMask::none();
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      const bool last = world::offset_in_leaf(i)[axis] == 7;
      if (last && !next[axis]) continue;
      const BlockId beside = last ? next[axis][i - 7 * kStep[axis]] : ids[i + kStep[axis]];
      if (ids[i] == beside) out[axis].set(i);
    }
  }
}

uint64_t RowsFromLeaves(const LeafMask* const leaves[8], uint64_t* rows) {
  uint64_t any = 0;
  for (int i = 0; i < 64; ++i)
    for (int k = 0; k < 8; ++k)
      if (leaves[k]->word[i >> 3] >> (8 * (i & 7)) & 255) any |= 1ull << i;
  if (any == 0) return 0;
  for (int i = 0; i < 64; ++i) {
    uint64_t row = 0;
    for (int k = 0; k < 8; ++k) row |= (leaves[k]->word[i >> 3] >> (8 * (i & 7)) & 255) << (8 * k);
    rows[static_cast<size_t>(i >> 3) * kRowPitch + (i & 7)] = row;
  }
  return any;
}

#else

void EqualNeighbours(const BlockId* ids, const BlockId* const next[3], LeafMask out[3]) {
  const hn::CappedTag<uint16_t, 32> d;
  const hn::CappedTag<uint16_t, 8> d8;
  constexpr size_t kIds = world::kLeafVoxels;
  const size_t lanes = hn::Lanes(d);
  uint8_t* bits_x = reinterpret_cast<uint8_t*>(out[0].word);
  uint8_t* bits_y = reinterpret_cast<uint8_t*>(out[1].word);
  uint8_t* bits_z = reinterpret_cast<uint8_t*>(out[2].word);
  alignas(64) uint64_t over_z[8] = {};
  uint8_t* bits_over_z = reinterpret_cast<uint8_t*>(over_z);
  // The last piece is read from a copy, because it looks up to 8 ids ahead.
  alignas(64) uint16_t tail[64] = {};
  hn::Store(hn::LoadU(d, ids + kIds - lanes), d, tail);
  for (size_t i = 0; i < kIds; i += lanes) {
    const BlockId* at = i + lanes == kIds ? tail : ids + i;
    const auto v = hn::LoadU(d, at);
    hn::StoreMaskBits(d, hn::Eq(v, hn::LoadU(d, at + 1)), bits_z + i / 8);
    hn::StoreMaskBits(d, hn::Eq(v, hn::LoadU(d, at + 8)), bits_y + i / 8);
    // z = 7 against z = 0 of the next leaf, found at the bit of z = 0.
    if (next[2]) hn::StoreMaskBits(d, hn::Eq(hn::LoadU(d, at + 7), hn::LoadU(d, next[2] + i)), bits_over_z + i / 8);
    if (i < kIds - 64) {
      hn::StoreMaskBits(d, hn::Eq(v, hn::LoadU(d, ids + i + 64)), bits_x + i / 8);
    } else if (next[0]) {
      hn::StoreMaskBits(d, hn::Eq(v, hn::LoadU(d, next[0] + i - (kIds - 64))), bits_x + i / 8);
    }
  }
  if (!next[0]) out[0].word[7] = 0;
  for (int x = 0; x < 8; ++x) {
    out[2].word[x] = (out[2].word[x] & ~kLastZ) | (over_z[x] & kFirstZ) << 7;
    uint8_t over_y[8] = {};
    if (next[1])
      hn::StoreMaskBits(d8, hn::Eq(hn::LoadU(d8, ids + x * 64 + 56), hn::LoadU(d8, next[1] + x * 64)), over_y);
    out[1].word[x] = (out[1].word[x] & ~0ull >> 8) | uint64_t{over_y[0]} << 56;
  }
}

// Eight leaves are eight rows of 64 bytes; the result is 64 rows of eight bytes: three perfect shuffles in each
// 128-bit block of 16 bytes, which holds the bytes y of two x.
uint64_t RowsFromLeaves(const LeafMask* const leaves[8], uint64_t* rows) {
  const hn::CappedTag<uint8_t, 64> d;
  const size_t bytes = hn::Lanes(d);
  alignas(64) uint8_t any_bits[8];
  for (size_t at = 0; at < 64; at += bytes) {
    auto all = hn::Zero(d);
    for (int i = 0; i < 8; ++i) all = hn::Or(all, hn::Load(d, reinterpret_cast<const uint8_t*>(leaves[i]->word) + at));
    hn::StoreMaskBits(d, hn::Ne(all, hn::Zero(d)), any_bits + at / 8);
  }
  uint64_t any;
  __builtin_memcpy(&any, any_bits, 8);
  if (any == 0) return 0;
  for (size_t at = 0; at < 64; at += bytes) {
    const auto leaf = [&](int i) { return hn::Load(d, reinterpret_cast<const uint8_t*>(leaves[i]->word) + at); };
    const auto v0 = leaf(0), v1 = leaf(1), v2 = leaf(2), v3 = leaf(3);
    const auto v4 = leaf(4), v5 = leaf(5), v6 = leaf(6), v7 = leaf(7);
    const auto low = [&](auto a, auto b) { return hn::InterleaveLower(d, a, b); };
    const auto high = [&](auto a, auto b) { return hn::InterleaveUpper(d, a, b); };
    const auto a_low = low(v0, v4), a_high = high(v0, v4), b_low = low(v1, v5), b_high = high(v1, v5);
    const auto c_low = low(v2, v6), c_high = high(v2, v6), d_low = low(v3, v7), d_high = high(v3, v7);
    const auto e0 = low(a_low, c_low), e1 = high(a_low, c_low), e2 = low(a_high, c_high), e3 = high(a_high, c_high);
    const auto f0 = low(b_low, d_low), f1 = high(b_low, d_low), f2 = low(b_high, d_high), f3 = high(b_high, d_high);
    alignas(64) uint64_t block[8][8];  // [pair of rows][block of 128 bits, then which of the two]
    const hn::Repartition<uint64_t, decltype(d)> d64;
    hn::Store(hn::BitCast(d64, low(e0, f0)), d64, block[0]);
    hn::Store(hn::BitCast(d64, high(e0, f0)), d64, block[1]);
    hn::Store(hn::BitCast(d64, low(e1, f1)), d64, block[2]);
    hn::Store(hn::BitCast(d64, high(e1, f1)), d64, block[3]);
    hn::Store(hn::BitCast(d64, low(e2, f2)), d64, block[4]);
    hn::Store(hn::BitCast(d64, high(e2, f2)), d64, block[5]);
    hn::Store(hn::BitCast(d64, low(e3, f3)), d64, block[6]);
    hn::Store(hn::BitCast(d64, high(e3, f3)), d64, block[7]);
    const hn::CappedTag<uint64_t, 2> d2;
    for (size_t b = 0; b < bytes / 16; ++b) {
      uint64_t* to = rows + (at / 8 + 2 * b) * kRowPitch;
      for (int k = 0; k < 4; ++k) hn::StoreU(hn::Load(d2, block[k] + 2 * b), d2, to + 2 * k);
      for (int k = 0; k < 4; ++k) hn::StoreU(hn::Load(d2, block[4 + k] + 2 * b), d2, to + kRowPitch + 2 * k);
    }
  }
  return any;
}

#endif  // HWY_SCALAR

template <int kShift>
HWY_INLINE hn::Vec<Words> swap_bits(Words d, hn::Vec<Words> w, uint64_t mask) {
  const auto t = hn::And(hn::Xor(w, hn::ShiftRight<kShift>(w)), hn::Set(d, mask));
  return hn::Xor(w, hn::Xor(t, hn::ShiftLeft<kShift>(t)));
}

void SwapYz(const LeafMask& in, LeafMask& out) {
  const Words d;
  for (size_t w = 0; w < 8; w += hn::Lanes(d)) {
    auto v = hn::Load(d, in.word + w);
    v = swap_bits<7>(d, v, 0x00aa00aa00aa00aaull);
    v = swap_bits<14>(d, v, 0x0000cccc0000ccccull);
    v = swap_bits<28>(d, v, 0x00000000f0f0f0f0ull);
    hn::Store(v, d, out.word + w);
  }
}

// Within one word: fills along z and y, doubling the reach each time (Kogge-Stone). The caller loops for corners.
HWY_INLINE uint64_t fill_word(uint64_t reached, uint64_t open) {
  uint64_t o = open & ~kFirstZ, f = reached;
  f |= o & (f << 1), o &= o << 1;
  f |= o & (f << 2), o &= o << 2;
  f |= o & (f << 4);
  o = open & ~kLastZ;
  f |= o & (f >> 1), o &= o >> 1;
  f |= o & (f >> 2), o &= o >> 2;
  f |= o & (f >> 4);
  o = open;
  f |= o & (f << 8), o &= o << 8;
  f |= o & (f << 16), o &= o << 16;
  f |= o & (f << 32);
  o = open;
  f |= o & (f >> 8), o &= o >> 8;
  f |= o & (f >> 16), o &= o >> 16;
  f |= o & (f >> 32);
  return f;
}

bool FloodLeaf(const LeafMask& open, const LeafMask& entry, LeafMask& reached) {
  uint64_t m[8], any_new = 0;
  for (int x = 0; x < 8; ++x) {
    m[x] = reached.word[x] | (entry.word[x] & open.word[x]);
    any_new |= m[x] & ~reached.word[x];
  }
  if (any_new == 0) return false;
  // Sweep along x and back until nothing changes; most leaves need two rounds.
  for (uint64_t changed = 1; changed != 0;) {
    changed = 0;
    for (int x = 0; x < 8; ++x) {
      const uint64_t before = m[x];
      if (x > 0) m[x] |= m[x - 1] & open.word[x];
      m[x] = fill_word(m[x], open.word[x]);
      changed |= before ^ m[x];
    }
    for (int x = 6; x >= 0; --x) {
      const uint64_t before = m[x];
      m[x] |= m[x + 1] & open.word[x];
      if (m[x] == before) continue;
      m[x] = fill_word(m[x], open.word[x]);
      changed |= before ^ m[x];
    }
  }
  for (int x = 0; x < 8; ++x) reached.word[x] = m[x];
  return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace render
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace render {

HWY_EXPORT(OpaqueFaces);
HWY_EXPORT(CountFaces);
HWY_EXPORT(EqualNeighbours);
HWY_EXPORT(RowsFromLeaves);
HWY_EXPORT(SwapYz);
HWY_EXPORT(FloodLeaf);

void opaque_faces(const LeafNeighbourhood* leaves, size_t count, LeafFaces* faces) {
  HWY_DYNAMIC_DISPATCH(OpaqueFaces)(leaves, count, faces);
}
uint64_t count_faces(const LeafFaces* faces, size_t count) { return HWY_DYNAMIC_DISPATCH(CountFaces)(faces, count); }
void equal_neighbours(const world::BlockId* ids, const world::BlockId* const next[3], world::LeafMask out[3]) {
  HWY_DYNAMIC_DISPATCH(EqualNeighbours)(ids, next, out);
}
uint64_t rows_from_leaves(const world::LeafMask* const leaves[8], uint64_t* rows) {
  return HWY_DYNAMIC_DISPATCH(RowsFromLeaves)(leaves, rows);
}
void swap_yz(const world::LeafMask& in, world::LeafMask& out) { HWY_DYNAMIC_DISPATCH(SwapYz)(in, out); }
bool flood_leaf(const world::LeafMask& open, const world::LeafMask& entry, world::LeafMask& reached) {
  return HWY_DYNAMIC_DISPATCH(FloodLeaf)(open, entry, reached);
}

}  // namespace render
#endif
