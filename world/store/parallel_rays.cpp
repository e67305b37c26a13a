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

/// rows[r]: byte r of each of eight words, the first one's lowest.
HWY_INLINE void transpose_to(const uint64_t words[8], uint64_t rows[8]) {
#if HWY_TARGET == HWY_SCALAR
  std::copy_n(words, 8, rows);
  transpose_bytes(rows);
#else
  const hn::FixedTag<uint8_t, 16> d8;
  const hn::FixedTag<uint16_t, 8> d16;
  const hn::FixedTag<uint32_t, 4> d32;
  const hn::FixedTag<uint64_t, 2> d64;
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
  hn::StoreU(hn::BitCast(d64, hn::InterleaveLower(d32, low, low_high)), d64, rows);
  hn::StoreU(hn::BitCast(d64, hn::InterleaveUpper(d32, low, low_high)), d64, rows + 2);
  hn::StoreU(hn::BitCast(d64, hn::InterleaveLower(d32, high, high_high)), d64, rows + 4);
  hn::StoreU(hn::BitCast(d64, hn::InterleaveUpper(d32, high, high_high)), d64, rows + 6);
#endif
}

/// The map over one block, from the last layer of leaves back until every cell is decided.
void fill_block(const ParallelSource& source, ParallelRays::Block& block, int32_t block_u, int32_t block_v) {
  constexpr int kCells = ParallelRays::kBlockCells;
  const Words dw;
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
  uint64_t slices[kMostLeaves][8][24];  // by leaf along u, slab, leaf along v: rows are u, columns v
  bool row_held[kMostLeaves];
  bool open = true;
  for (int32_t layer = last_layer; open && layer >= first_layer; --layer) {
    // Cells that lie outside the bounds from here back are known.
    uint64_t out[2] = {0, 0};
    for (int i = 0; i < 2; ++i) {
      const Reach last = reach(i, layer * 8 + 7), first = reach(i, first_layer * 8);
      const int32_t low = std::min(last.first, first.first),
                    high = std::max(last.first + last.width, first.first + first.width);  // both of cell 0
      for (int c = 0; c < kCells; ++c)
        if (high + c <= 0 || low + c >= frame.size[1 + i]) out[i] |= uint64_t{1} << c;
    }
    if (out[0] | out[1])
      for (int c = 0; c < kCells; ++c) {
        const uint64_t known = out[0] >> c & 1 ? ~uint64_t{0} : out[1];
        met[c] |= known, shut[c] |= known;
      }
    // Leaves under the block in this layer.
    int32_t first_leaf[2], leaves[2];
    for (int i = 0; i < 2; ++i) {
      const Reach a = reach(i, layer * 8), b = reach(i, layer * 8 + 7);
      first_leaf[i] = std::min(a.first, b.first) >> 3;
      leaves[i] = ((std::max(a.first + a.width, b.first + b.width) + kCells - 2) >> 3) - first_leaf[i] + 1;
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
      LeafPos leaf;
      leaf[m] = main_leaf, leaf[frame.axis[1]] = u;
      for (int32_t j = 0; j < leaves[1];) {
        const int32_t v = first_leaf[1] + j;
        leaf[frame.axis[2]] = v;
        int32_t clear = 1;  // leaves from here on
        if (v >= 0 && v * 8 < frame.size[2]) {
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
        alignas(64) uint64_t near[8], far[8];
        transpose_to(words, near), transpose_to(words + 8, far);
        for (int r = 0; r < 8; r += static_cast<int>(hn::Lanes(dw))) {
          const auto low = hn::Load(dw, near + r), high = hn::ShiftLeft<1>(hn::Load(dw, far + r));
          const auto shifted = [&](int by) HWY_ATTR {
            return hn::Or(hn::ShiftRightSame(low, by), hn::ShiftLeftSame(high, 63 - by));
          };
          auto any_of = shifted(first_column & 7), all_of = any_of;
          for (int32_t c = 1; c < v.width; ++c) {
            const auto next = shifted((first_column & 7) + c);
            any_of = hn::Or(any_of, next), all_of = hn::And(all_of, next);
          }
          hn::Store(any_of, dw, some + i * 8 + r), hn::Store(all_of, dw, every + i * 8 + r);
        }
      }
      auto known = hn::Set(dw, ~uint64_t{0});
      for (int c = 0; c < kCells; c += static_cast<int>(hn::Lanes(dw))) {
        auto any_of = hn::LoadU(dw, some + first_row + c), all_of = hn::LoadU(dw, every + first_row + c);
        for (int32_t r = 1; r < u.width; ++r) {
          any_of = hn::Or(any_of, hn::LoadU(dw, some + first_row + c + r));
          all_of = hn::And(all_of, hn::LoadU(dw, every + first_row + c + r));
        }
        const auto met_now = hn::Load(dw, met + c), shut_now = hn::Load(dw, shut + c);
        const auto fresh = hn::AndNot(met_now, any_of), fresh_shut = hn::AndNot(shut_now, all_of);
        const auto shut_then = hn::Or(shut_now, all_of);
        known = hn::And(known, shut_then);
        if (hn::AllTrue(dw, hn::Eq(hn::Or(fresh, fresh_shut), hn::Zero(dw)))) continue;
        hn::Store(hn::Or(met_now, any_of), dw, met + c), hn::Store(shut_then, dw, shut + c);
        for (int bit = 0; (k + 1) >> bit; ++bit) {
          if ((k + 1) >> bit & 1) hn::Store(hn::Or(hn::Load(dw, end_planes[bit] + c), fresh), dw, end_planes[bit] + c);
          if (k >> bit & 1) hn::Store(hn::Or(hn::Load(dw, shut_planes[bit] + c), fresh_shut), dw, shut_planes[bit] + c);
        }
      }
      open = !hn::AllTrue(dw, hn::Eq(known, hn::Set(dw, ~uint64_t{0})));
    }
  }
  // At most 8 cells at a time: those of a row lie side by side in a tile.
  const hn::CappedTag<int32_t, 8> d8;
  const int bits = std::bit_width(static_cast<uint32_t>(frame.size[0]));
  const auto lane_bits = hn::Load(d8, kLaneBits);
  for (int row = 0; row < kCells; ++row)
    for (int column = 0; column < kCells; column += static_cast<int>(hn::Lanes(d8))) {
      auto cells = hn::Zero(d8);
      const auto add = [&](uint64_t plane, int32_t value) HWY_ATTR {
        const auto held = hn::TestBit(hn::Set(d8, static_cast<int32_t>(plane >> column)), lane_bits);
        cells = hn::Or(cells, hn::IfThenElseZero(held, hn::Set(d8, value)));
      };
      for (int bit = 0; bit < bits; ++bit) {
        add(end_planes[bit][row], 1 << bit);
        add(shut_planes[bit][row], static_cast<int32_t>(1u << (bit + 16)));
      }
      hn::Store(cells, d8, reinterpret_cast<int32_t*>(block.cell + ParallelRays::cell_in_block(row, column)));
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

/// Tests the slab each open ray stands at. Appends to `answers` what is blocked and what ended unsure; those that go on
/// move to the front. Returns how many.
template <int kMain>
size_t test_slabs(const ParallelRays::Frame& frame, const ParallelBricks& bricks, OpenRays& open, size_t count,
                  ParallelAnswers& answers) {
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
  const I size_m = hn::Set(di, frame.size[0]), size_u = hn::Set(di, frame.size[1]), size_v = hn::Set(di, frame.size[2]);
  alignas(64) int32_t at_leaf[kMostLanes], at_word[kMostLanes];
  size_t kept = 0;
  for (size_t at = 0; at < count; at += width) {
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

    const I mirrored = hn::Add(k, slab);
    const I gm = hn::Add(hn::Xor(mirrored, flip), hn::Add(flipped_from, hn::And(flip, one)));
    const auto in_main = hn::And(hn::Not(hn::Lt(gm, zero)), hn::Lt(gm, size_m));
    const auto test = [&](I cell_u, I cell_v) HWY_ATTR __attribute__((always_inline)) {
      I g[3];
      g[kMain] = gm, g[kU] = hn::Add(u, cell_u), g[kV] = hn::Add(v, cell_v);
      const auto in = hn::And(in_main, hn::And(hn::And(hn::Not(hn::Lt(g[kU], zero)), hn::Lt(g[kU], size_u)),
                                               hn::And(hn::Not(hn::Lt(g[kV], zero)), hn::Lt(g[kV], size_v))));
      const I column = hn::Add(hn::Mul(hn::ShiftRight<3>(g[0]), hn::Set(di, bricks.leaves_z)), hn::ShiftRight<3>(g[2]));
      const I leaf = hn::Add(hn::Mul(column, hn::Set(di, bricks.leaves_y)), hn::ShiftRight<3>(g[1]));
      hn::Store(hn::IfThenElseZero(in, leaf), di, at_leaf);
      const I code = gather(bricks.codes, at_leaf);
      const I word_in_leaf =
          hn::Or(hn::ShiftLeft<1>(hn::And(g[0], hn::Set(di, 4))),
                 hn::Or(hn::And(g[1], hn::Set(di, 6)), hn::ShiftRight<2>(hn::And(g[2], hn::Set(di, 4)))));
      hn::Store(word_index(code, word_in_leaf), di, at_word);
      const I word = gather(bricks.words, at_word);
      const I three = hn::Set(di, 3);
      const I bit = hn::Or(hn::ShiftLeft<3>(hn::And(g[0], three)),
                           hn::Or(hn::ShiftLeft<2>(hn::And(g[1], one)), hn::And(g[2], three)));
      const I shifted = hn::BitCast(di, hn::Shr(hn::BitCast(du, word), hn::BitCast(du, bit)));
      return hn::And(in, hn::Lt(hn::And(hn::ShiftLeft<31>(shifted), code), zero));
    };
    const auto hit = hn::Or(test(iu, iv), hn::Or(test(bu, bv), test(ju, jv)));

    // What is unsure may not have met what it seems to meet.
    const auto blocked_now = hn::AndNot(unsure, hit);
    I index = hn::Load(di, open.index + at);
    index = hn::Or(index, hn::IfThenElseZero(unsure, hn::Set(di, INT32_MIN)));
    const auto given = hn::FirstN(di, count - at);
    answers.blocked_count += store_some(index, hn::And(given, blocked_now), answers.blocked + answers.blocked_count);
    const auto doubtful = hn::And(hn::And(given, hn::Lt(index, zero)), hn::AndNot(blocked_now, starting));
    if (!hn::AllFalse(di, doubtful))
      answers.exact_count += store_some(index, doubtful, answers.exact + answers.exact_count);
    const auto on = hn::AndNot(hn::Or(blocked_now, starting), given);
    kept += put(open, kept, on, hn::Sub(slab, one), index, k, u, v, f_k, f_u, f_v);
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
  cast_piece(map, bricks, rays, count, answers);
}
void cast_stream_rays(const ParallelRaysKernel& map, const ParallelBricks& bricks, const StreamRay* rays, size_t count,
                      ParallelAnswers& answers) {
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
