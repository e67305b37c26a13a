#include "render/extract/kernels.h"

#include <bit>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/extract/kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace render {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using world::BlockId;
using world::face_axis;
using world::LeafMask;

constexpr uint64_t kLastZ = 0x8080808080808080ull;   // z = 7 in each y
constexpr uint64_t kFirstZ = 0x0101010101010101ull;  // z = 0 in each y

using Words = hn::CappedTag<uint64_t, 8>;

/// What lies one step towards each face of the voxels of a piece of a leaf.
struct Beside {
  hn::Vec<Words> towards[6];
};

/// For words [at, at + Lanes) of a leaf.
HWY_INLINE Beside beside(Words d, const LeafNeighbourhood& n, size_t at) {
  const auto last_z = hn::Set(d, kLastZ), first_z = hn::Set(d, kFirstZ);
  const auto self = hn::Load(d, n.self->word + at);
  const uint64_t before = n.neighbour[0]->word[7], after = n.neighbour[1]->word[0];
  Beside b;
  // One x is one word.
  if (hn::Lanes(d) == 8) {
    alignas(64) static constexpr uint64_t kDown[8] = {0, 0, 1, 2, 3, 4, 5, 6};
    alignas(64) static constexpr uint64_t kUp[8] = {1, 2, 3, 4, 5, 6, 7, 7};
    const auto down = hn::TableLookupLanes(self, hn::SetTableIndices(d, kDown));
    const auto up = hn::TableLookupLanes(self, hn::SetTableIndices(d, kUp));
    b.towards[0] = hn::IfThenElse(hn::FirstN(d, 1), hn::Set(d, before), down);
    b.towards[1] = hn::IfThenElse(hn::FirstN(d, 7), up, hn::Set(d, after));
  } else {
    uint64_t padded[10] = {before};
    for (int x = 0; x < 8; ++x) padded[x + 1] = n.self->word[x];
    padded[9] = after;
    b.towards[0] = hn::LoadU(d, padded + at);
    b.towards[1] = hn::LoadU(d, padded + at + 2);
  }
  // One y is one byte of a word.
  b.towards[2] = hn::Or(hn::ShiftLeft<8>(self), hn::ShiftRight<56>(hn::Load(d, n.neighbour[2]->word + at)));
  b.towards[3] = hn::Or(hn::ShiftRight<8>(self), hn::ShiftLeft<56>(hn::Load(d, n.neighbour[3]->word + at)));
  // One z is one bit of a byte.
  const auto below_z = hn::ShiftRight<7>(hn::And(hn::Load(d, n.neighbour[4]->word + at), last_z));
  const auto above_z = hn::ShiftLeft<7>(hn::And(hn::Load(d, n.neighbour[5]->word + at), first_z));
  b.towards[4] = hn::Or(hn::ShiftLeft<1>(hn::AndNot(last_z, self)), below_z);
  b.towards[5] = hn::Or(hn::ShiftRight<1>(hn::AndNot(first_z, self)), above_z);
  return b;
}

uint64_t OpaqueFaces(const LeafNeighbourhood* leaves, size_t count, LeafFaces* faces) {
  const Words d;
  uint64_t not_none = 0;
  for (size_t i = 0; i < count; ++i) {
    auto any = hn::Zero(d);
    for (size_t w = 0; w < 8; w += hn::Lanes(d)) {
      const auto self = hn::Load(d, leaves[i].self->word + w);
      const Beside opaque = beside(d, leaves[i], w);
      for (int f = 0; f < 6; ++f) {
        const auto face = hn::AndNot(opaque.towards[f], self);
        any = hn::Or(any, face);
        hn::Store(face, d, faces[i].face[f].word + w);
      }
    }
    not_none |= uint64_t{!hn::AllTrue(d, hn::Eq(any, hn::Zero(d)))} << i;
  }
  return not_none;
}

bool TransparentFaces(const LeafNeighbourhood& occupied, const LeafNeighbourhood& opaque, LeafFaces& faces,
                      LeafFaces& touching) {
  const Words d;
  auto any = hn::Zero(d);
  for (size_t w = 0; w < 8; w += hn::Lanes(d)) {
    const auto self = hn::AndNot(hn::Load(d, opaque.self->word + w), hn::Load(d, occupied.self->word + w));
    const Beside taken = beside(d, occupied, w), hidden = beside(d, opaque, w);
    for (int f = 0; f < 6; ++f) {
      uint64_t* const face = faces.face[f].word + w;
      hn::Store(hn::Or(hn::Load(d, face), hn::AndNot(taken.towards[f], self)), d, face);
      const auto touches = hn::And(self, hn::AndNot(hidden.towards[f], taken.towards[f]));
      hn::Store(touches, d, touching.face[f].word + w);
      any = hn::Or(any, touches);
    }
  }
  return !hn::AllTrue(d, hn::Eq(any, hn::Zero(d)));
}

void RemoveFacesTowards(const LeafNeighbourhood& around, LeafFaces& faces) {
  const Words d;
  for (size_t w = 0; w < 8; w += hn::Lanes(d)) {
    const Beside there = beside(d, around, w);
    for (int f = 0; f < 6; ++f) {
      uint64_t* const face = faces.face[f].word + w;
      hn::Store(hn::AndNot(there.towards[f], hn::Load(d, face)), d, face);
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

void lay_full(const uint8_t* const leaves[8], uint64_t* rows) {
  for (int i = 0; i < 64; ++i) {
    uint64_t row = 0;
    for (int k = 0; k < 8; ++k) row |= uint64_t{leaves[k][i]} << (8 * k);
    rows[static_cast<size_t>(i >> 3) * kRowPitch + static_cast<size_t>(i & 7)] = row;
  }
}
void lay_few(const uint8_t* const* leaves, const int* places, int count, uint64_t* rows) {
  for (int i = 0; i < 64; ++i) {
    uint64_t row = 0;
    for (int k = 0; k < count; ++k) row |= uint64_t{leaves[k][i]} << (8 * places[k]);
    rows[static_cast<size_t>(i >> 3) * kRowPitch + static_cast<size_t>(i & 7)] = row;
  }
}
uint64_t rows_not_zero(const uint8_t* const* leaves, int count) {
  uint64_t any = 0;
  for (int i = 0; i < 64; ++i)
    for (int k = 0; k < count; ++k) any |= uint64_t{leaves[k][i] != 0} << i;
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
  const hn::Repartition<uint8_t, decltype(d)> bytes;
  // The last piece looks for y + 1 beyond the end, in a copy.
  alignas(64) uint16_t tail[64] = {};
  hn::Store(hn::LoadU(d, ids + kIds - lanes), d, tail);
  for (size_t i = 0; i < kIds; i += lanes) {
    const auto v = hn::LoadU(d, ids + i);
    // One y is a block of 128 bits: shifts within it go along z.
    const auto next_z = hn::BitCast(d, hn::ShiftRightBytes<2>(bytes, hn::BitCast(bytes, v)));
    hn::StoreMaskBits(d, hn::Eq(v, next_z), bits_z + i / 8);
    hn::StoreMaskBits(d, hn::Eq(v, hn::LoadU(d, i + lanes == kIds ? tail + 8 : ids + i + 8)), bits_y + i / 8);
    if (next[2]) {
      // z = 7 against z = 0 of the next leaf, found at the bit of z = 0.
      const auto last_z = hn::BitCast(d, hn::ShiftRightBytes<14>(bytes, hn::BitCast(bytes, v)));
      hn::StoreMaskBits(d, hn::Eq(last_z, hn::LoadU(d, next[2] + i)), bits_over_z + i / 8);
    }
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

/// Eight leaves are eight rows of 64 bytes; the result is 64 rows of eight bytes: three perfect shuffles in each
/// 128-bit block of 16 bytes, which holds the bytes y of two x.
void lay_full(const uint8_t* const leaves[8], uint64_t* rows) {
  const hn::CappedTag<uint8_t, 64> d;
  const hn::Repartition<uint64_t, decltype(d)> d64;
  const size_t bytes = hn::Lanes(d);
  for (size_t at = 0; at < 64; at += bytes) {
    const auto leaf = [&](int i) HWY_ATTR { return hn::Load(d, leaves[i] + at); };
    const auto v0 = leaf(0), v1 = leaf(1), v2 = leaf(2), v3 = leaf(3);
    const auto v4 = leaf(4), v5 = leaf(5), v6 = leaf(6), v7 = leaf(7);
    const auto low = [&](auto a, auto b) HWY_ATTR { return hn::InterleaveLower(d, a, b); };
    const auto high = [&](auto a, auto b) HWY_ATTR { return hn::InterleaveUpper(d, a, b); };
    const auto a_low = low(v0, v4), a_high = high(v0, v4), b_low = low(v1, v5), b_high = high(v1, v5);
    const auto c_low = low(v2, v6), c_high = high(v2, v6), d_low = low(v3, v7), d_high = high(v3, v7);
    const auto e0 = low(a_low, c_low), e1 = high(a_low, c_low), e2 = low(a_high, c_high), e3 = high(a_high, c_high);
    const auto f0 = low(b_low, d_low), f1 = high(b_low, d_low), f2 = low(b_high, d_high), f3 = high(b_high, d_high);
    alignas(64) uint64_t block[8][8];  // [pair of rows][block of 128 bits, then which of the two]
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
}

/// The same where few of the eight are not empty: bytes widened and put in place.
void lay_few(const uint8_t* const* leaves, const int* places, int count, uint64_t* rows) {
  const Words d;
  const hn::Rebind<uint8_t, Words> d8;
  const hn::Rebind<uint32_t, Words> d32;
  for (size_t x = 0; x < 8; ++x)
    for (size_t y = 0; y < 8; y += hn::Lanes(d)) {
      auto row = hn::Zero(d);
      for (int k = 0; k < count; ++k) {
        const auto wide = hn::PromoteTo(d, hn::PromoteTo(d32, hn::LoadU(d8, leaves[k] + x * 8 + y)));
        row = hn::Or(row, hn::ShiftLeftSame(wide, 8 * places[k]));
      }
      hn::StoreU(row, d, rows + x * kRowPitch + y);
    }
}

uint64_t rows_not_zero(const uint8_t* const* leaves, int count) {
  const hn::CappedTag<uint8_t, 64> d;
  uint64_t any = 0;
  for (size_t at = 0; at < 64; at += hn::Lanes(d)) {
    auto all = hn::Zero(d);
    for (int k = 0; k < count; ++k) all = hn::Or(all, hn::Load(d, leaves[k] + at));
    uint8_t any_bits[8] = {};
    hn::StoreMaskBits(d, hn::Ne(all, hn::Zero(d)), any_bits);
    uint64_t piece;
    __builtin_memcpy(&piece, any_bits, 8);
    any |= piece << at;
  }
  return any;
}

#endif  // HWY_SCALAR

template <int kShift, class D>
HWY_INLINE hn::Vec<D> swap_bits(D d, hn::Vec<D> w, uint64_t mask) {
  const auto t = hn::And(hn::Xor(w, hn::ShiftRight<kShift>(w)), hn::Set(d, mask));
  return hn::Xor(w, hn::Xor(t, hn::ShiftLeft<kShift>(t)));
}

/// Adds the flags of one line of leaves: byte p of `flags` holds the eight rows of plane first_plane + p.
HWY_INLINE void add_rows(uint64_t* rows, int first_plane, int first_row, uint64_t flags) {
  for (int p = 0; p < 8; ++p) rows[first_plane + p] |= (flags >> (8 * p) & 255) << first_row;
}

/// Swaps y and z: bit y*8 + z becomes bit z*8 + y.
HWY_INLINE void swap_yz(const LeafMask& in, LeafMask& out) {
  const Words d;
  for (size_t w = 0; w < 8; w += hn::Lanes(d)) {
    auto v = hn::Load(d, in.word + w);
    v = swap_bits<7>(d, v, 0x00aa00aa00aa00aaull);
    v = swap_bits<14>(d, v, 0x0000cccc0000ccccull);
    v = swap_bits<28>(d, v, 0x00000000f0f0f0f0ull);
    hn::Store(v, d, out.word + w);
  }
}

/// Up to eight leaves in a line, those that are there.
struct Line {
  alignas(64) static constexpr uint8_t kNothing[64] = {};
  int count = 0, places[8];
  const LeafMask* masks[8];  // the first of several that follow each other

  /// rows[x*kRowPitch + y] gets the bits z of all leaves (with y and z swapped: rows of bits y).
  void lay(int mask, uint64_t* rows) const {
    const uint8_t* bytes[8];
    if (count <= 3) {
      for (int k = 0; k < count; ++k) bytes[k] = reinterpret_cast<const uint8_t*>(masks[k] + mask);
      return lay_few(bytes, places, count, rows);
    }
    for (const uint8_t*& b : bytes) b = kNothing;
    for (int k = 0; k < count; ++k) bytes[places[k]] = reinterpret_cast<const uint8_t*>(masks[k] + mask);
    lay_full(bytes, rows);
  }
  /// Does so only where any bit is set. Returns bit x*8 + y where that row is not zero.
  uint64_t lay_faces(int mask, uint64_t* rows) const {
    const uint8_t* bytes[8];
    for (int k = 0; k < count; ++k) bytes[k] = reinterpret_cast<const uint8_t*>(masks[k] + mask);
    const uint64_t any = rows_not_zero(bytes, count);
    if (any) lay(mask, rows);
    return any;
  }
};

void GatherPlanes(const ChunkFaces& chunk, const LeafMask (*equal)[3], ChunkPlanes& planes) {
  for (int a = 0; a < 8; ++a) {
    for (int b = 0; b < 8; ++b) {
      const size_t corner = static_cast<size_t>(a) * 8 * kRowPitch + static_cast<size_t>(b) * 8;
      Line faces, equals;
      // Leaves (a, b, *): faces of x and y.
      for (int k = 0; k < 8; ++k) {
        const uint16_t slot = chunk.slot[static_cast<size_t>(a * 64 + b * 8 + k)];
        if (slot == ChunkFaces::kNone) continue;
        faces.places[faces.count] = equals.places[faces.count] = k;
        faces.masks[faces.count] = chunk.faces[slot].face;
        equals.masks[faces.count] = equal[slot];
        equals.count = ++faces.count;
      }
      if (faces.count > 0) {
        uint64_t any[4];
        for (int f = 0; f < 4; ++f) any[f] = faces.lay_faces(f, planes.faces[f] + corner);
        for (int f = 0; f < 2; ++f)
          if (any[f]) add_rows(planes.rows[f], a * 8, b * 8, any[f]);
        for (int f = 2; f < 4; ++f)
          if (any[f]) add_rows(planes.rows[f], b * 8, a * 8, transpose_8x8(any[f]));
        if (any[0] | any[1] | any[2] | any[3]) equals.lay(2, planes.along_bit[0] + corner);
        if (any[0] | any[1]) equals.lay(1, planes.along_row[0] + corner);
        if (any[2] | any[3]) equals.lay(0, planes.along_row[1] + corner);
      }
      // Leaves (a, *, b): faces of z, with y and z swapped. Masks: face -z, face +z, equal along y, along x.
      LeafMask swapped[8][4];
      Line line;
      for (int k = 0; k < 8; ++k) {
        const uint16_t slot = chunk.slot[static_cast<size_t>(a * 64 + k * 8 + b)];
        if (slot == ChunkFaces::kNone) continue;
        line.places[line.count] = k;
        LeafMask* to = swapped[line.count];
        line.masks[line.count++] = to;
        swap_yz(chunk.faces[slot].face[4], to[0]);
        swap_yz(chunk.faces[slot].face[5], to[1]);
        swap_yz(equal[slot][1], to[2]);
        swap_yz(equal[slot][0], to[3]);
      }
      if (line.count == 0) continue;
      uint64_t any[2];
      for (int f = 0; f < 2; ++f) {
        any[f] = line.lay_faces(f, planes.faces[f + 4] + corner);
        if (any[f]) add_rows(planes.rows[f + 4], b * 8, a * 8, transpose_8x8(any[f]));
      }
      if (any[0] | any[1]) {
        line.lay(2, planes.along_bit[2] + corner);
        line.lay(3, planes.along_row[2] + corner);
      }
    }
  }
}

/// starts[i] = row for each set bit i.
HWY_INLINE void set_starts(uint8_t* starts, uint64_t bits, int row) {
#if HWY_TARGET == HWY_SCALAR
  for (; bits != 0; bits &= bits - 1) starts[__builtin_ctzll(bits)] = static_cast<uint8_t>(row);
#else
  const hn::CappedTag<uint8_t, 64> d;
  uint8_t mask_bits[8];
  __builtin_memcpy(mask_bits, &bits, 8);
  const auto value = hn::Set(d, static_cast<uint8_t>(row));
  for (size_t i = 0; i < 64; i += hn::Lanes(d))
    hn::Store(hn::IfThenElse(hn::LoadMaskBits(d, mask_bits + i / 8), value, hn::Load(d, starts + i)), d, starts + i);
#endif
}

/// Of intervals with the given first and last bits: the first bits of those whose last bit is in `some_lasts`.
HWY_INLINE uint64_t firsts_of(uint64_t some_lasts, uint64_t lasts, uint64_t firsts) {
#if HWY_TARGET <= HWY_AVX2
  return _pdep_u64(_pext_u64(some_lasts, lasts), firsts);
#else
  (void)lasts;
  uint64_t found = 0;
  for (; some_lasts != 0; some_lasts &= some_lasts - 1)
    found |= 1ull << (63 - __builtin_clzll(firsts & (some_lasts ^ (some_lasts - 1))));
  return found;
#endif
}

// The rectangles that are open at a row are disjoint intervals of bits, kept as their first and last bits. All of them
// are followed to the next row at once: adding the first bits to "goes on" carries through an interval without gaps up
// to its last bit, and stops before it else.
template <int kAxis>
HWY_INLINE FaceRecord* merge_axis(ChunkPlanes& all, int face, FaceRecord* out, DirectionExtent& total) {
  constexpr PlaneAxes kAxes = kPlaneAxes[kAxis];
  constexpr int kShift[3] = {12, 6, 0};  // of x, y, z in word 0
  uint64_t* const faces = all.faces[face];
  const uint64_t* const along_bit = all.along_bit[kAxis == 2 ? 2 : 0];
  const uint64_t* const along_row = all.along_row[kAxis];
  // word 0 = plane + start*start_factor + low*low_factor + high<<18 + row<<24
  constexpr uint32_t kStartFactor = (1u << kShift[kAxes.row]) - (1u << 24);
  constexpr uint32_t kLowFactor = (1u << kShift[kAxes.bit]) - (1u << 18);
  const uint64_t word1 = static_cast<uint64_t>(face) << 48;
  alignas(64) uint8_t starts[128] = {};  // by first bit of a rectangle: its first row; 64 belongs to no bit
  DirectionExtent extent;
  for (size_t plane = 0; plane < kChunkSize; ++plane) {
    uint64_t rows = all.rows[face][plane];
    if (rows == 0) continue;
    all.rows[face][plane] = 0;
    extent.planes |= 1ull << plane;
    extent.rows |= rows;
    const size_t begin = plane * kAxes.plane_step;
    const uint32_t plane_word = static_cast<uint32_t>(plane) << kShift[kAxes.plane];
    uint64_t open_firsts = 0, open_lasts = 0;  // of the rectangles that go on from the row before
    for (; rows != 0; rows &= rows - 1) {
      const size_t row = static_cast<size_t>(std::countr_zero(rows)), at = begin + row * kAxes.row_step;
      const uint64_t here = faces[at];
      faces[at] = 0;
      extent.bits |= here;
      // What no open rectangle covers starts new ones: runs of equal ids.
      const uint64_t fresh = here & ~((open_lasts << 1) - open_firsts);
      const uint64_t joined = along_bit[at] & fresh & (fresh >> 1);
      const uint64_t new_firsts = fresh & ~(joined << 1);
      set_starts(starts, new_firsts, static_cast<int>(row));
      const uint64_t firsts = open_firsts | new_firsts, lasts = open_lasts | (fresh & ~joined);
      // Follow all to the next row.
      const uint64_t goes_on = along_row[at] & faces[at + kAxes.row_step];
      open_lasts = ((goes_on & ~lasts) + firsts) & lasts & goes_on;
      open_firsts = firsts_of(open_lasts, lasts, firsts);
      // Write those that end here; two at once, as a guess at how many costs less than a branch for each.
      uint64_t end_firsts = firsts & ~open_firsts, end_lasts = lasts & ~open_lasts;
      const uint32_t row_word = plane_word + (static_cast<uint32_t>(row) << 24);
      const auto write = [&](FaceRecord* to) HWY_ATTR {
        const uint64_t low = static_cast<uint64_t>(std::countr_zero(end_firsts));
        const uint32_t high = static_cast<uint32_t>(std::countr_zero(end_lasts));
        const uint32_t word0 =
            row_word + starts[low] * kStartFactor + static_cast<uint32_t>(low) * kLowFactor + (high << 18);
        const uint64_t words = word1 | word0;
        __builtin_memcpy(static_cast<void*>(to), &words, 8);
        end_firsts &= end_firsts - 1, end_lasts &= end_lasts - 1;
      };
      FaceRecord* const end = out + std::popcount(end_lasts);
      write(out), write(out + 1);
      for (out += 2; out < end; ++out) write(out);
      out = end;
    }
  }
  total = extent;
  return out;
}

FaceRecord* MergeDirection(ChunkPlanes& planes, int face, FaceRecord* out, DirectionExtent& extent) {
  switch (face_axis(face)) {
    case 0:
      return merge_axis<0>(planes, face, out, extent);
    case 1:
      return merge_axis<1>(planes, face, out, extent);
    default:
      return merge_axis<2>(planes, face, out, extent);
  }
}

void AddBlocks(FaceRecord* begin, FaceRecord* end, const BlockId* const ids[kLeavesPerChunk]) {
  for (FaceRecord* r = begin; r != end; ++r) {
    const uint32_t p = r->word0;  // x, y, z from the highest bit to the lowest, as in both indices
#if HWY_TARGET <= HWY_AVX2
    const uint32_t leaf = _pext_u32(p, 0070707 << 3), voxel = _pext_u32(p, 0070707);
#else
    const uint32_t leaf = (p >> 9 & 0700) | (p >> 6 & 070) | (p >> 3 & 7);
    const uint32_t voxel = (p >> 6 & 0700) | (p >> 3 & 070) | (p & 7);
#endif
    r->word1 |= ids[leaf][voxel];
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
HWY_EXPORT(TransparentFaces);
HWY_EXPORT(RemoveFacesTowards);
HWY_EXPORT(CountFaces);
HWY_EXPORT(EqualNeighbours);
HWY_EXPORT(GatherPlanes);
HWY_EXPORT(MergeDirection);
HWY_EXPORT(AddBlocks);
HWY_EXPORT(FloodLeaf);

uint64_t opaque_faces(const LeafNeighbourhood* leaves, size_t count, LeafFaces* faces) {
  return HWY_DYNAMIC_DISPATCH(OpaqueFaces)(leaves, count, faces);
}
bool transparent_faces(const LeafNeighbourhood& occupied, const LeafNeighbourhood& opaque, LeafFaces& faces,
                       LeafFaces& touching) {
  return HWY_DYNAMIC_DISPATCH(TransparentFaces)(occupied, opaque, faces, touching);
}
void remove_faces_towards(const LeafNeighbourhood& around, LeafFaces& faces) {
  HWY_DYNAMIC_DISPATCH(RemoveFacesTowards)(around, faces);
}
uint64_t count_faces(const LeafFaces* faces, size_t count) { return HWY_DYNAMIC_DISPATCH(CountFaces)(faces, count); }
void equal_neighbours(const world::BlockId* ids, const world::BlockId* const next[3], world::LeafMask out[3]) {
  HWY_DYNAMIC_DISPATCH(EqualNeighbours)(ids, next, out);
}
void gather_planes(const ChunkFaces& faces, const world::LeafMask (*equal)[3], ChunkPlanes& planes) {
  HWY_DYNAMIC_DISPATCH(GatherPlanes)(faces, equal, planes);
}
FaceRecord* merge_direction(ChunkPlanes& planes, int face, FaceRecord* out, DirectionExtent& extent) {
  return HWY_DYNAMIC_DISPATCH(MergeDirection)(planes, face, out, extent);
}
void add_blocks(FaceRecord* begin, FaceRecord* end, const world::BlockId* const ids[kLeavesPerChunk]) {
  HWY_DYNAMIC_DISPATCH(AddBlocks)(begin, end, ids);
}
bool flood_leaf(const world::LeafMask& open, const world::LeafMask& entry, world::LeafMask& reached) {
  return HWY_DYNAMIC_DISPATCH(FloodLeaf)(open, entry, reached);
}

}  // namespace render
#endif
