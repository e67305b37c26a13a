#include "world/store/parallel_rays.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "world/store/leaf_slices.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "world/store/parallel_rays.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "world/base/wide_vectors-inl.h"
#include "world/store/ray_lanes-inl.h"

#ifndef LOAM_PARALLEL_RAYS_ONCE
#define LOAM_PARALLEL_RAYS_ONCE

namespace world {

constexpr size_t kPiece = 512;  // rays looked up before any slab is tested
constexpr size_t kAhead = 64;   // rays are asked for so many before they are looked at
/// Slabs tested back from the last before a ray is given to the stream.
constexpr int kMostTests = 24;
/// The map holds for rays this far off; floats of a piece's rays, relative to its first, err by less.
constexpr double kMargin = 1.0 / 64;
constexpr int32_t kMostOffset = 8192;   // from the first ray of a piece, in voxels, on each axis
constexpr int64_t kFarthest = 1 << 24;  // of that one from the corner of the bounds

/// What the kernel reads of a BrickVolume.
struct ParallelBricks {
  const int32_t *codes, *words;
  int32_t leaves_y, leaves_z;
};

/// Rays whose slabs are in question: where they start (k, u, v within the bounds, and the fractions, all in the
/// direction of the rays), the last slab to test from it, and the index, all in arrays of lanes.
struct alignas(64) OpenRays {
  int32_t slab[kPiece + 16], cell[3][kPiece + 16], index[kPiece + 16];  // index: top bit where a slab was unsure
  float fraction[3][kPiece + 16];
};

/// Indices of rays; the top bit of some is set.
struct ParallelAnswers {
  int32_t blocked[kPiece + 16];                     // what is blocked
  int32_t exact[kPiece + 16], stream[kPiece + 16];  // what must be cast otherwise
  size_t blocked_count = 0, exact_count = 0, stream_count = 0;
};
constexpr int32_t kIndexBits = INT32_MAX;

constexpr int kBlockBits = 6;

/// Leaves that a block, with the slopes over a layer of leaves, touches along u or v.
constexpr int kMostLeaves = 11;

/// Cells of a block, both ends included; none where last < first.
struct CellRange {
  int32_t first, last;
  uint64_t bits() const { return last < first ? 0 : ~uint64_t{0} >> (63 - last) & ~uint64_t{0} << first; }
};

inline int32_t floor_to_int(double x) { return static_cast<int32_t>(std::floor(x)); }

/// What a block is made from.
struct ParallelSource {
  const ParallelRays::Frame& frame;
  const BrickVolume& bricks;
};

/// Gives the kernel the blocks of the map.
struct ParallelRaysKernel {
  const ParallelRays& rays;
  const ParallelRays::Frame& frame() const { return rays.frame_; }
  const ParallelRays::Block& block(int32_t u, int32_t v) const { return rays.block(u, v); }
};

}  // namespace world
#endif

HWY_BEFORE_NAMESPACE();
namespace world {
namespace HWY_NAMESPACE {

using Words = hn::CappedTag<uint64_t, 8>;

/// Rows of 64 cells, two a vector where there are vectors.
using Pairs = hn::CappedTag<uint64_t, 2>;
#if HWY_TARGET == HWY_SCALAR
constexpr int kPairs = 8;
#else
constexpr int kPairs = 4;
#endif

/// Of eight rows: byte r of each of eight words, the first one's lowest.
HWY_INLINE void transpose_to(const uint64_t words[8], hn::Vec<Pairs> rows[kPairs]) {
#if HWY_TARGET == HWY_SCALAR
  uint64_t turned[8];
  std::copy_n(words, 8, turned);
  transpose_bytes(turned);
  for (int r = 0; r < 8; ++r) rows[r] = hn::Set(Pairs(), turned[r]);
#else
  const hn::FixedTag<uint8_t, 16> d8;
  const hn::FixedTag<uint16_t, 8> d16;
  const hn::FixedTag<uint32_t, 4> d32;
  const Pairs d64;
  const auto two = [&](int i) HWY_ATTR {
    const auto pair = hn::LoadU(d64, words + i);
    const auto bytes = hn::BitCast(d8, pair);
    return hn::BitCast(d16, hn::InterleaveLower(d8, bytes, hn::BitCast(d8, hn::InterleaveUpper(d64, pair, pair))));
  };
  const auto w01 = two(0), w23 = two(2), w45 = two(4), w67 = two(6);
  const auto low = hn::BitCast(d32, hn::InterleaveLower(d16, w01, w23)),
             low_high = hn::BitCast(d32, hn::InterleaveLower(d16, w45, w67)),
             high = hn::BitCast(d32, hn::InterleaveUpper(d16, w01, w23)),
             high_high = hn::BitCast(d32, hn::InterleaveUpper(d16, w45, w67));
  rows[0] = hn::BitCast(d64, hn::InterleaveLower(d32, low, low_high));
  rows[1] = hn::BitCast(d64, hn::InterleaveUpper(d32, low, low_high));
  rows[2] = hn::BitCast(d64, hn::InterleaveLower(d32, high, high_high));
  rows[3] = hn::BitCast(d64, hn::InterleaveUpper(d32, high, high_high));
#endif
}

/// Of eight rows: byte r of each of two words, the first one's lowest.
HWY_INLINE void transpose_two_to(const uint64_t words[2], hn::Vec<Pairs> rows[kPairs]) {
  const Pairs d64;
#if HWY_TARGET == HWY_SCALAR
  for (int r = 0; r < 8; ++r) rows[r] = hn::Set(d64, (words[0] >> (8 * r) & 0xff) | (words[1] >> (8 * r) & 0xff) << 8);
#else
  const hn::FixedTag<uint8_t, 16> d8;
  const hn::FixedTag<uint16_t, 8> d16;
  const hn::FixedTag<uint32_t, 4> d32;
  const auto pair = hn::LoadU(d64, words);
  const auto bytes =
      hn::InterleaveLower(d8, hn::BitCast(d8, pair), hn::BitCast(d8, hn::InterleaveUpper(d64, pair, pair)));
  const auto twos = hn::BitCast(d16, bytes);
  const auto low = hn::BitCast(d32, hn::InterleaveLower(d16, twos, hn::Zero(d16))),
             high = hn::BitCast(d32, hn::InterleaveUpper(d16, twos, hn::Zero(d16)));
  rows[0] = hn::BitCast(d64, hn::InterleaveLower(d32, low, hn::Zero(d32)));
  rows[1] = hn::BitCast(d64, hn::InterleaveUpper(d32, low, hn::Zero(d32)));
  rows[2] = hn::BitCast(d64, hn::InterleaveLower(d32, high, hn::Zero(d32)));
  rows[3] = hn::BitCast(d64, hn::InterleaveUpper(d32, high, hn::Zero(d32)));
#endif
}

/// Of two rows of eight planes, 64 bits a row: byte `bit` of word `group` becomes the bits that cell 8 group + bit has
/// in them, the first plane's lowest.
HWY_INLINE void transpose_planes(const uint64_t (*planes)[ParallelRays::kBlockCells], int row, uint64_t words[2][8]) {
#if HWY_TARGET == HWY_SCALAR
  for (int i = 0; i < 2; ++i) {
    for (int plane = 0; plane < 8; ++plane) words[i][plane] = planes[plane][row + i];
    transpose_bytes(words[i]);
    for (int group = 0; group < 8; ++group) words[i][group] = transpose_bits(words[i][group]);
  }
#else
  const hn::FixedTag<uint8_t, 16> d8;
  const hn::FixedTag<uint16_t, 8> d16;
  const hn::FixedTag<uint32_t, 4> d32;
  const hn::FixedTag<uint64_t, 2> d64;
  const auto plane = [&](int i) HWY_ATTR { return hn::BitCast(d8, hn::Load(d64, planes[i] + row)); };
  // Bits of 8 x 8 cells, as transpose_bits().
  const auto swap = [&](auto word, auto shifted, uint64_t mask)
                        HWY_ATTR { return hn::And(hn::Xor(word, shifted), hn::Set(d64, mask)); };
  const auto store = [&](auto pair, uint64_t* to) HWY_ATTR {
    auto word = hn::BitCast(d64, pair);
    auto t = swap(word, hn::ShiftRight<7>(word), 0x00aa00aa00aa00aaull);
    word = hn::Xor(word, hn::Xor(t, hn::ShiftLeft<7>(t)));
    t = swap(word, hn::ShiftRight<14>(word), 0x0000cccc0000ccccull);
    word = hn::Xor(word, hn::Xor(t, hn::ShiftLeft<14>(t)));
    t = swap(word, hn::ShiftRight<28>(word), 0x00000000f0f0f0f0ull);
    hn::StoreU(hn::Xor(word, hn::Xor(t, hn::ShiftLeft<28>(t))), d64, to);
  };
  const auto merge = [&](auto w01, auto w23, auto w45, auto w67, uint64_t* to) HWY_ATTR {
    const auto a = hn::BitCast(d16, w01), b = hn::BitCast(d16, w23), c = hn::BitCast(d16, w45),
               d = hn::BitCast(d16, w67);
    const auto low = hn::BitCast(d32, hn::InterleaveLower(d16, a, b)),
               low_high = hn::BitCast(d32, hn::InterleaveLower(d16, c, d)),
               high = hn::BitCast(d32, hn::InterleaveUpper(d16, a, b)),
               high_high = hn::BitCast(d32, hn::InterleaveUpper(d16, c, d));
    store(hn::InterleaveLower(d32, low, low_high), to), store(hn::InterleaveUpper(d32, low, low_high), to + 2);
    store(hn::InterleaveLower(d32, high, high_high), to + 4), store(hn::InterleaveUpper(d32, high, high_high), to + 6);
  };
  const auto p0 = plane(0), p1 = plane(1), p2 = plane(2), p3 = plane(3), p4 = plane(4), p5 = plane(5), p6 = plane(6),
             p7 = plane(7);
  merge(hn::InterleaveLower(d8, p0, p1), hn::InterleaveLower(d8, p2, p3), hn::InterleaveLower(d8, p4, p5),
        hn::InterleaveLower(d8, p6, p7), words[0]);
  merge(hn::InterleaveUpper(d8, p0, p1), hn::InterleaveUpper(d8, p2, p3), hn::InterleaveUpper(d8, p4, p5),
        hn::InterleaveUpper(d8, p6, p7), words[1]);
#endif
}

/// The map over one block, from the last layer of leaves back until every cell is decided.
void fill_block(const ParallelSource& source, ParallelRays::Block& block, int32_t block_u, int32_t block_v) {
  constexpr int kCells = ParallelRays::kBlockCells;
  const Words dw;
  const Pairs dp;
  const ParallelRays::Frame& frame = source.frame;
  const BrickVolume& bricks = source.bricks;
  const int m = frame.axis[0];
  const LeafPos low_leaf = leaf_from_voxel(frame.low);
  // Cells of u or v that rays of the block's first cell may touch in slab k: from `first` on, `width` of them.
  struct Reach {
    int32_t first, width;
  };
  const int32_t corner[2] = {block_u * kCells - frame.shift[0], block_v * kCells - frame.shift[1]};
  const auto reach = [&](int i, int32_t k) {
    const double slope = frame.slope[i], at = slope * k;
    const int32_t first = floor_to_int(at + std::min(0.0, slope) - kMargin);
    return Reach{corner[i] + first, floor_to_int(at + 1 + std::max(0.0, slope) + kMargin) - first + 1};
  };
  const VoxelPos first_set = bricks.content().min - frame.low, last_set = bricks.content().max - frame.low;
  const int32_t first_layer = (frame.down ? frame.size[0] - 1 - last_set[m] : first_set[m]) >> 3;
  const int32_t last_layer = (frame.down ? frame.size[0] - 1 - first_set[m] : last_set[m]) >> 3;
  alignas(64) uint64_t met[kCells] = {},
                       shut[kCells] = {};  // cells whose `end`, whose `shut` is known: bit v of word u
  alignas(64) uint64_t some[kMostLeaves * 8 + 8], every[kMostLeaves * 8 + 8];
  // Bit planes of what the cells will say, bit v of word u: most cells are decided by few slabs, in no order.
  alignas(64) uint64_t end_planes[16][kCells] = {}, shut_planes[16][kCells] = {};
  uint64_t slices[kMostLeaves][8][16];  // by leaf along u, slab, leaf along v: rows are u, columns v
  bool row_held[kMostLeaves];
  bool open = true;
  for (int32_t layer = last_layer; open && layer >= first_layer; --layer) {
    // Cells that lie outside the bounds from here back are known.
    uint64_t out[2];
    for (int i = 0; i < 2; ++i) {
      const Reach last = reach(i, layer * 8 + 7), first = reach(i, first_layer * 8);
      const int32_t low = std::min(last.first, first.first),
                    high = std::max(last.first + last.width, first.first + first.width);  // both of cell 0
      out[i] = ~CellRange{std::max(0, 1 - high), std::min(kCells, frame.size[1 + i] - low) - 1}.bits();
    }
    if (out[0] | out[1])
      for (int c = 0; c < kCells; ++c) {
        const uint64_t known = out[0] >> c & 1 ? ~uint64_t{0} : out[1];
        met[c] |= known, shut[c] |= known;
      }
    // Leaves under the block in this layer, and for each along u or v the cells whose rays may touch it.
    int32_t first_leaf[2], leaves[2];
    CellRange cells_of[2][kMostLeaves];
    for (int i = 0; i < 2; ++i) {
      const Reach a = reach(i, layer * 8), b = reach(i, layer * 8 + 7);
      const int32_t low = std::min(a.first, b.first), high = std::max(a.first + a.width, b.first + b.width) - 1;
      first_leaf[i] = low >> 3;
      leaves[i] = ((high + kCells - 1) >> 3) - first_leaf[i] + 1;
      for (int32_t leaf = 0; leaf < leaves[i]; ++leaf) {
        const int32_t voxel = (first_leaf[i] + leaf) * 8;
        cells_of[i][leaf] = {std::max(0, voxel - high), std::min(kCells - 1, voxel + 7 - low)};
      }
    }
    const int32_t main_leaf = frame.down ? (frame.size[0] >> 3) - 1 - layer : layer;
    struct Held {
      int32_t i, j;
      uint32_t code;
    } held[kMostLeaves * kMostLeaves];
    size_t held_count = 0;
    for (int32_t i = 0; i < leaves[0]; ++i) {
      row_held[i] = false;
      const int32_t u = first_leaf[0] + i;
      if (u < 0 || u * 8 >= frame.size[1]) continue;
      // What lies behind cells that are decided needn't be known: most of the ground.
      uint64_t undecided = 0;
      for (int32_t c = cells_of[0][i].first; c <= cells_of[0][i].last; ++c) undecided |= ~shut[c];
      if (!undecided) continue;
      LeafPos leaf;
      leaf[m] = main_leaf, leaf[frame.axis[1]] = u;
      for (int32_t j = 0; j < leaves[1];) {
        const int32_t v = first_leaf[1] + j;
        leaf[frame.axis[2]] = v;
        int32_t clear = 1;  // leaves from here on
        if (v >= 0 && v * 8 < frame.size[2] && undecided & cells_of[1][j].bits()) {
          const uint32_t code = bricks.code(leaf + low_leaf);
          if (code & BrickVolume::kMixed) {
            __builtin_prefetch(bricks.words() + (code & BrickVolume::kFirstWord));
            held[held_count++] = {i, j, code & BrickVolume::kFirstWord};
            row_held[i] = true;
          } else {
            const int32_t side = static_cast<int32_t>(((code & BrickVolume::kSide) + 1) >> 3);
            clear = side - (v & (side - 1));
          }
        }
        j += clear;
      }
      if (row_held[i]) std::memset(slices[i], 0, sizeof slices[i]);
    }
    for (size_t n = 0; n < held_count; ++n) {
      uint64_t across[8];
      slices_of_leaf(bricks.words() + held[n].code, m, across);
      for (int slab = 0; slab < 8; ++slab) slices[held[n].i][slab][held[n].j] = across[slab];
    }
    if (!held_count) continue;
    for (int32_t k = layer * 8 + 7; open && k >= layer * 8; --k) {
      const int slab = frame.down ? 7 - (k & 7) : k & 7;
      const Reach u = reach(0, k), v = reach(1, k);
      const int32_t first_row = u.first - first_leaf[0] * 8, first_column = v.first - first_leaf[1] * 8;
      // A row of u: 64 cells of v, each of which says whether any, whether all of its reach along v is set.
      for (int32_t i = 0; i < leaves[0]; ++i) {
        if (!row_held[i]) {
          std::fill_n(some + i * 8, 8, uint64_t{0}), std::fill_n(every + i * 8, 8, uint64_t{0});
          continue;
        }
        const uint64_t* words = slices[i][slab] + (first_column >> 3);
        hn::Vec<Pairs> near[kPairs], far[kPairs];
        transpose_to(words, near), transpose_two_to(words + 8, far);
        for (int r = 0; r < kPairs; ++r) {
          const auto low = near[r], high = hn::ShiftLeft<1>(far[r]);
          const auto shifted = [&](int by) HWY_ATTR {
            return hn::Or(hn::ShiftRightSame(low, by), hn::ShiftLeftSame(high, 63 - by));
          };
          auto any_of = shifted(first_column & 7), all_of = any_of;
          for (int32_t c = 1; c < v.width; ++c) {
            const auto next = shifted((first_column & 7) + c);
            any_of = hn::Or(any_of, next), all_of = hn::And(all_of, next);
          }
          const size_t row = static_cast<size_t>(i * 8 + r * (8 / kPairs));
          hn::Store(any_of, dp, some + row), hn::Store(all_of, dp, every + row);
        }
      }
      // The planes that say this slab's number.
      uint64_t *end_of[16], *shut_of[16];
      int end_count = 0, shut_count = 0;
      for (int bit = 0; bit < 16; ++bit) {
        end_of[end_count] = end_planes[bit], end_count += (k + 1) >> bit & 1;
        shut_of[shut_count] = shut_planes[bit], shut_count += k >> bit & 1;
      }
      auto known = hn::Set(dw, ~uint64_t{0});
      for (int c = 0; c < kCells; c += static_cast<int>(hn::Lanes(dw))) {
        const auto shut_now = hn::Load(dw, shut + c);
        if (hn::AllTrue(dw, hn::Eq(shut_now, hn::Set(dw, ~uint64_t{0})))) continue;
        auto any_of = hn::LoadU(dw, some + first_row + c), all_of = hn::LoadU(dw, every + first_row + c);
        for (int32_t r = 1; r < u.width; ++r) {
          any_of = hn::Or(any_of, hn::LoadU(dw, some + first_row + c + r));
          all_of = hn::And(all_of, hn::LoadU(dw, every + first_row + c + r));
        }
        const auto met_now = hn::Load(dw, met + c);
        const auto fresh = hn::AndNot(met_now, any_of), fresh_shut = hn::AndNot(shut_now, all_of);
        const auto shut_then = hn::Or(shut_now, all_of);
        known = hn::And(known, shut_then);
        if (hn::AllTrue(dw, hn::Eq(hn::Or(fresh, fresh_shut), hn::Zero(dw)))) continue;
        hn::Store(hn::Or(met_now, any_of), dw, met + c), hn::Store(shut_then, dw, shut + c);
        for (int n = 0; n < end_count; ++n) hn::Store(hn::Or(hn::Load(dw, end_of[n] + c), fresh), dw, end_of[n] + c);
        for (int n = 0; n < shut_count; ++n)
          hn::Store(hn::Or(hn::Load(dw, shut_of[n] + c), fresh_shut), dw, shut_of[n] + c);
      }
      open = !hn::AllTrue(dw, hn::Eq(known, hn::Set(dw, ~uint64_t{0})));
    }
  }
  // The planes of two rows become the cells of their tiles' rows, 8 cells and 8 bits at a time.
  const hn::CappedTag<int32_t, 8> d32;
  const hn::Rebind<uint8_t, decltype(d32)> d8;
  const bool wide = (last_layer + 1) * 8 > UINT8_MAX;
  for (int row = 0; row < kCells; row += 2) {
    alignas(64) uint64_t end_low[2][8], end_high[2][8] = {}, shut_low[2][8], shut_high[2][8] = {};
    transpose_planes(end_planes, row, end_low), transpose_planes(shut_planes, row, shut_low);
    if (wide) transpose_planes(end_planes + 8, row, end_high), transpose_planes(shut_planes + 8, row, shut_high);
    for (int i = 0; i < 2; ++i)
      for (int group = 0; group < 8; ++group)
        for (int column = 0; column < 8; column += static_cast<int>(hn::Lanes(d32))) {
          const auto bytes = [&](const uint64_t(&words)[2][8]) HWY_ATTR {
            return hn::PromoteTo(d32, hn::LoadU(d8, reinterpret_cast<const uint8_t*>(&words[i][group]) + column));
          };
          auto cells = hn::Or(bytes(end_low), hn::ShiftLeft<16>(bytes(shut_low)));
          if (wide)
            cells = hn::Or(cells, hn::Or(hn::ShiftLeft<8>(bytes(end_high)), hn::ShiftLeft<24>(bytes(shut_high))));
          hn::StoreU(cells, d32,
                     reinterpret_cast<int32_t*>(block.cell + ParallelRays::cell_in_block(row + i, group * 8 + column)));
        }
  }
}

HWY_INLINE size_t store_some(I values, hn::Mask<Ints> lanes, int32_t* to) {
  const Compressor some(lanes);
  some.store(values, to);
  return some.count();
}

/// Writes the lanes of the mask from `at` on; returns how many.
HWY_INLINE size_t put(OpenRays& open, size_t at, hn::Mask<Ints> lanes, I slab, I index, I k, I u, I v, F f_k, F f_u,
                      F f_v) {
  const Compressor some(lanes);
  some.store(slab, open.slab + at), some.store(index, open.index + at);
  some.store(k, open.cell[0] + at), some.store(u, open.cell[1] + at), some.store(v, open.cell[2] + at);
  some.store(f_k, open.fraction[0] + at), some.store(f_u, open.fraction[1] + at),
      some.store(f_v, open.fraction[2] + at);
  return some.count();
}

/// The voxels that some rays may meet in a slab: the one they enter it by, the one they leave it by, and one between.
struct alignas(64) SlabVoxels {
  static constexpr size_t kRays = 64;
  static constexpr int kEach = 3;
  int32_t leaf[kEach][kRays], inside[kEach][kRays];  // place of the leaf's code; 0, or -1 within the bounds
  int32_t word[kEach][kRays], bit[kEach][kRays];     // word in its leaf, then of all words; bit in it
  int32_t code[kEach][kRays];
  int32_t unsure[kRays];  // -1: which voxels these are is closer than floats can tell
};

/// The voxels of open rays [at, end) in the slab that each stands at.
template <int kMain>
void find_voxels(const ParallelRays::Frame& frame, const ParallelBricks& bricks, const OpenRays& open, size_t at,
                 size_t end, SlabVoxels& voxels) {
  constexpr int kU = kMain == 0 ? 1 : 0, kV = kMain == 2 ? 1 : 2;
  const Floats df;
  const Ints di;
  const hn::RebindToUnsigned<Ints> du;
  const size_t width = hn::Lanes(df);
  const F slope_u = hn::Set(df, static_cast<float>(frame.slope[0])),
          slope_v = hn::Set(df, static_cast<float>(frame.slope[1]));
  const F steep_u = hn::Abs(slope_u), steep_v = hn::Abs(slope_v);
  const F half = hn::Set(df, 0.5f), one_f = hn::Set(df, 1.0f);
  const I zero = hn::Zero(di), one = hn::Set(di, 1);
  const I flip = hn::Set(di, frame.down ? -1 : 0), flipped_from = hn::Set(di, frame.down ? frame.size[0] - 1 : 0);
  const I last_m = hn::Set(di, frame.size[0] - 1), last_u = hn::Set(di, frame.size[1] - 1),
          last_v = hn::Set(di, frame.size[2] - 1);
  // Between 0 and `last`.
  const auto within = [&](I cell, I last) HWY_ATTR {
    return hn::Eq(hn::BitCast(di, hn::Min(hn::BitCast(du, cell), hn::BitCast(du, last))), cell);
  };
  for (size_t to = 0; at < end; at += width, to += width) {
    const I slab = hn::Load(di, open.slab + at), k = hn::Load(di, open.cell[0] + at);
    const I u = hn::Load(di, open.cell[1] + at), v = hn::Load(di, open.cell[2] + at);
    const F f_k = hn::Load(df, open.fraction[0] + at), f_u = hn::Load(df, open.fraction[1] + at),
            f_v = hn::Load(df, open.fraction[2] + at);
    const auto starting = hn::Eq(slab, zero);
    const F slab_f = hn::ConvertTo(df, slab);
    const F k_in = hn::Sub(slab_f, f_k), k_out = hn::Add(k_in, one_f);
    const F y_u = hn::Sub(f_u, half), y_v = hn::Sub(f_v, half);
    const F u_in = hn::MulAdd(k_in, slope_u, y_u), u_out = hn::MulAdd(k_out, slope_u, y_u);
    const F v_in = hn::MulAdd(k_in, slope_v, y_v), v_out = hn::MulAdd(k_out, slope_v, y_v);
    I iu = nearest_within(u_in), iv = nearest_within(v_in);
    const I ju = nearest_within(u_out), jv = nearest_within(v_out);
    // A ray in the slab it starts in is in its own voxel, not where its line enters the slab.
    const auto starting_f = hn::RebindMask(df, starting);
    F off = hn::IfThenZeroElse(starting_f, hn::Max(hn::Abs(hn::Sub(u_in, hn::ConvertTo(df, iu))),
                                                   hn::Abs(hn::Sub(v_in, hn::ConvertTo(df, iv)))));
    off = hn::Max(
        off, hn::Max(hn::Abs(hn::Sub(u_out, hn::ConvertTo(df, ju))), hn::Abs(hn::Sub(v_out, hn::ConvertTo(df, jv)))));
    iu = hn::IfThenZeroElse(starting, iu), iv = hn::IfThenZeroElse(starting, iv);
    const F error = hn::MulAdd(slab_f, hn::Set(df, 0x1p-21f), hn::Set(df, 0x1p-20f));
    const auto same_u = hn::Eq(iu, ju), same_v = hn::Eq(iv, jv);
    // Which of two crossings comes first, as in walk_slice() of packets.
    const F plane_u = hn::Sub(hn::ConvertTo(df, hn::Max(iu, ju)), half);
    const F plane_v = hn::Sub(hn::ConvertTo(df, hn::Max(iv, jv)), half);
    const F to_u = hn::Mul(hn::Abs(hn::Sub(plane_u, u_in)), steep_v);
    const F to_v = hn::Mul(hn::Abs(hn::Sub(plane_v, v_in)), steep_u);
    const auto both = hn::Not(hn::Or(same_u, same_v));
    const auto u_sooner = hn::RebindMask(di, hn::Lt(to_u, to_v));
    const auto close =
        hn::And(both, hn::RebindMask(di, hn::Not(hn::Gt(hn::Abs(hn::Sub(to_u, to_v)), hn::Add(error, error)))));
    const auto u_first = hn::AndNot(same_u, hn::Or(same_v, u_sooner));
    const I bu = hn::IfThenElse(u_first, ju, iu), bv = hn::IfThenElse(u_first, iv, jv);
    const auto unsure = hn::Or(close, hn::RebindMask(di, hn::Not(hn::Lt(off, hn::Sub(half, error)))));
    hn::Store(hn::VecFromMask(di, unsure), di, voxels.unsure + to);

    const I mirrored = hn::Add(k, slab);
    const I gm = hn::Add(hn::Xor(mirrored, flip), hn::Add(flipped_from, hn::And(flip, one)));
    const auto in_main = within(gm, last_m);
    const auto add = [&](int each, I cell_u, I cell_v) HWY_ATTR __attribute__((always_inline)) {
      I g[3];
      g[kMain] = gm, g[kU] = hn::Add(u, cell_u), g[kV] = hn::Add(v, cell_v);
      const auto in = hn::And(in_main, hn::And(within(g[kU], last_u), within(g[kV], last_v)));
      const I column = hn::Add(hn::Mul(hn::ShiftRight<3>(g[0]), hn::Set(di, bricks.leaves_z)), hn::ShiftRight<3>(g[2]));
      const I leaf = hn::Add(hn::Mul(column, hn::Set(di, bricks.leaves_y)), hn::ShiftRight<3>(g[1]));
      hn::Store(hn::IfThenElseZero(in, leaf), di, voxels.leaf[each] + to);
      hn::Store(hn::VecFromMask(di, in), di, voxels.inside[each] + to);
      const I word_in_leaf =
          hn::Or(hn::ShiftLeft<1>(hn::And(g[0], hn::Set(di, 4))),
                 hn::Or(hn::And(g[1], hn::Set(di, 6)), hn::ShiftRight<2>(hn::And(g[2], hn::Set(di, 4)))));
      hn::Store(word_in_leaf, di, voxels.word[each] + to);
      const I three = hn::Set(di, 3);
      const I bit = hn::Or(hn::ShiftLeft<3>(hn::And(g[0], three)),
                           hn::Or(hn::ShiftLeft<2>(hn::And(g[1], one)), hn::And(g[2], three)));
      hn::Store(bit, di, voxels.bit[each] + to);
    };
    add(0, iu, iv), add(1, bu, bv), add(2, ju, jv);
  }
}

/// Tests the slab each open ray stands at. Appends to `answers` what is blocked and what ended unsure; those that go on
/// move to the front. Returns how many. In three loops, so that the loads of many rays are under way at once.
template <int kMain>
size_t test_slabs(const ParallelRays::Frame& frame, const ParallelBricks& bricks, OpenRays& open, size_t count,
                  ParallelAnswers& answers) {
  const Ints di;
  const hn::RebindToUnsigned<Ints> du;
  const Floats df;
  const size_t width = hn::Lanes(di);
  SlabVoxels voxels;
  size_t kept = 0;
  for (size_t begin = 0; begin < count; begin += SlabVoxels::kRays) {
    const size_t end = std::min(begin + SlabVoxels::kRays, count);
    find_voxels<kMain>(frame, bricks, open, begin, end, voxels);
    for (size_t to = 0; begin + to < end; to += width)
      for (int each = 0; each < SlabVoxels::kEach; ++each) {
        const I code = hn::And(gather(bricks.codes, voxels.leaf[each] + to), hn::Load(di, voxels.inside[each] + to));
        hn::Store(code, di, voxels.code[each] + to);
        hn::Store(word_index(code, hn::Load(di, voxels.word[each] + to)), di, voxels.word[each] + to);
      }
    for (size_t to = 0, at = begin; at < end; at += width, to += width) {
      // A word's bit, at the top, where the leaf holds anything.
      I met = hn::Zero(di);
      for (int each = 0; each < SlabVoxels::kEach; ++each) {
        const I word = gather(bricks.words, voxels.word[each] + to), bit = hn::Load(di, voxels.bit[each] + to);
        const I shifted = hn::BitCast(di, hn::Shr(hn::BitCast(du, word), hn::BitCast(du, bit)));
        met = hn::Or(met, hn::And(hn::ShiftLeft<31>(shifted), hn::Load(di, voxels.code[each] + to)));
      }
      const auto hit = hn::Lt(met, hn::Zero(di));

      // What is unsure may not have met what it seems to meet.
      const I slab = hn::Load(di, open.slab + at), unsure = hn::Load(di, voxels.unsure + to);
      const auto starting = hn::Eq(slab, hn::Zero(di));
      const auto blocked_now = hn::AndNot(hn::MaskFromVec(unsure), hit);
      I index = hn::Load(di, open.index + at);
      index = hn::Or(index, hn::And(unsure, hn::Set(di, INT32_MIN)));
      const auto given = hn::FirstN(di, count - at);
      answers.blocked_count += store_some(index, hn::And(given, blocked_now), answers.blocked + answers.blocked_count);
      const auto doubtful = hn::And(hn::And(given, hn::Lt(index, hn::Zero(di))), hn::AndNot(blocked_now, starting));
      if (!hn::AllFalse(di, doubtful))
        answers.exact_count += store_some(index, doubtful, answers.exact + answers.exact_count);
      const auto on = hn::AndNot(hn::Or(blocked_now, starting), given);
      kept += put(open, kept, on, hn::Sub(slab, hn::Set(di, 1)), index, hn::Load(di, open.cell[0] + at),
                  hn::Load(di, open.cell[1] + at), hn::Load(di, open.cell[2] + at), hn::Load(df, open.fraction[0] + at),
                  hn::Load(df, open.fraction[1] + at), hn::Load(df, open.fraction[2] + at));
    }
  }
  return kept;
}

/// A vector of rays: voxel x, y, z, the bits of fraction x, y, z; and which of them run in the direction of the map to
/// infinity.
struct Starts {
  I word[8];
  hn::Mask<Ints> alike;
};

/// Of `some` rays; lanes beyond hold anything.
template <class Ray>
HWY_INLINE void load_starts(const Ray* rays, size_t some, const ParallelRays::Frame& frame, Starts& starts) {
  const Floats df;
  const Ints di;
  const size_t width = hn::Lanes(df);
  const float to_infinity = std::numeric_limits<float>::infinity();
#if HWY_TARGET == HWY_AVX2
  if constexpr (std::is_same_v<Ray, StreamRay>) {
    if (some == width) {
      load_transposed(rays, 0, starts.word);
      const __m256 wanted = _mm256_setr_ps(frame.direction[0], frame.direction[1], frame.direction[2], to_infinity,
                                           frame.direction[0], frame.direction[1], frame.direction[2], to_infinity);
      uint32_t alike = 0;
      for (int i = 0; i < 4; ++i) {
        const __m256 two = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(&rays[2 * i].direction.x)),
                                                _mm_loadu_ps(&rays[2 * i + 1].direction.x), 1);
        const uint32_t equal = static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(two, wanted, _CMP_EQ_OQ)));
        alike |= (uint32_t{(equal & 15) == 15} | uint32_t{equal >= 0xf0} << 1) << (2 * i);
      }
      starts.alike = hn::TestBit(hn::Set(di, static_cast<int32_t>(alike)), hn::Load(di, kLaneBits));
      return;
    }
  }
#endif
  alignas(64) int32_t voxel[3][kMostLanes];
  alignas(64) float fraction[3][kMostLanes], direction[3][kMostLanes], t_max[kMostLanes];
  for (size_t lane = 0; lane < width; ++lane) {
    const Ray& ray = rays[std::min(lane, some - 1)];
    for (int i = 0; i < 3; ++i) {
      voxel[i][lane] = (&ray.voxel.x)[i];
      fraction[i][lane] = static_cast<float>((&ray.fraction.x)[i]);
      direction[i][lane] = static_cast<float>((&ray.direction.x)[i]);
    }
    t_max[lane] = static_cast<float>(ray.t_max);
  }
  auto alike = hn::Eq(hn::Load(df, t_max), hn::Set(df, to_infinity));
  for (int i = 0; i < 3; ++i) {
    alike = hn::And(alike, hn::Eq(hn::Load(df, direction[i]), hn::Set(df, frame.direction[i])));
    starts.word[i] = hn::Load(di, voxel[i]);
    starts.word[3 + i] = hn::BitCast(di, hn::Load(df, fraction[i]));
  }
  starts.alike = hn::RebindMask(di, alike);
}

/// Of [0, count) rays, at most kPiece.
template <class Ray>
void cast_piece(const ParallelRaysKernel& map, const ParallelBricks& bricks, const Ray* rays, size_t count,
                ParallelAnswers& answers) {
  const Floats df;
  const Ints di;
  const hn::RebindToUnsigned<Ints> du;
  const size_t width = hn::Lanes(df);
  const ParallelRays::Frame& frame = map.frame();
  const int m = frame.axis[0], a_u = frame.axis[1], a_v = frame.axis[2];
  // Relative to the first ray: its place in the light's plane in double.
  const VoxelPos first = rays[0].voxel;
  for (int i = 0; i < 3; ++i)
    if (std::abs(int64_t{first[i]} - frame.low[i]) > kFarthest) {
      for (size_t ray = 0; ray < count; ++ray) answers.stream[answers.stream_count++] = static_cast<int32_t>(ray);
      return;
    }
  const auto along_main = [&](int32_t voxel) {
    return frame.down ? frame.size[0] - 1 - (voxel - frame.low[m]) : voxel - frame.low[m];
  };
  const int32_t first_k = along_main(first[m]);
  int32_t base[2];
  float base_fraction[2];
  for (int i = 0; i < 2; ++i) {
    const double at =
        double(first[frame.axis[1 + i]]) - frame.low[frame.axis[1 + i]] - frame.slope[i] * first_k + frame.shift[i];
    base[i] = static_cast<int32_t>(std::floor(at));
    base_fraction[i] = static_cast<float>(at - base[i]);
  }

  OpenRays open;
  const F one = hn::Set(df, 1.0f), zero = hn::Zero(df), half = hn::Set(df, 0.5f);
  const F slope_u = hn::Set(df, static_cast<float>(frame.slope[0])),
          slope_v = hn::Set(df, static_cast<float>(frame.slope[1]));
  const I limit = hn::Set(di, kMostOffset);
  // First the cells of all, then what they say: by then many loads are under way at once. Where a vector's cells are
  // all of one block, `slab` holds their places in it, else what they say.
  const ParallelRays::Cell* blocks[kPiece];
  alignas(64) int32_t cell_u[kMostLanes], cell_v[kMostLanes], says[kMostLanes];
  uint32_t fine_lanes[kPiece];
  int32_t held_u = -1, held_v = -1;
  const ParallelRays::Cell* held = nullptr;
  for (size_t at = 0; at < count; at += width) {
    const size_t some = std::min(width, count - at);
    Starts starts;
    load_starts(rays + at, some, frame, starts);
    prefetch_records(rays + at + kAhead, width);
    auto fine = starts.alike;
    for (int i = 0; i < 3; ++i) {
      const F f = hn::BitCast(df, starts.word[3 + i]);
      fine = hn::And(fine, hn::RebindMask(di, hn::And(hn::Ge(f, zero), hn::Le(f, one))));
    }
    const I from_m = hn::Sub(starts.word[m], hn::Set(di, first[m])),
            from_u = hn::Sub(starts.word[a_u], hn::Set(di, first[a_u])),
            from_v = hn::Sub(starts.word[a_v], hn::Set(di, first[a_v]));
    // Between -limit and limit; unsigned, since starts may lie anywhere.
    const auto near = [&](I from) {
      return hn::RebindMask(di, hn::Lt(hn::BitCast(du, hn::Add(from, limit)), hn::BitCast(du, hn::Add(limit, limit))));
    };
    fine = hn::And(fine, hn::And(near(from_m), hn::And(near(from_u), near(from_v))));
    const I d_k = frame.down ? hn::Neg(from_m) : from_m;
    const F given_k = hn::BitCast(df, starts.word[3 + m]);
    const F f_k = frame.down ? hn::Sub(one, given_k) : given_k;
    const F f_u = hn::BitCast(df, starts.word[3 + a_u]), f_v = hn::BitCast(df, starts.word[3 + a_v]);
    const F along = hn::Add(hn::ConvertTo(df, d_k), f_k);
    const auto light_cell = [&](I from, F f, F slope, int i) HWY_ATTR {
      const F at_plane =
          hn::Add(hn::NegMulAdd(slope, along, hn::ConvertTo(df, from)), hn::Add(f, hn::Set(df, base_fraction[i])));
      return hn::Add(hn::NearestInt(hn::Sub(at_plane, half)), hn::Set(di, base[i]));
    };
    const I u = light_cell(from_u, f_u, slope_u, 0), v = light_cell(from_v, f_v, slope_v, 1);
    const uint32_t fine_bits = fine_lanes[at / width] = bits_of(di, hn::And(fine, hn::FirstN(di, some)));
    const auto in_held = [&](I cell, int32_t block)
                             HWY_ATTR { return hn::Eq(hn::ShiftRight<kBlockBits>(cell), hn::Set(di, block)); };
    if (held && hn::AllTrue(di, hn::And(in_held(u, held_u), in_held(v, held_v)))) {
      const auto bits = [&](I cell, int32_t mask) HWY_ATTR { return hn::And(cell, hn::Set(di, mask)); };
      const I tile = hn::Or(hn::ShiftLeft<6>(bits(u, 56)), hn::ShiftLeft<3>(bits(v, 56)));
      hn::Store(hn::Or(tile, hn::Or(hn::ShiftLeft<3>(bits(u, 7)), bits(v, 7))), di, open.slab + at);
      blocks[at / width] = held;
    } else {
      hn::Store(u, di, cell_u), hn::Store(v, di, cell_v);
      for (size_t lane = 0; lane < width; ++lane) {
        says[lane] = 0;
        if (!(fine_bits >> lane & 1)) continue;
        const int32_t block_u = cell_u[lane] >> kBlockBits, block_v = cell_v[lane] >> kBlockBits;
        if (block_u != held_u || block_v != held_v) {
          if (static_cast<uint32_t>(block_u) >= static_cast<uint32_t>(frame.blocks[0]) ||
              static_cast<uint32_t>(block_v) >= static_cast<uint32_t>(frame.blocks[1]))
            continue;
          held_u = block_u, held_v = block_v;
          held = map.block(block_u, block_v).cell;
        }
        std::memcpy(says + lane, held + ParallelRays::cell_in_block(cell_u[lane], cell_v[lane]), 4);
      }
      hn::Store(hn::Load(di, says), di, open.slab + at);
      blocks[at / width] = nullptr;
    }
    hn::Store(hn::Add(d_k, hn::Set(di, first_k)), di, open.cell[0] + at);
    hn::Store(hn::Add(from_u, hn::Set(di, first[a_u] - frame.low[a_u])), di, open.cell[1] + at);
    hn::Store(hn::Add(from_v, hn::Set(di, first[a_v] - frame.low[a_v])), di, open.cell[2] + at);
    hn::Store(f_k, df, open.fraction[0] + at), hn::Store(f_u, df, open.fraction[1] + at);
    hn::Store(f_v, df, open.fraction[2] + at);
  }
  size_t open_count = 0;
  for (size_t at = 0; at < count; at += width) {
    const uint32_t fine_bits = fine_lanes[at / width];
    const auto fine = hn::TestBit(hn::Set(di, static_cast<int32_t>(fine_bits)), hn::Load(di, kLaneBits));
    const ParallelRays::Cell* block = blocks[at / width];
    I known = hn::Load(di, open.slab + at);
    if (block) known = hn::GatherIndex(di, reinterpret_cast<const int32_t*>(block), known);
    const I k = hn::Load(di, open.cell[0] + at);
    const I slab =
        hn::Sub(hn::And(known, hn::Set(di, 0xffff)), hn::Add(k, hn::Set(di, 1)));  // the last, from the start
    const auto shut =
        hn::And(fine, hn::Lt(hn::Max(k, hn::Zero(di)), hn::BitCast(di, hn::ShiftRight<16>(hn::BitCast(du, known)))));
    const auto going = hn::AndNot(shut, hn::And(fine, hn::Not(hn::Lt(slab, hn::Zero(di)))));
    const I index = hn::Iota(di, static_cast<int32_t>(at));
    answers.blocked_count += store_some(index, shut, answers.blocked + answers.blocked_count);
    const uint32_t given = static_cast<uint32_t>((uint64_t{1} << std::min(width, count - at)) - 1);
    for (uint32_t bad = ~fine_bits & given; bad; bad &= bad - 1)
      answers.stream[answers.stream_count++] = static_cast<int32_t>(at) + std::countr_zero(bad);
    open_count += put(open, open_count, going, slab, index, k, hn::Load(di, open.cell[1] + at),
                      hn::Load(di, open.cell[2] + at), hn::Load(df, open.fraction[0] + at),
                      hn::Load(df, open.fraction[1] + at), hn::Load(df, open.fraction[2] + at));
  }
  for (int turn = 0; open_count && turn < kMostTests; ++turn)
    open_count = m == 0   ? test_slabs<0>(frame, bricks, open, open_count, answers)
                 : m == 1 ? test_slabs<1>(frame, bricks, open, open_count, answers)
                          : test_slabs<2>(frame, bricks, open, open_count, answers);
  for (size_t i = 0; i < open_count; ++i) answers.stream[answers.stream_count++] = open.index[i] & kIndexBits;
}

void cast_grid_rays(const ParallelRaysKernel& map, const ParallelBricks& bricks, const GridRay* rays, size_t count,
                    ParallelAnswers& answers) {
  const WideVectors wide;
  cast_piece(map, bricks, rays, count, answers);
}
void cast_stream_rays(const ParallelRaysKernel& map, const ParallelBricks& bricks, const StreamRay* rays, size_t count,
                      ParallelAnswers& answers) {
  const WideVectors wide;
  cast_piece(map, bricks, rays, count, answers);
}

}  // namespace HWY_NAMESPACE
}  // namespace world
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace world {

namespace {
HWY_EXPORT(cast_grid_rays);
HWY_EXPORT(cast_stream_rays);
HWY_EXPORT(fill_block);

constexpr size_t kMostBlocks = size_t{1} << 22;

/// Of no map and no block before.
uint64_t next_version() {
  static std::atomic<uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

}  // namespace

ParallelRays::ParallelRays(const RayStream& stream, const Vec3d& direction) : stream_(&stream), direction_(direction) {
  frame_bounds();
}

ParallelRays::~ParallelRays() {
  for (size_t i = 0; i < block_count_; ++i) delete blocks_[i].load(std::memory_order_relaxed);
}

/// Lays the map over the bounds that the stream's bricks have now.
void ParallelRays::frame_bounds() {
  for (size_t i = 0; i < block_count_; ++i) delete blocks_[i].load(std::memory_order_relaxed);
  blocks_.reset();
  block_count_ = 0;
  version_ = next_version();
  const BrickVolume& bricks = stream_->bricks();
  if (!bricks.walkable()) return;
  Frame& f = frame_;
  int m = 0;
  for (int a = 0; a < 3; ++a) {
    f.direction[a] = static_cast<float>(direction_[a]);
    if (std::abs(direction_[a]) > std::abs(direction_[m])) m = a;
    if (!std::isfinite(f.direction[a])) return;
  }
  if (!(std::abs(f.direction[m]) >= std::numeric_limits<float>::min())) return;
  f.axis[0] = m, f.axis[1] = m == 0 ? 1 : 0, f.axis[2] = m == 2 ? 1 : 2;
  f.down = direction_[m] < 0;
  f.low = bricks.low();
  for (int i = 0; i < 3; ++i) f.size[i] = bricks.leaves_along()[f.axis[i]] * kLeafSize;
  if (f.size[0] > UINT16_MAX - 1) return;
  size_t count = 1;
  for (int i = 0; i < 2; ++i) {
    f.slope[i] = direction_[f.axis[1 + i]] / std::abs(direction_[m]);
    f.shift[i] = floor_to_int(std::max(0.0, f.slope[i] * f.size[0])) + 4;
    f.blocks[i] = static_cast<int32_t>((f.size[1 + i] + int64_t{floor_to_int(std::abs(f.slope[i]) * f.size[0])} + 8) >>
                                       kBlockBits) +
                  1;
    count *= static_cast<size_t>(f.blocks[i]);
  }
  if (count > kMostBlocks) return;
  blocks_ = std::make_unique<std::atomic<Block*>[]>(count);
  block_count_ = count;
}

size_t ParallelRays::bytes() const {
  size_t held = 0;
  for (size_t i = 0; i < block_count_; ++i) held += blocks_[i].load(std::memory_order_relaxed) != nullptr;
  return held * sizeof(Block) + block_count_ * sizeof(blocks_[0]);
}

void ParallelRays::update(std::span<const LeafPos> dirty) {
  const BrickVolume& bricks = stream_->bricks();
  bool moved = !block_count_ || !bricks.walkable() || bricks.low() != frame_.low;
  for (int i = 0; i < 3; ++i) moved = moved || bricks.leaves_along()[frame_.axis[i]] * kLeafSize != frame_.size[i];
  if (moved) return frame_bounds();
  version_ = next_version();
  for (const LeafPos& leaf : dirty) {
    const VoxelPos corner = voxel_from_leaf(leaf) - frame_.low;
    const int32_t main = corner[frame_.axis[0]];
    const double k = frame_.down ? frame_.size[0] - kLeafSize - main : main;
    int32_t low[2], high[2];
    for (int i = 0; i < 2; ++i) {
      const double at = corner[frame_.axis[1 + i]] + frame_.shift[i];
      const double near = frame_.slope[i] * k, far = frame_.slope[i] * (k + kLeafSize);
      low[i] = std::max(0, floor_to_int(at - std::max(near, far) - 2) >> kBlockBits);
      high[i] = std::min(frame_.blocks[i] - 1, floor_to_int(at + kLeafSize - std::min(near, far) + 2) >> kBlockBits);
    }
    for (int32_t u = low[0]; u <= high[0]; ++u)
      for (int32_t v = low[1]; v <= high[1]; ++v)
        delete blocks_[static_cast<size_t>(u) * static_cast<size_t>(frame_.blocks[1]) + static_cast<size_t>(v)]
            .exchange(nullptr, std::memory_order_relaxed);
  }
}

const ParallelRays::Block& ParallelRays::block(int32_t u, int32_t v) const {
  std::atomic<Block*>& slot =
      blocks_[static_cast<size_t>(u) * static_cast<size_t>(frame_.blocks[1]) + static_cast<size_t>(v)];
  if (const Block* held = slot.load(std::memory_order_acquire)) return *held;
  std::unique_ptr<Block> made(new Block);
  fill(*made, u, v);
  made->version = next_version();
  // Another thread may have made the same one meanwhile.
  Block* held = nullptr;
  if (slot.compare_exchange_strong(held, made.get(), std::memory_order_acq_rel)) held = made.release();
  return *held;
}

void ParallelRays::fill(Block& block, int32_t block_u, int32_t block_v) const {
  HWY_DYNAMIC_DISPATCH(fill_block)({frame_, stream_->bricks()}, block, block_u, block_v);
}

template <class Ray>
void ParallelRays::cast(std::span<const Ray> rays, std::span<uint8_t> blocked, StreamReport* report) const {
  if (!block_count_) return stream_->any_set_coherent(rays, blocked, report);
  const BrickVolume& bricks = stream_->bricks();
  const ParallelBricks view{reinterpret_cast<const int32_t*>(bricks.codes()),
                            reinterpret_cast<const int32_t*>(bricks.words()), bricks.leaves_along()[1],
                            bricks.leaves_along()[2]};
  StreamReport done;
  ParallelAnswers answers;
  for (size_t begin = 0; begin < rays.size(); begin += kPiece) {
    const size_t count = std::min(kPiece, rays.size() - begin);
    uint8_t* out = blocked.data() + begin;
    std::fill_n(out, count, uint8_t{0});
    answers.blocked_count = answers.stream_count = answers.exact_count = 0;
    if constexpr (std::is_same_v<Ray, GridRay>)
      HWY_DYNAMIC_DISPATCH(cast_grid_rays)(ParallelRaysKernel{*this}, view, &rays[begin], count, answers);
    else
      HWY_DYNAMIC_DISPATCH(cast_stream_rays)(ParallelRaysKernel{*this}, view, &rays[begin], count, answers);
    done.rays += count - answers.stream_count;
    done.exact += answers.exact_count;
    for (size_t i = 0; i < answers.blocked_count; ++i) out[answers.blocked[i] & kIndexBits] = 1;
    for (size_t i = 0; i < answers.exact_count; ++i) {
      const size_t ray = static_cast<size_t>(answers.exact[i] & kIndexBits);
      out[ray] = stream_->walker().any_set(rays[begin + ray]);
    }
    // The rest in the order given, so that neighbours stay together.
    std::sort(answers.stream, answers.stream + answers.stream_count);
    Ray rest[kPiece];
    uint8_t rest_blocked[kPiece];
    for (size_t i = 0; i < answers.stream_count; ++i) rest[i] = rays[begin + static_cast<size_t>(answers.stream[i])];
    if (answers.stream_count)
      stream_->any_set_coherent(std::span<const Ray>(rest, answers.stream_count), {rest_blocked, answers.stream_count},
                                &done);
    for (size_t i = 0; i < answers.stream_count; ++i) out[answers.stream[i]] = rest_blocked[i];
  }
  if (report) report->add(done);
}

void ParallelRays::any_set(std::span<const GridRay> rays, std::span<uint8_t> blocked, StreamReport* report) const {
  cast(rays, blocked, report);
}

void ParallelRays::any_set(std::span<const StreamRay> rays, std::span<uint8_t> blocked, StreamReport* report) const {
  cast(rays, blocked, report);
}

}  // namespace world
#endif
