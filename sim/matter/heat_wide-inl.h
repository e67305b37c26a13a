/// Conduction in pages in and around which at most three kinds meet, for processors of 256 and 512 bits: one row along
/// z in a vector, or two. What heat_kernel.cpp does for any page, bit for bit; compiled once for each target.
///
/// What flows through the sides is found first, where it isn't known; then all faces within the page, where that takes
/// its place in the last lane of a row, the last row of a plane, and the last plane. A closed side has share 0.
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

/// Numbers of the voxels of kRows rows, in the lowest three bits.
HWY_INLINE WI wide_codes(const uint32_t* rows) {
  const __m512i row = _mm512_set_epi32(1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0);
  const __m512i shift = _mm512_set_epi32(21, 18, 15, 12, 9, 6, 3, 0, 21, 18, 15, 12, 9, 6, 3, 0);
  const __m512i two = _mm512_castsi128_si512(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(rows)));
  return WI{_mm512_srlv_epi32(_mm512_permutexvar_epi32(row, two), shift)};
}
/// The last lane of each row is from `ends`, one for a row.
HWY_INLINE WI with_row_ends(WI v, const int32_t* ends) {
  const __m512i lane = _mm512_set_epi32(1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
  const __m512i two = _mm512_castsi128_si512(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(ends)));
  return WI{_mm512_mask_permutexvar_epi32(v.raw, 0x8080, lane, two)};
}
/// From each lane to the next of the row; into its first from `starts`.
HWY_INLINE WI moved_up(WI v, const int32_t* starts) {
  const __m512i lane = _mm512_set_epi32(14, 13, 12, 11, 10, 9, 8, 17, 6, 5, 4, 3, 2, 1, 0, 16);
  const __m512i two = _mm512_castsi128_si512(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(starts)));
  return WI{_mm512_permutex2var_epi32(v.raw, lane, two)};
}
/// Rows before those of v: the last of `before`, then those of v but its last.
HWY_INLINE WI rows_before(WI before, WI v) { return WI{_mm512_shuffle_i64x2(before.raw, v.raw, 0x4e)}; }
/// The last row is another; all rows are one.
HWY_INLINE WI with_last_row(WI v, const int32_t* row) {
  return WI{_mm512_inserti32x8(v.raw, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(row)), 1)};
}
HWY_INLINE WI rows_of(const int32_t* row) {
  return WI{_mm512_broadcast_i32x8(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(row)))};
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

HWY_INLINE WI wide_codes(const uint32_t* rows) { return codes_in_row(rows[0], 0); }
HWY_INLINE WI with_row_ends(WI v, const int32_t* ends) {
  return WI{_mm256_blend_epi32(v.raw, _mm256_set1_epi32(ends[0]), 0x80)};
}
HWY_INLINE WI moved_up(WI v, const int32_t* starts) {
  const __m256i lane = _mm256_set_epi32(6, 5, 4, 3, 2, 1, 0, 7);
  return WI{_mm256_blend_epi32(_mm256_permutevar8x32_epi32(v.raw, lane), _mm256_set1_epi32(starts[0]), 1)};
}
HWY_INLINE WI rows_before(WI before, WI) { return before; }
HWY_INLINE WI with_last_row(WI, const int32_t* row) { return hn::LoadU(kWideInt, row); }
HWY_INLINE WI rows_of(const int32_t* row) { return hn::LoadU(kWideInt, row); }
HWY_INLINE WI load_rows(const int32_t* from, int) { return hn::LoadU(kWideInt, from); }
HWY_INLINE uint64_t wide_bits_not_zero(WI v) { return bits_not_zero(v); }
using WideEight = Eight;

#endif

struct WideConductance {
  WV g, share;
};

/// Into the voxel at temperature `own`. With 512 bits all terms keep the sign of the difference, and the smaller is
/// taken by its size: one instruction less.
HWY_INLINE WI wide_flow_between(WV own, WV other, const WideConductance& c, WV phase) {
  const WV difference = hn::Sub(other, own);
#if HWY_TARGET <= HWY_AVX3
  constexpr int kFirstAndSecondOrThird = 0xea, kSmallerSizeSignOfFirst = 2;
  const __m512i bits = _mm512_castps_si512(difference.raw), sign = _mm512_set1_epi32(INT32_MIN);
  const __m512 signed_phase = _mm512_castsi512_ps(
      _mm512_ternarylogic_epi32(bits, sign, _mm512_castps_si512(phase.raw), kFirstAndSecondOrThird));
  const WV wanted = hn::Add(hn::Mul(difference, c.g), WV{signed_phase}), allowed = hn::Mul(difference, c.share);
  return WI{_mm512_cvttps_epi32(_mm512_range_ps(wanted.raw, allowed.raw, kSmallerSizeSignOfFirst))};
#else
  const WV size = hn::Abs(difference);
  return flow_of(hn::Min(hn::Add(hn::Mul(size, c.g), phase), hn::Mul(size, c.share)), difference);
#endif
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
  if (kAxis == 2 && !s.side) gather_side(heat, at, gathered);
  const int32_t* const ready = s.side ? s.side : kAxis == 2 ? gathered : nullptr;
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
      if (ready)
        heats = hn::LoadU(kWideInt, ready + i);
      else if (kAxis == 0)
        heats = hn::LoadU(kWideInt, heat + at * 64 + i);
      else
        heats = load_rows(heat + row * 64 + at * 8, 64);
      hn::Store(warmth(heats, codes), kWide, into + i);
    }
  });
}

/// Sums of two codes for the faces of a page, in rows; 7 where nothing flows, or what flows is known. Beyond the sides:
/// in the codes of here.
struct alignas(64) WideMeetings {
  static constexpr uint32_t kEach = 0x249249, kClosedRow = 0xffffff;
  uint32_t above_x[64], above_y[64], above_z[64];
  uint32_t below_x[8], below_y[8], below_z[64];  // of the low sides; those across z a number each
  uint32_t last_z[64], last_y[8];                // of the high ones

  static uint32_t code(const CodedSide& side, int there) { return std::bit_cast<uint32_t>(side.code[there]); }
  /// `count` rows of a page beyond from `at` on, `stride` apart, added to those here.
  static void add(bool closed, const HeatSource& beyond, const CodedSide& side, int at, int stride,
                  const uint32_t* here, int here_stride, int count, uint32_t* sums) {
    if (closed) {
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

  HWY_INLINE void find(const uint32_t* rows, const HeatSource* sides, const CodedSide* coded, uint8_t known) {
    const auto closed = [&](int f) { return sides[f].closed || (known >> f & 1); };
    for (int k = 0; k < 56; ++k) above_x[k] = rows[k] + rows[k + 8];
    for (int k = 0; k < 63; ++k) above_y[k] = rows[k] + rows[k + 1];
    add(closed(0), sides[0], coded[0], 56, 1, rows, 1, 8, below_x);
    add(closed(1), sides[1], coded[1], 0, 1, rows + 56, 1, 8, above_x + 56);
    alignas(32) uint32_t first[8];
    for (int x = 0; x < 8; ++x) first[x] = rows[x * 8];
    add(closed(2), sides[2], coded[2], 7, 8, first, 1, 8, below_y);
    add(closed(3), sides[3], coded[3], 0, 8, rows + 7, 8, 8, above_y + 7);
    for (int x = 0; x < 8; ++x) last_y[x] = above_y[x * 8 + 7];
    const auto seven = hn::Set(kWideCode, 7u);
    for (int k = 0; k < 64; k += kWideLanes) {
      const auto row = hn::Load(kWideCode, rows + k);
      auto low = seven, high = seven;
      if (!closed(4)) low = hn::Add(hn::And(row, seven), codes_across_z(sides[4], coded[4], 7, k));
      if (!closed(5)) high = hn::Add(hn::ShiftRight<21>(row), codes_across_z(sides[5], coded[5], 0, k));
      hn::Store(low, kWideCode, below_z + k);
      hn::Store(high, kWideCode, last_z + k);
      hn::Store(hn::Add(row, hn::ShiftRight<3>(row)), kWideCode, above_z + k);
    }
  }
};

template <bool kCoded>
HWY_INLINE HeatResult conduct_wide(const HeatSource& page, const HeatSource* sides, const CodedSide* coded,
                                   const Kinds& kinds, const HeatStep& step, int32_t* heat, const HeatFlows& flows,
                                   const HeatAhead& ahead) {
  // Find how warm all is.
  alignas(64) float own_t[kVoxels + kWideLanes];
  const int32_t* before = page.heat ? page.heat : kNoHeats;
  with_wide_warmth(page, [&](auto warmth) {
    for (int i = 0; i < kVoxels; i += kWideLanes)
      hn::Store(warmth(hn::LoadU(kWideInt, before + i), [&] { return wide_codes(page.kinds->code_row + (i >> 3)); }),
                kWide, own_t + i);
  });
  hn::Store(hn::Zero(kWide), kWide, own_t + kVoxels);

  // Conductances: of one kind within the page, and one across each side; or by the sums of codes.
  const Faces<false> faces(step);
  const WV phase = hn::Set(kWide, step.phase);
  Meetings table;
  WideMeetings meets;
  if constexpr (kCoded) {
    alignas(64) static constexpr uint32_t kNoCodes[64] = {};
    table.find(kinds, faces);
    meets.find(page.kinds ? page.kinds->code_row : kNoCodes, sides, coded, flows.known);
  }
  const WideEight g(table.g()), share(table.share());
  const auto meet = [&](WI sums) HWY_ATTR { return WideConductance{g(sums), share(sums)}; };
  const Conductance within = faces.between(page.all, page.all);
  const WideConductance inner{hn::Set(kWide, hn::GetLane(within.g)), hn::Set(kWide, hn::GetLane(within.share))};

  // What flows through the sides.
  const auto through = [&]<int kFace>() HWY_ATTR __attribute__((always_inline)) {
    if (flows.known >> kFace & 1) return;
    constexpr int kAxis = kFace / 2, kHere = kFace % 2 ? 7 : 0;
    const HeatSource& beyond = sides[kFace];
    int32_t* const into = flows.through[kFace];
    if (beyond.closed) {
      std::memset(into, 0, 64 * sizeof(int32_t));
      return;
    }
    alignas(64) float other[64], gathered[64];
    side_temperatures<kAxis>(beyond, 7 - kHere, other);
    if constexpr (kAxis == 2) gather_side(own_t, kHere, gathered);
    WideConductance c = inner;
    if (!kCoded && (beyond.all.resistance != page.all.resistance || beyond.all.share != page.all.share)) {
      const Conductance across = faces.between(page.all, beyond.all);
      c = {hn::Set(kWide, hn::GetLane(across.g)), hn::Set(kWide, hn::GetLane(across.share))};
    }
    for (int i = 0; i < 64; i += kWideLanes) {
      const int row = i >> 3;
      if constexpr (kCoded) {
        if constexpr (kAxis == 0) c = meet(wide_codes((kHere ? meets.above_x + 56 : meets.below_x) + row));
        if constexpr (kAxis == 1) c = meet(wide_codes((kHere ? meets.last_y : meets.below_y) + row));
        if constexpr (kAxis == 2)
          c = meet(hn::BitCast(kWideInt, hn::Load(kWideCode, (kHere ? meets.last_z : meets.below_z) + i)));
      }
      WV own = hn::Load(kWide, own_t + kHere * 64 + i);
      if constexpr (kAxis == 2) own = hn::Load(kWide, gathered + i);
      if constexpr (kAxis == 1)
        own = hn::BitCast(kWide, load_rows(reinterpret_cast<const int32_t*>(own_t) + row * 64 + kHere * 8, 64));
      const WV there = hn::Load(kWide, other + i);
      hn::Store(kHere ? wide_flow_between(own, there, c, phase) : wide_flow_between(there, own, c, phase), kWideInt,
                into + i);
    }
  };
  through.template operator()<0>(), through.template operator()<1>(), through.template operator()<2>();
  through.template operator()<3>(), through.template operator()<4>(), through.template operator()<5>();

  // Every face within the page once.
  constexpr int kPieces = 8 / kRows;
  const auto or_own = [&](const int32_t* from) { return from ? from : reinterpret_cast<const int32_t*>(own_t); };
  const int32_t *next_own = or_own(ahead.own), *next_high_x = or_own(ahead.high_x), *next_high_y = or_own(ahead.high_y);
  const int32_t *high_x = flows.through[1], *high_y = flows.through[3], *low_y = flows.through[2];
  const int32_t *low_z = flows.through[4], *high_z = flows.through[5];
  alignas(64) int32_t behind[64];
  for (int i = 0; i < 64; i += kWideLanes) hn::Store(hn::Load(kWideInt, flows.through[0] + i), kWideInt, behind + i);
  world::LeafMask changed;
  for (int x = 0; x < 8; ++x) {
    WI last_above_y = rows_of(low_y + x * 8);
    uint64_t word = 0;
    if (x % 2 == 0) __builtin_prefetch(next_high_x + x * 8);
    __builtin_prefetch(next_high_y + x * 64);
    if constexpr (kCoded)
      for (const ThermalKinds* beside : {ahead.own_kinds, ahead.high_x_kinds, ahead.high_y_kinds})
        if (beside) __builtin_prefetch(reinterpret_cast<const char*>(beside) + x * 64);
    for (int piece = 0; piece < kPieces; ++piece) {
      const int i = x * 64 + piece * kWideLanes, row = i >> 3;
      if (kRows == 2 || piece % 2 == 0) __builtin_prefetch(next_own + i, 1);
      const WV own = hn::Load(kWide, own_t + i);
      WideConductance c_x = inner, c_y = inner, c_z = inner;
      if constexpr (kCoded)
        c_x = meet(wide_codes(meets.above_x + row)), c_y = meet(wide_codes(meets.above_y + row)),
        c_z = meet(wide_codes(meets.above_z + row));
      const WI above_x = x == 7 ? hn::Load(kWideInt, high_x + piece * kWideLanes)
                                : wide_flow_between(own, hn::Load(kWide, own_t + i + 64), c_x, phase);
      WI above_y = wide_flow_between(own, hn::LoadU(kWide, own_t + i + 8), c_y, phase);
      if (piece == kPieces - 1) above_y = with_last_row(above_y, high_y + x * 8);
      const WI above_z =
          with_row_ends(wide_flow_between(own, hn::LoadU(kWide, own_t + i + 1), c_z, phase), high_z + row);
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
