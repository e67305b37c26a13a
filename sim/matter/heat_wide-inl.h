/// Conduction in pages in and around which at most three kinds meet, for processors of 256 and 512 bits: one row along
/// z in a vector, or two. What heat_kernel.cpp does for any page, bit for bit; compiled once for each target.
///
/// Faces of the high sides are found with those within the page: what lies beyond takes the place of the next voxel, in
/// the last lane of a row, the last row of a plane, and the ninth plane. Those of the low sides are found before. A
/// closed side has share 0.
#if defined(SIM_MATTER_HEAT_WIDE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_MATTER_HEAT_WIDE_INL_H
#undef SIM_MATTER_HEAT_WIDE_INL_H
#else
#define SIM_MATTER_HEAT_WIDE_INL_H
#endif

#include <hwy/highway.h>

#include "sim/matter/heat_kernel.h"
#include "sim/matter/heat_vectors-inl.h"

#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

using WideRow = hn::CappedTag<float, 16>;
using WideIntRow = hn::RebindToSigned<WideRow>;
using WideCodeRow = hn::RebindToUnsigned<WideRow>;
constexpr WideRow kWide;
constexpr WideIntRow kWideInt;
constexpr WideCodeRow kWideCode;
using WV = hn::Vec<WideRow>;
using WI = hn::Vec<WideIntRow>;
constexpr int kWideLanes = static_cast<int>(hn::MaxLanes(kWide));
constexpr int kRows = kWideLanes / 8;  // in a vector

#if HWY_TARGET <= HWY_AVX3

HWY_INLINE WI wide_flow(WV size, WV difference) {
  return WI{_mm512_cvttps_epi32(hn::CopySignToAbs(size, difference).raw)};
}
/// Numbers of the voxels of kRows rows, in the lowest three bits.
HWY_INLINE WI wide_codes(const uint32_t* rows) {
  const __m512i row = _mm512_set_epi32(1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0);
  const __m512i shift = _mm512_set_epi32(21, 18, 15, 12, 9, 6, 3, 0, 21, 18, 15, 12, 9, 6, 3, 0);
  const __m512i two = _mm512_castsi128_si512(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(rows)));
  return WI{_mm512_srlv_epi32(_mm512_permutexvar_epi32(row, two), shift)};
}
/// The last lane of each row is from `ends`, one for a row.
HWY_INLINE WV with_row_ends(WV v, const float* ends) {
  const __m512i lane = _mm512_set_epi32(1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
  const __m512 two =
      _mm512_castsi512_ps(_mm512_castsi128_si512(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(ends))));
  return WV{_mm512_mask_permutexvar_ps(v.raw, 0x8080, lane, two)};
}
/// From each lane to the next of the row; into its first from `starts`.
HWY_INLINE WI moved_up(WI v, const int32_t* starts) {
  const __m512i lane = _mm512_set_epi32(0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0);
  const __m512i two = _mm512_castsi128_si512(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(starts)));
  return WI{_mm512_mask_permutexvar_epi32(_mm512_alignr_epi32(v.raw, v.raw, 15), 0x0101, lane, two)};
}
/// Rows before those of v: the last of `before`, then those of v but its last.
HWY_INLINE WI rows_before(WI before, WI v) { return WI{_mm512_shuffle_i64x2(before.raw, v.raw, 0x4e)}; }
/// The last row is another.
template <class T>
HWY_INLINE WV with_last_row(WV v, const T* row) {
  return WV{_mm512_insertf32x8(v.raw, _mm256_loadu_ps(row), 1)};
}
/// Rows `stride` apart.
HWY_INLINE WI load_rows(const int32_t* from, int stride) {
  const __m256i first = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
  return WI{_mm512_inserti32x8(_mm512_castsi256_si512(first),
                               _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from + stride)), 1)};
}
HWY_INLINE uint64_t wide_bits_not_zero(WI v) { return _mm512_test_epi32_mask(v.raw, v.raw); }

/// Eight numbers, of which the lowest three bits of a lane name one.
class WideEight {
 public:
  HWY_INLINE explicit WideEight(const float* from) : table_(_mm512_broadcast_f32x8(_mm256_load_ps(from))) {}
  HWY_INLINE WV operator()(WI k) const { return WV{_mm512_permutexvar_ps(k.raw, table_)}; }

 private:
  __m512 table_;
};

#else

HWY_INLINE WI wide_flow(WV size, WV difference) { return flow_of(size, difference); }
HWY_INLINE WI wide_codes(const uint32_t* rows) { return codes_in_row(rows[0], 0); }
HWY_INLINE WV with_row_ends(WV v, const float* ends) {
  return WV{_mm256_blend_ps(v.raw, _mm256_broadcast_ss(ends), 0x80)};
}
HWY_INLINE WI moved_up(WI v, const int32_t* starts) {
  const __m256i lane = _mm256_set_epi32(6, 5, 4, 3, 2, 1, 0, 7);
  return WI{_mm256_blend_epi32(_mm256_permutevar8x32_epi32(v.raw, lane), _mm256_set1_epi32(starts[0]), 1)};
}
HWY_INLINE WI rows_before(WI before, WI) { return before; }
HWY_INLINE WV with_last_row(WV, const float* row) { return hn::LoadU(kWide, row); }
HWY_INLINE WI load_rows(const int32_t* from, int) { return hn::LoadU(kWideInt, from); }
HWY_INLINE uint64_t wide_bits_not_zero(WI v) { return bits_not_zero(v); }
using WideEight = Eight;

#endif

struct WideConductance {
  WV g, share;
};

/// Into the voxel at temperature `own`.
HWY_INLINE WI wide_flow_between(WV own, WV other, const WideConductance& c, WV phase) {
  const WV difference = hn::Sub(other, own), size = hn::Abs(difference);
  return wide_flow(hn::Min(hn::Add(hn::Mul(size, c.g), phase), hn::Mul(size, c.share)), difference);
}

/// Of voxels in vectors: warmth(heats, codes), where codes are asked for in a page of several kinds.
template <class Use>
HWY_INLINE void with_wide_warmth(const HeatSource& s, Use use) {
  const auto number = [](WI heat) { return hn::ConvertTo(kWide, heat); };
  const auto clamp = [](WV t, WV low, WV high) { return hn::Min(hn::Max(t, low), high); };
  if (const ThermalKinds* kinds = s.kinds) {
    const WideEight inverse(kinds->few[kInverse]), born(kinds->few[kBorn]), low(kinds->few[kLow]),
        high(kinds->few[kHigh]);
    if (kinds->limited)
      use([&](WI heat, auto code) {
        const WI k = code();
        return clamp(hn::Add(hn::Mul(number(heat), inverse(k)), born(k)), low(k), high(k));
      });
    else
      use([&](WI heat, auto code) { return hn::Mul(number(heat), inverse(code())); });
    return;
  }
  const WV inverse = hn::Set(kWide, s.all.inverse), born = hn::Set(kWide, s.all.born), low = hn::Set(kWide, s.all.low),
           high = hn::Set(kWide, s.all.high);
  if (is_limited(s.all))
    use([&](WI heat, auto) { return clamp(hn::Add(hn::Mul(number(heat), inverse), born), low, high); });
  else
    use([&](WI heat, auto) { return hn::Mul(number(heat), inverse); });
}

/// How warm the 64 voxels of a page's side are: the side at layer `at` along the axis.
template <int kAxis>
HWY_INLINE void side_temperatures(const HeatSource& s, int at, float* into) {
  if (s.closed) {
    for (int i = 0; i < 64; i += kWideLanes) hn::Store(hn::Zero(kWide), kWide, into + i);
    return;
  }
  const int32_t* heat = s.heat ? s.heat : kNoHeats;
  alignas(64) int32_t gathered[64];
  if constexpr (kAxis == 2) gather_side(heat, at, gathered);
  with_wide_warmth(s, [&](auto warmth) {
    for (int i = 0; i < 64; i += kWideLanes) {
      const int row = i >> 3;
      const auto codes = [&] {
        const uint32_t* rows = s.kinds->code_row;
        if constexpr (kAxis == 0) return wide_codes(rows + at * 8 + row);
        if constexpr (kAxis == 1) {
          const uint32_t two[2] = {rows[row * 8 + at], rows[std::min(row + 1, 7) * 8 + at]};
          return wide_codes(two);
        }
        return hn::BitCast(kWideInt,
                           hn::Shr(hn::LoadU(kWideCode, rows + i), hn::Set(kWideCode, static_cast<uint32_t>(at * 3))));
      };
      WI heats;
      if constexpr (kAxis == 0) heats = hn::LoadU(kWideInt, heat + at * 64 + i);
      if constexpr (kAxis == 1) heats = load_rows(heat + row * 64 + at * 8, 64);
      if constexpr (kAxis == 2) heats = hn::Load(kWideInt, gathered + i);
      hn::Store(warmth(heats, codes), kWide, into + i);
    }
  });
}

/// Sums of two codes for the faces of a page, in rows; 7 where nothing flows. Beyond the sides: in the codes of here.
struct alignas(64) WideMeetings {
  static constexpr uint32_t kEach = 0x249249, kClosedRow = 0xffffff;
  uint32_t above_x[64], above_y[64], above_z[64];
  uint32_t below_x[8], below_y[8], below_z[64];  // of the low sides; those across z a number each

  static uint32_t code(const CodedSide& side, int there) { return std::bit_cast<uint32_t>(side.code[there]); }
  /// `count` rows of a page beyond from `at` on, `stride` apart, added to those here.
  static void add(const HeatSource& beyond, const CodedSide& side, int at, int stride, const uint32_t* here,
                  int here_stride, int count, uint32_t* sums) {
    if (beyond.closed) {
      for (int k = 0; k < count; ++k) sums[k * here_stride] = kClosedRow;
      return;
    }
    const uint32_t c0 = code(side, 0);
    if (!beyond.kinds) {
      for (int k = 0; k < count; ++k) sums[k * here_stride] = here[k * here_stride] + c0 * kEach;
      return;
    }
    const uint32_t c1 = beyond.kinds->count > 1 ? code(side, 1) : 0, c3 = beyond.kinds->count > 2 ? code(side, 3) : 0;
    const uint32_t* rows = beyond.kinds->code_row + at;
    for (int k = 0; k < count; ++k) {
      const uint32_t row = rows[k * stride], some = row & kEach, third = row >> 1 & kEach;
      sums[k * here_stride] = here[k * here_stride] + (some ^ kEach) * c0 + (some ^ third) * c1 + third * c3;
    }
  }
  /// Across z: the code of each row's layer `at` there.
  static HWY_INLINE hn::Vec<WideCodeRow> codes_across_z(const HeatSource& beyond, const CodedSide& side, int at,
                                                        int row) {
    if (!beyond.kinds) return hn::Set(kWideCode, code(side, 0));
    const WideEight map(side.code);
    const auto codes =
        hn::Shr(hn::LoadU(kWideCode, beyond.kinds->code_row + row), hn::Set(kWideCode, static_cast<uint32_t>(at * 3)));
    return hn::BitCast(kWideCode, map(hn::BitCast(kWideInt, codes)));
  }

  HWY_INLINE void find(const uint32_t* rows, const HeatSource* sides, const CodedSide* coded) {
    for (int k = 0; k < 56; ++k) above_x[k] = rows[k] + rows[k + 8];
    for (int k = 0; k < 63; ++k) above_y[k] = rows[k] + rows[k + 1];
    add(sides[0], coded[0], 56, 1, rows, 1, 8, below_x);
    add(sides[1], coded[1], 0, 1, rows + 56, 1, 8, above_x + 56);
    alignas(32) uint32_t first[8];
    for (int x = 0; x < 8; ++x) first[x] = rows[x * 8];
    add(sides[2], coded[2], 7, 8, first, 1, 8, below_y);
    add(sides[3], coded[3], 0, 8, rows + 7, 8, 8, above_y + 7);
    const auto seven = hn::Set(kWideCode, 7u), last = hn::Set(kWideCode, 7u << 21);
    for (int k = 0; k < 64; k += kWideLanes) {
      const auto row = hn::Load(kWideCode, rows + k);
      auto low = seven, sum = last;
      if (!sides[4].closed) low = hn::Add(hn::And(row, seven), codes_across_z(sides[4], coded[4], 7, k));
      hn::Store(low, kWideCode, below_z + k);
      const auto inner = hn::Add(row, hn::ShiftRight<3>(row));
      if (!sides[5].closed) {
        const auto beyond = hn::And(codes_across_z(sides[5], coded[5], 0, k), seven);
        sum = hn::Add(hn::And(row, last), hn::ShiftLeft<21>(beyond));
      }
      hn::Store(hn::Or(hn::AndNot(last, inner), sum), kWideCode, above_z + k);
    }
  }
};

/// All that the loops of a page read.
struct alignas(64) WideTemperatures {
  float own[9 * 64];  // and what is across the high x
  float above_y[64], above_z[64], below_x[64], below_y[64], below_z[64];
};

template <bool kCoded>
HWY_INLINE HeatResult conduct_wide(const HeatSource& page, const HeatSource* sides, const CodedSide* coded,
                                   const Kinds& kinds, const HeatStep& step, int32_t* heat, const HeatAhead& ahead) {
  // Find how warm all is.
  WideTemperatures t;
  const int32_t* before = page.heat ? page.heat : kNoHeats;
  with_wide_warmth(page, [&](auto warmth) {
    for (int i = 0; i < kVoxels; i += kWideLanes)
      hn::Store(warmth(hn::LoadU(kWideInt, before + i), [&] { return wide_codes(page.kinds->code_row + (i >> 3)); }),
                kWide, t.own + i);
  });
  side_temperatures<0>(sides[0], 7, t.below_x), side_temperatures<0>(sides[1], 0, t.own + kVoxels);
  side_temperatures<1>(sides[2], 7, t.below_y), side_temperatures<1>(sides[3], 0, t.above_y);
  side_temperatures<2>(sides[4], 7, t.below_z), side_temperatures<2>(sides[5], 0, t.above_z);

  // Conductances: of one kind within the page, and one across each side; or by the sums of codes.
  const Faces<false> faces(step);
  const WV phase = hn::Set(kWide, step.phase);
  alignas(64) float side_g[6], side_share[6];
  Meetings table;
  WideMeetings meets;
  if constexpr (kCoded) {
    alignas(64) static constexpr uint32_t kNoCodes[64] = {};
    table.find(kinds, faces);
    meets.find(page.kinds ? page.kinds->code_row : kNoCodes, sides, coded);
  } else {
    for (int f = 0; f < 6; ++f) {
      const Conductance c =
          sides[f].closed ? Conductance{hn::Zero(kRow), hn::Zero(kRow)} : faces.between(page.all, sides[f].all);
      side_g[f] = hn::GetLane(c.g), side_share[f] = hn::GetLane(c.share);
    }
  }
  const WideEight g(table.g()), share(table.share());
  const auto meet = [&](WI sums) HWY_ATTR { return WideConductance{g(sums), share(sums)}; };
  const auto of_side = [&](int f) HWY_ATTR {
    return WideConductance{hn::Set(kWide, side_g[f]), hn::Set(kWide, side_share[f])};
  };
  const Conductance within = faces.between(page.all, page.all);
  const WideConductance inner{hn::Set(kWide, hn::GetLane(within.g)), hn::Set(kWide, hn::GetLane(within.share))};
  WideConductance across_z = inner, last_y = inner;
  if constexpr (!kCoded) {
    alignas(64) float ends[2][2] = {{side_g[5], side_g[5]}, {side_share[5], side_share[5]}};
    across_z = {with_row_ends(inner.g, ends[0]), with_row_ends(inner.share, ends[1])};
    alignas(32) float row[2][8];
    for (int k = 0; k < 8; ++k) row[0][k] = side_g[3], row[1][k] = side_share[3];
    last_y = {with_last_row(inner.g, row[0]), with_last_row(inner.share, row[1])};
  }

  // What flows through the low sides, out of the page.
  alignas(64) int32_t behind[64], low_y[64], low_z[64];
  alignas(64) float own_z[64];
  gather_side(t.own, 0, own_z);
  for (int i = 0; i < 64; i += kWideLanes) {
    const int row = i >> 3;
    WideConductance x = inner, y = inner, z = inner;
    if constexpr (kCoded) {
      x = meet(wide_codes(meets.below_x + row)), y = meet(wide_codes(meets.below_y + row));
      z = meet(hn::BitCast(kWideInt, hn::Load(kWideCode, meets.below_z + i)));
    } else {
      x = of_side(0), y = of_side(2), z = of_side(4);
    }
    const WV own_y = hn::BitCast(kWide, load_rows(reinterpret_cast<const int32_t*>(t.own) + row * 64, 64));
    // From there to here is the other way round.
    hn::Store(wide_flow_between(hn::Load(kWide, t.below_x + i), hn::Load(kWide, t.own + i), x, phase), kWideInt,
              behind + i);
    hn::Store(wide_flow_between(hn::Load(kWide, t.below_y + i), own_y, y, phase), kWideInt, low_y + i);
    hn::Store(wide_flow_between(hn::Load(kWide, t.below_z + i), hn::Load(kWide, own_z + i), z, phase), kWideInt,
              low_z + i);
  }

  // Every face once.
  constexpr int kPieces = 8 / kRows;
  const auto or_own = [&](const int32_t* from) { return from ? from : reinterpret_cast<const int32_t*>(t.own); };
  const int32_t *next_own = or_own(ahead.own), *next_low_x = or_own(ahead.low_x), *next_high_x = or_own(ahead.high_x),
                *next_high_y = or_own(ahead.high_y), *next_into = or_own(ahead.into);
  world::LeafMask changed;
  for (int x = 0; x < 8; ++x) {
    const WideConductance across_x = kCoded || x < 7 ? inner : of_side(1);
    alignas(64) int32_t first_y[2 * 8] = {};
    hn::StoreU(hn::LoadU(kIntRow, low_y + x * 8), kIntRow, first_y + (kRows - 1) * 8);
    WI last_above_y = hn::Load(kWideInt, first_y);
    uint64_t word = 0;
    __builtin_prefetch(next_high_x + x * 8), __builtin_prefetch(next_high_y + x * 64);
    __builtin_prefetch(next_low_x + 7 * 64 + x * 8);
    if constexpr (kCoded)
      for (const ThermalKinds* beside : {ahead.own_kinds, ahead.high_x_kinds, ahead.high_y_kinds})
        if (beside) __builtin_prefetch(reinterpret_cast<const char*>(beside) + x * 64);
    for (int piece = 0; piece < kPieces; ++piece) {
      const int i = x * 64 + piece * kWideLanes, row = i >> 3;
      if (kRows == 2 || piece % 2 == 0) __builtin_prefetch(next_own + i), __builtin_prefetch(next_into + i, 1);
      const bool is_last = piece == kPieces - 1;
      const WV own = hn::Load(kWide, t.own + i);
      WV next_y = hn::LoadU(kWide, t.own + i + 8);
      if (is_last) next_y = with_last_row(next_y, t.above_y + x * 8);
      const WV next_z = with_row_ends(hn::LoadU(kWide, t.own + i + 1), t.above_z + row);
      WideConductance c_x = across_x, c_y = is_last ? last_y : inner, c_z = across_z;
      if constexpr (kCoded)
        c_x = meet(wide_codes(meets.above_x + row)), c_y = meet(wide_codes(meets.above_y + row)),
        c_z = meet(wide_codes(meets.above_z + row));
      const WI above_x = wide_flow_between(own, hn::Load(kWide, t.own + i + 64), c_x, phase);
      const WI above_y = wide_flow_between(own, next_y, c_y, phase);
      const WI above_z = wide_flow_between(own, next_z, c_z, phase);
      const WI below_x = hn::Load(kWideInt, behind + piece * kWideLanes);
      const WI below_y = rows_before(last_above_y, above_y), below_z = moved_up(above_z, low_z + row);
      const WI net = hn::Add(hn::Add(hn::Sub(above_x, below_x), hn::Sub(above_y, below_y)), hn::Sub(above_z, below_z));
      hn::Store(above_x, kWideInt, behind + piece * kWideLanes);
      last_above_y = above_y;
      hn::Store(hn::Add(hn::LoadU(kWideInt, before + i), net), kWideInt, heat + i);
      word |= wide_bits_not_zero(net) << (piece * kWideLanes);
    }
    changed.word[x] = word;
  }
  return result_of(changed);
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#endif
#endif
