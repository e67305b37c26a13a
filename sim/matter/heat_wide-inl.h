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

/// Numbers of the voxels of kRows rows, `stride` apart, in the lowest three bits.
HWY_INLINE WI wide_codes(const uint32_t* rows, int stride) {
  const __m512i row = _mm512_set_epi32(1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0);
  const __m512i shift = _mm512_set_epi32(21, 18, 15, 12, 9, 6, 3, 0, 21, 18, 15, 12, 9, 6, 3, 0);
  const __m128i two = _mm_insert_epi32(_mm_loadu_si32(rows), static_cast<int>(rows[stride]), 1);
  return WI{_mm512_srlv_epi32(_mm512_permutexvar_epi32(row, _mm512_castsi128_si512(two)), shift)};
}
HWY_INLINE WI wide_codes(const uint32_t* rows) { return wide_codes(rows, 1); }
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

HWY_INLINE WI wide_codes(const uint32_t* rows, int = 1) { return codes_in_row(rows[0], 0); }
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
    if (kinds->limited && kinds->born_alike) {
      const WV all_born = hn::Set(kWide, kinds->few[kBorn][0]), all_low = hn::Set(kWide, kinds->few[kLow][0]);
      use([&](WI heat, auto code) {
        const WI k = code();
        return clamp(hn::Add(hn::Mul(number(heat), inverse(k)), all_born), all_low, high(k));
      });
    } else if (kinds->limited)
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

/// Codes of a side's voxels from i on: the side at layer `at` along the axis.
template <int kAxis>
HWY_INLINE WI side_codes(const uint32_t* rows, int at, int i) {
  const int row = i >> 3;
  if constexpr (kAxis == 0) return wide_codes(rows + at * 8 + row);
  if constexpr (kAxis == 1) return wide_codes(rows + row * 8 + at, 8);
  return hn::BitCast(kWideInt,
                     hn::Shr(hn::LoadU(kWideCode, rows + i), hn::Set(kWideCode, static_cast<uint32_t>(at * 3))));
}

/// How warm the 64 voxels of a page's side are: the side at layer `at` along the axis.
template <int kAxis>
HWY_INLINE void side_temperatures(const HeatSource& s, int at, float* into) {
  const int32_t* heat = s.heat ? s.heat : kNoHeats;
  alignas(64) int32_t gathered[64];
  if (kAxis == 2 && !s.side) gather_side(heat, at, gathered);
  const int32_t* const ready = s.side ? s.side : kAxis == 2 ? gathered : nullptr;
  with_wide_warmth(s, [&](auto warmth) {
    for (int i = 0; i < 64; i += kWideLanes) {
      const int row = i >> 3;
      WI heats;
      if (ready)
        heats = hn::LoadU(kWideInt, ready + i);
      else if (kAxis == 0)
        heats = hn::LoadU(kWideInt, heat + at * 64 + i);
      else
        heats = load_rows(heat + row * 64 + at * 8, 64);
      hn::Store(warmth(heats, [&] { return side_codes<kAxis>(s.kinds->code_row, at, i); }), kWide, into + i);
    }
  });
}

/// Those of the page before: most pages meet what it met, and dividing takes as long as four vectors of flows.
struct KeptMeetings {
  Meetings table;
  Kinds kinds;
  float scale = -1;

  HWY_INLINE void find(const Kinds& now, const Faces<false>& faces, const HeatStep& step) {
    const auto same = [](const float* a, const float* b) { return std::memcmp(a, b, 8 * sizeof(float)) == 0; };
    if (scale == step.scale && same(now.resistance, kinds.resistance) && same(now.share, kinds.share)) return;
    table.find(now, faces);
    kinds = now, scale = step.scale;
  }
};

template <bool kCoded>
HWY_INLINE HeatResult conduct_wide(const HeatSource& page, const HeatSource* sides, const CodedSide* coded,
                                   const Kinds& kinds, const HeatStep& step, int32_t* heat, const HeatFlows& flows,
                                   const HeatAhead& ahead) {
  // Find how warm all is.
  alignas(64) float own_t[kVoxels + kWideLanes];
  alignas(64) int32_t own_code[kCoded ? kVoxels + kWideLanes : 1];
  const int32_t* before = page.heat ? page.heat : kNoHeats;
  const auto or_own = [&](const int32_t* from) { return from ? from : reinterpret_cast<const int32_t*>(own_t); };
  const int32_t *next_own = or_own(ahead.own), *next_high_x = or_own(ahead.high_x), *next_high_y = or_own(ahead.high_y);
  with_wide_warmth(page, [&](auto warmth) {
    for (int i = 0; i < kVoxels; i += kWideLanes)
      hn::Store(warmth(hn::LoadU(kWideInt, before + i),
                       [&] {
                         const WI code = wide_codes(page.kinds->code_row + (i >> 3));
                         hn::Store(code, kWideInt, own_code + i);
                         return code;
                       }),
                kWide, own_t + i);
  });
  if (kCoded && !page.kinds) std::memset(own_code, 0, sizeof own_code);
  hn::Store(hn::Zero(kWide), kWide, own_t + kVoxels);

  // Conductances: of one kind within the page, and one across each side; or by the sums of codes.
  const Faces<false> faces(step);
  const WV phase = hn::Set(kWide, step.phase);
  static thread_local KeptMeetings kept;
  if constexpr (kCoded) kept.find(kinds, faces, step);
  const Meetings& table = kept.table;
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
    const WideEight code_here(coded[kFace].code);
    if (!kCoded && (beyond.all.resistance != page.all.resistance || beyond.all.share != page.all.share)) {
      const Conductance across = faces.between(page.all, beyond.all);
      c = {hn::Set(kWide, hn::GetLane(across.g)), hn::Set(kWide, hn::GetLane(across.share))};
    }
    for (int i = 0; i < 64; i += kWideLanes) {
      const int row = i >> 3;
      if constexpr (kCoded) {
        WI here = hn::Load(kWideInt, own_code + kHere * 64 + i);
        if constexpr (kAxis == 1) here = load_rows(own_code + row * 64 + kHere * 8, 64);
        if constexpr (kAxis == 2)
          here = page.kinds ? side_codes<2>(page.kinds->code_row, kHere, i) : hn::Zero(kWideInt);
        const WI there = beyond.kinds ? side_codes<kAxis>(beyond.kinds->code_row, 7 - kHere, i) : hn::Zero(kWideInt);
        c = meet(hn::Add(here, hn::BitCast(kWideInt, code_here(there))));
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
      if constexpr (kCoded) {
        const WI code = hn::Load(kWideInt, own_code + i);
        const auto sum = [&](int j) HWY_ATTR { return hn::Add(code, hn::LoadU(kWideInt, own_code + j)); };
        if (x < 7) c_x = meet(sum(i + 64));
        c_y = meet(sum(i + 8)), c_z = meet(sum(i + 1));
      }
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
