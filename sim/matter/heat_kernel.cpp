#include "sim/matter/heat_kernel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <utility>

#include "world/space/coords.h"
#include "world/store/leaf_shifts.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/matter/heat_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "sim/matter/heat_vectors-inl.h"
#include "world/base/wide_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

constexpr int kVoxels = world::kLeafVoxels, kStep = static_cast<int>(kLanes);
constexpr float kLastPhase = 63.0f / 64.0f;
constexpr float kLargestFlow = 2147483520.0f;  // the largest float below 2^31

/// `size` with the sign of `difference`, as an integer. Below 2^31: there ConvertTo costs three instructions more.
HWY_INLINE I flow_of(V size, V difference) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
  return I{_mm256_sign_epi32(_mm256_cvttps_epi32(size.raw), _mm256_castps_si256(difference.raw))};
#else
  return hn::ConvertTo(kIntRow, hn::CopySignToAbs(size, difference));
#endif
}

struct Conductance {
  V g, share;
};

/// What all faces of a page share in a step, and what was found at them. kLive: also what would flow in the last phase,
/// and any limit; without it the limit is 1.
template <bool kLive>
struct Faces {
  V phase, scale, limit;
  V now = hn::Zero(kRow), ever = hn::Zero(kRow);  // the largest flows of this phase, and of the last

  explicit Faces(const HeatStep& step)
      : phase(hn::Set(kRow, step.phase)), scale(hn::Set(kRow, step.scale)), limit(hn::Set(kRow, step.limit)) {}

  HWY_INLINE Conductance between(V r_a, V share_a, V r_b, V share_b) const {
    const V share = hn::Min(share_a, share_b);
    return {hn::Mul(hn::Div(hn::Set(kRow, 1.0f), hn::Add(r_a, r_b)), scale), kLive ? hn::Mul(share, limit) : share};
  }
  HWY_INLINE Conductance between(const ThermalVoxel& a, const ThermalVoxel& b) const {
    return between(hn::Set(kRow, a.resistance), hn::Set(kRow, a.share), hn::Set(kRow, b.resistance),
                   hn::Set(kRow, b.share));
  }
  /// Into the voxel at temperature `own`.
  HWY_INLINE I flow(V own, V other, const Conductance& c) {
    const V difference = hn::Sub(other, own), size = hn::Abs(difference);
    const V wanted = hn::Mul(size, c.g), allowed = hn::Mul(size, c.share);
    V flows = hn::Min(hn::Add(wanted, phase), allowed);
    if constexpr (kLive) {
      flows = hn::Min(flows, hn::Set(kRow, kLargestFlow));
      now = hn::Max(now, flows);
      ever = hn::Max(ever, hn::Min(hn::Add(wanted, hn::Set(kRow, kLastPhase)), allowed));
    }
    return flow_of(flows, difference);
  }
};

/// What the voxels of a page are, to the loops below: all the same, coded, or by numbers of their own.
enum class Content { one, coded, many };

/// Numbers by voxel of a page; what lies behind the last is read by the last row, and not used. Resistances and shares
/// of Content::many.
struct alignas(64) OwnRows {
  float t[kVoxels + 8], resistance[kVoxels + 8], share[kVoxels + 8];
};

template <Content kContent>
HWY_INLINE void read_own(const HeatSource& page, OwnRows& own) {
  page_temperatures(page, 0, kVoxels, own.t);
  if constexpr (kContent == Content::many) {
    page_numbers(page, kResistance, 0, kVoxels, own.resistance);
    page_numbers(page, kShare, 0, kVoxels, own.share);
  }
  for (int i = kVoxels; i < kVoxels + 8; ++i) {
    own.t[i] = 0;
    if constexpr (kContent == Content::many) own.resistance[i] = 1, own.share[i] = 0;
  }
}

constexpr int32_t code_of(int kind) { return kind + kind / 2; }  // 0, 1, 3: as in ThermalKinds

/// The kinds of a coded page and those beside it, as far as they are at most three; for conduction only.
struct Kinds {
  static constexpr int kMost = 3;
  int count = 0;
  alignas(32) float resistance[8] = {1, 1, 1, 1, 1, 1, 1, 1}, share[8] = {};  // the first kMost

  /// Its number, or -1 where there is no room.
  int find_or_add(float r, float s) {
    for (int k = 0; k < count; ++k)
      if (resistance[k] == r && share[k] == s) return k;
    return count == kMost ? -1 : add(r, s);
  }
  int add(float r, float s) {
    resistance[count] = r, share[count] = s;
    return count++;
  }
};

/// What is beyond a side, in codes of the page here.
struct CodedSide {
  bool is_known = false;
  alignas(32) float code[8];  // by their code there; an integer's bits, for a table

  /// Whether all kinds that are there have codes here.
  void find(const HeatSource& page, const HeatSource& beyond, Kinds& kinds) {
    if (beyond.kinds && beyond.kinds == page.kinds) {
      for (int there = 0; there < 4; ++there) code[there] = std::bit_cast<float>(there);
      is_known = true;
      return;
    }
    if (beyond.closed || (beyond.kinds && !beyond.kinds->is_coded)) return;
    const int count = beyond.kinds ? beyond.kinds->count : 1;
    for (int kind = 0; kind < count; ++kind) {
      const int there = code_of(kind);
      const int found = beyond.kinds
                            ? kinds.find_or_add(beyond.kinds->few[kResistance][there], beyond.kinds->few[kShare][there])
                            : kinds.find_or_add(beyond.all.resistance, beyond.all.share);
      if (found < 0) return;
      code[there] = std::bit_cast<float>(code_of(found));
    }
    is_known = true;
  }
};

/// Conductances by the sum of two codes; none for 7.
class Meetings {
 public:
  template <bool kLive>
  HWY_INLINE void find(const Kinds& kinds, const Faces<kLive>& faces) {
    alignas(32) static constexpr int32_t kA[8] = {0, 0, 1, 0, 1, 0, 2, 0}, kB[8] = {0, 1, 1, 2, 2, 0, 2, 0};
    const Eight r(kinds.resistance), share(kinds.share);
    for (int k = 0; k < 8; k += kStep) {
      const I a = hn::Load(kIntRow, kA + k), b = hn::Load(kIntRow, kB + k);
      const Conductance c = faces.between(r(a), share(a), r(b), share(b));
      hn::Store(c.g, kRow, g_ + k);
      hn::Store(c.share, kRow, share_ + k);
    }
    g_[7] = share_[7] = 0;
  }
  const float* g() const { return g_; }
  const float* share() const { return share_; }

 private:
  alignas(32) float g_[8] = {}, share_[8] = {};
};

/// Where the 64 voxels of a side lie, in their order there, by eight: those across x and y in rows.
template <int kAxis>
constexpr int side_row(int at, int k) {
  return kAxis == 0 ? at * 8 + k : k * 8 + at;
}

/// The 64 values of a side across z, the first or last of each row. Moved one by one, they cost as much as the flows.
template <class T>
HWY_INLINE void gather_side(const T* from, int at, T* into) {
#if HWY_TARGET != HWY_SCALAR
  constexpr hn::CappedTag<T, 4> kFour;
  if constexpr (sizeof(T) == 4) {
    // Of half a row the first lane, or the last.
    const T* half = at == 0 ? from : from + 4;
    for (int k = 0; k < 64; k += 4, half += 32) {
      const auto a = hn::LoadU(kFour, half), b = hn::LoadU(kFour, half + 8), c = hn::LoadU(kFour, half + 16),
                 d = hn::LoadU(kFour, half + 24);
      if (at == 0)
        hn::Store(hn::ConcatLowerLower(kFour, hn::InterleaveLower(kFour, c, d), hn::InterleaveLower(kFour, a, b)),
                  kFour, into + k);
      else
        hn::Store(hn::ConcatUpperUpper(kFour, hn::InterleaveUpper(kFour, c, d), hn::InterleaveUpper(kFour, a, b)),
                  kFour, into + k);
    }
    return;
  }
#endif
  for (int k = 0; k < 64; ++k) into[k] = from[k * 8 + at];
}

/// A side's values, by eight.
template <int kAxis, class T>
struct SideValues {
  const T* from;
  int at;
  const T* side;  // where it lies in its order already
  alignas(64) T gathered[kAxis == 2 ? 64 : 1];

  HWY_INLINE SideValues(const T* page, int where, const T* copied = nullptr) : from(page), at(where), side(copied) {
    if constexpr (kAxis == 2) {
      if (page && !side) gather_side(page, where, gathered);
      if (!side) side = gathered;
    }
  }
  /// From the side's value i on.
  HWY_INLINE const T* operator()(int i) const {
    if (kAxis == 2 || side) return side + i;
    return from + side_row<kAxis>(at, i >> 3) * 8 + (i & 7);
  }
};

/// Codes of a side's voxels from i on, in the lowest three bits.
template <int kAxis>
HWY_INLINE I codes_of_side(const uint32_t* rows, int at, int i) {
  if constexpr (kAxis == 2)
    return hn::BitCast(kIntRow,
                       hn::Shr(hn::LoadU(kCodeRow, rows + i), hn::Set(kCodeRow, static_cast<uint32_t>(at * 3))));
  return codes_in_row(rows[side_row<kAxis>(at, i >> 3)], i & 7);
}

/// What flows into the page through the 64 faces of one side.
template <int kAxis, Content kContent, bool kLive>
HWY_INLINE void flow_through_side(const HeatSource& page, const HeatSource& beyond, const CodedSide& coded,
                                  const Meetings& meetings, bool high, const OwnRows& own, Faces<kLive>& faces,
                                  int32_t* into) {
  if (beyond.closed) {
    std::memset(into, 0, 64 * sizeof(int32_t));
    return;
  }
  const int here = high ? 7 : 0, there = 7 - here;
  const SideValues<kAxis, float> own_t(own.t, here);
  // Find how warm it is beyond.
  alignas(64) float other[64];
  const bool beyond_coded = beyond.kinds && beyond.kinds->is_coded;
  const SideValues<kAxis, uint16_t> kinds(beyond.kinds && !beyond_coded ? beyond.kinds->kind : nullptr, there);
  const auto kinds_beyond = [&](int i) {
    return beyond_coded ? codes_of_side<kAxis>(beyond.kinds->code_row, there, i) : kinds_at(kinds(i));
  };
  if (beyond.temperature) {
    const SideValues<kAxis, float> warm(beyond.temperature, there);
    for (int i = 0; i < 64; i += kStep) hn::Store(hn::LoadU(kRow, warm(i)), kRow, other + i);
  } else {
    const SideValues<kAxis, int32_t> heat(beyond.heat ? beyond.heat : kNoHeats, there, beyond.side);
    with_warmth(beyond, [&](auto warmth) {
      for (int i = 0; i < 64; i += kStep)
        hn::Store(warmth(hn::LoadU(kIntRow, heat(i)), [&] { return kinds_beyond(i); }), kRow, other + i);
    });
  }
  const auto each = [&](auto conductance) {
    for (int i = 0; i < 64; i += kStep)
      hn::Store(faces.flow(hn::LoadU(kRow, own_t(i)), hn::Load(kRow, other + i), conductance(i)), kIntRow, into + i);
  };
  const V r_page = hn::Set(kRow, page.all.resistance), share_page = hn::Set(kRow, page.all.share);
  const V r_beyond = hn::Set(kRow, beyond.all.resistance), share_beyond = hn::Set(kRow, beyond.all.share);
  if (kContent == Content::one && !beyond.kinds) {
    const Conductance all = faces.between(r_page, share_page, r_beyond, share_beyond);
    return each([&](int) { return all; });
  }
  if (kContent != Content::many && coded.is_known) {
    const Eight g(meetings.g()), share(meetings.share()), code(coded.code);
    const auto meet = [&](int i) {
      const I k = beyond.kinds ? codes_of_side<kAxis>(beyond.kinds->code_row, there, i) : hn::Zero(kIntRow);
      I sum = hn::BitCast(kIntRow, code(k));
      if constexpr (kContent == Content::coded) sum = hn::Add(sum, codes_of_side<kAxis>(page.kinds->code_row, here, i));
      return Conductance{g(sum), share(sum)};
    };
    return each(meet);
  }
  // Each voxel here has its own numbers, or those of its kind.
  const SideValues<kAxis, float> own_r(kContent == Content::many ? own.resistance : nullptr, here);
  const SideValues<kAxis, float> own_share(kContent == Content::many ? own.share : nullptr, here);
  alignas(32) static constexpr float kNone[8] = {};
  const Eight few_r(kContent == Content::coded ? page.kinds->few[kResistance] : kNone);
  const Eight few_share(kContent == Content::coded ? page.kinds->few[kShare] : kNone);
  const auto with_own = [&](int i, V r, V share) {
    if constexpr (kContent == Content::one) return faces.between(r_page, share_page, r, share);
    if constexpr (kContent == Content::many)
      return faces.between(hn::LoadU(kRow, own_r(i)), hn::LoadU(kRow, own_share(i)), r, share);
    const I k = codes_of_side<kAxis>(page.kinds->code_row, here, i);
    return faces.between(few_r(k), few_share(k), r, share);
  };
  if (!beyond.kinds) return each([&](int i) { return with_own(i, r_beyond, share_beyond); });
  const Numbers r(*beyond.kinds, kResistance), capacity(*beyond.kinds, kShare);
  each([&](int i) {
    const I n = kinds_beyond(i);
    return with_own(i, r(n), capacity(n));
  });
}

HWY_INLINE void negate(const int32_t* from, int count, int32_t* into) {
  for (int i = 0; i < count; i += kStep) hn::StoreU(hn::Neg(hn::LoadU(kIntRow, from + i)), kIntRow, into + i);
}

/// Bit k: lane k isn't 0.
HWY_INLINE uint64_t bits_not_zero(I v) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
  const __m256i zero = _mm256_cmpeq_epi32(v.raw, _mm256_setzero_si256());
  return static_cast<uint64_t>(~_mm256_movemask_ps(_mm256_castsi256_ps(zero)) & 0xff);
#else
  uint8_t bits[8] = {};
  hn::StoreMaskBits(kIntRow, hn::Ne(v, hn::Zero(kIntRow)), bits);
  return bits[0];
#endif
}

/// Lane k of what it returns is lane k - 1 of v, and lane 0 the last.
HWY_INLINE I turned(I v) {
  alignas(32) static constexpr int32_t kBefore[2][8] = {{7, 0, 1, 2, 3, 4, 5, 6}, {3, 0, 1, 2}};
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
  return I{_mm256_permutevar8x32_epi32(v.raw, hn::Load(kIntRow, kBefore[0]).raw)};
#else
  if constexpr (kLanes == 1) return v;
  return hn::TableLookupLanes(v, hn::SetTableIndices(kIntRow, kBefore[kLanes == 8 ? 0 : 1]));
#endif
}
HWY_INLINE I with_first(I v, I first) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
  return I{_mm256_blend_epi32(v.raw, first.raw, 1)};
#else
  return hn::IfThenElse(hn::FirstN(kIntRow, 1), first, v);
#endif
}
HWY_INLINE I with_last(I v, I last) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
  return I{_mm256_blend_epi32(v.raw, last.raw, 0x80)};
#else
  return hn::IfThenElse(hn::FirstN(kIntRow, kLanes - 1), v, last);
#endif
}

/// Which sides of the page something changed at, and how much.
HeatResult result_of(const world::LeafMask& changed) {
  uint64_t all = 0;
  int count = 0;
  for (const uint64_t word : changed.word) all |= word, count += std::popcount(word);
  const bool sides[6] = {changed.word[0] != 0,
                         changed.word[7] != 0,
                         (all & world::kFirstYMask) != 0,
                         (all & world::kFirstYMask << 56) != 0,
                         (all & world::kFirstZMask) != 0,
                         (all & world::kFirstZMask << 7) != 0};
  HeatResult result;
  result.changed = static_cast<uint16_t>(count);
  for (int f = 0; f < 6; ++f) result.sides_changed = static_cast<uint8_t>(result.sides_changed | (sides[f] << f));
  result.flows = result.live = count > 0;
  return result;
}

/// Sums of the codes of neighbours within a page, in rows; where the neighbour is beyond a side, they mean nothing.
struct alignas(64) MeetingRows {
  uint32_t across_x[64], across_y[64], across_z[64];

  HWY_INLINE void find(const uint32_t* rows) {
    for (int k = 0; k < 64; ++k) across_z[k] = rows[k] + (rows[k] >> 3);
    for (int k = 0; k < 56; ++k) across_x[k] = rows[k] + rows[k + 8];
    for (int k = 0; k < 63; ++k) across_y[k] = rows[k] + rows[k + 1];
  }
};

/// Every face once: what flows into one voxel flows out of the other.
template <Content kContent, bool kLive>
HWY_INLINE HeatResult conduct_page(const HeatSource& page, const HeatSource* sides, const CodedSide* coded,
                                   const Kinds& kinds, const HeatStep& step, const OwnRows& own, int32_t* heat,
                                   const HeatFlows& flows, const HeatAhead& ahead) {
  Faces<kLive> faces(step);
  Meetings meetings;
  if (kContent == Content::coded || kinds.count > 1) meetings.find(kinds, faces);
  const int32_t* const side[6] = {flows.through[0], flows.through[1], flows.through[2],
                                  flows.through[3], flows.through[4], flows.through[5]};
  const auto through = [&]<int kAxis>(int face) {
    if (flows.known >> face & 1) return;
    int32_t* const into = flows.through[face];
    flow_through_side<kAxis, kContent>(page, sides[face], coded[face], meetings, face & 1, own, faces, into);
    if (face % 2 == 0) negate(into, 64, into);
  };
  through.template operator()<0>(0), through.template operator()<0>(1);
  through.template operator()<1>(2), through.template operator()<1>(3);
  through.template operator()<2>(4), through.template operator()<2>(5);

  // Between the voxel i, in a row, and the voxel j.
  const Conductance all = faces.between(page.all, page.all);
  MeetingRows meets;
  if constexpr (kContent == Content::coded) meets.find(page.kinds->code_row);
  const Eight g(meetings.g()), share(meetings.share());
  const auto between = [&](const uint32_t* codes, int i, int j) {
    if constexpr (kContent == Content::one) return all;
    if constexpr (kContent == Content::many)
      return faces.between(hn::Load(kRow, own.resistance + i), hn::Load(kRow, own.share + i),
                           hn::LoadU(kRow, own.resistance + j), hn::LoadU(kRow, own.share + j));
    const I sum = codes_in_row(codes[i >> 3], i & 7);
    return Conductance{g(sum), share(sum)};
  };
  // Faces across y and x are kept from the row and the plane before, those across z from a lane to the next.
  constexpr int kPieces = 8 / kStep;
  alignas(64) int32_t behind[64];
  I below[kPieces];
  std::memcpy(behind, side[0], sizeof behind);
  const int32_t* before = page.heat ? page.heat : kNoHeats;
  // What isn't there is not asked for: own numbers are here already.
  const auto or_own = [&](const int32_t* from) { return from ? from : reinterpret_cast<const int32_t*>(own.t); };
  const int32_t *next_own = or_own(ahead.own), *next_high_x = or_own(ahead.high_x), *next_high_y = or_own(ahead.high_y);
  const ThermalKinds* next_kinds[3] = {ahead.own_kinds, ahead.high_x_kinds, ahead.high_y_kinds};
  const auto each_row = [&](int x, auto y, auto is_last_plane, uint64_t& word) __attribute__((always_inline)) {
    const int row = x * 8 + y;
    if (y % 2 == 0) __builtin_prefetch(next_own + row * 8, 1);
    if (y == 1) __builtin_prefetch(next_high_x + x * 8), __builtin_prefetch(next_high_y + x * 64);
    if (y == 5)
      for (const ThermalKinds* beside : next_kinds)
        if (beside) __builtin_prefetch(reinterpret_cast<const char*>(beside) + x * 64);
    I last = hn::Set(kIntRow, side[4][row]);
    for (int piece = 0; piece < kPieces; ++piece) {
      const int z = piece * kStep, i = row * 8 + z;
      const bool ends = piece == kPieces - 1;
      const V t = hn::Load(kRow, own.t + i);
      V next = hn::LoadU(kRow, own.t + i + 1);
      if (kLive && ends)  // The last isn't a face, and mustn't count.
        next = hn::BitCast(kRow, with_last(hn::BitCast(kIntRow, next), hn::BitCast(kIntRow, t)));
      I above_z = faces.flow(t, next, between(meets.across_z, i, i + 1));
      if (ends) above_z = with_last(above_z, hn::Set(kIntRow, side[5][row]));
      const I shifted = turned(above_z);
      const I below_z = with_first(shifted, last);
      last = shifted;
      const I above_x = is_last_plane
                            ? hn::Load(kIntRow, side[1] + y * 8 + z)
                            : faces.flow(t, hn::Load(kRow, own.t + i + 64), between(meets.across_x, i, i + 64));
      const I above_y = y == 7 ? hn::Load(kIntRow, side[3] + x * 8 + z)
                               : faces.flow(t, hn::Load(kRow, own.t + i + 8), between(meets.across_y, i, i + 8));
      const I net =
          hn::Add(hn::Add(hn::Sub(above_x, hn::Load(kIntRow, behind + y * 8 + z)), hn::Sub(above_y, below[piece])),
                  hn::Sub(above_z, below_z));
      hn::Store(above_x, kIntRow, behind + y * 8 + z);
      below[piece] = above_y;
      const I after = hn::Add(hn::LoadU(kIntRow, before + i), net);
      hn::Store(after, kIntRow, heat + i);
      word |= bits_not_zero(net) << (y * 8 + z);
    }
  };
  world::LeafMask changed;
  const auto each_plane = [&](int x, auto is_last_plane) __attribute__((always_inline)) {
    for (int piece = 0; piece < kPieces; ++piece) below[piece] = hn::Load(kIntRow, side[2] + x * 8 + piece * kStep);
    uint64_t word = 0;
    // Rows of what is common are written out: counting them cost a third.
    if constexpr (kLive || kContent == Content::many)
      for (int y = 0; y < 8; ++y) each_row(x, y, is_last_plane, word);
    else
      [&]<int... kY>(std::integer_sequence<int, kY...>) __attribute__((always_inline)) {
        (each_row(x, std::integral_constant<int, kY>(), is_last_plane, word), ...);
      }
    (std::make_integer_sequence<int, 8>());
    changed.word[x] = word;
  };
  for (int x = 0; x < 7; ++x) each_plane(x, std::false_type());
  each_plane(7, std::true_type());
  HeatResult result = result_of(changed);
  if constexpr (kLive) {
    result.flows = !hn::AllTrue(kRow, hn::Lt(faces.now, hn::Set(kRow, 1.0f)));
    result.live = result.flows || !hn::AllTrue(kRow, hn::Lt(faces.ever, hn::Set(kRow, 1.0f)));
  }
  return result;
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#include "sim/matter/heat_wide-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

/// Whether page and neighbours are at rest, each of one material, and equally warm.
bool is_even(const HeatSource& page, const HeatSource* sides) {
  const auto even = [](const HeatSource& s) { return !s.heat && !s.temperature && !s.kinds; };
  if (!even(page)) return false;
  const float t = temperature(page.all, 0);
  return std::all_of(sides, sides + 6,
                     [&](const HeatSource& s) { return s.closed || (even(s) && temperature(s.all, 0) == t); });
}

/// Without kLive: what flows in this phase. With it: whether something may in another.
template <Content kContent, bool kLive>
HWY_INLINE HeatResult conduct_content(const HeatSource& page, const HeatSource* sides, const HeatStep& step,
                                      int32_t* heat, const HeatFlows& flows, const HeatAhead& ahead) {
  Kinds kinds;
  CodedSide coded[6];
  if constexpr (kContent == Content::one) kinds.add(page.all.resistance, page.all.share);
  if constexpr (kContent == Content::coded)
    for (int k = 0; k < page.kinds->count; ++k)
      kinds.add(page.kinds->few[kResistance][code_of(k)], page.kinds->few[kShare][code_of(k)]);
  const auto is_known = [&](int f) { return flows.known >> f & 1; };
  bool any_coded = kContent == Content::coded;
  for (int f = 0; f < 6; ++f) any_coded |= !is_known(f) && sides[f].kinds;
  for (int f = 0; f < 6 && any_coded && kContent != Content::many; ++f)
    if (!is_known(f)) coded[f].find(page, sides[f], kinds);
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
  if (!kLive && kContent != Content::many && !page.temperature) {
    bool all_known = true;
    for (int f = 0; f < 6; ++f) all_known &= is_known(f) || sides[f].closed || coded[f].is_known;
    if (kContent == Content::one && !any_coded)
      return conduct_wide<false>(page, sides, coded, kinds, step, heat, flows, ahead);
    if (all_known) return conduct_wide<true>(page, sides, coded, kinds, step, heat, flows, ahead);
  }
#endif
  OwnRows own;
  read_own<kContent>(page, own);
  return conduct_page<kContent, kLive>(page, sides, coded, kinds, step, own, heat, flows, ahead);
}

template <bool kLive>
HWY_INLINE HeatResult conduct_any(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat,
                                  const HeatFlows& flows, const HeatAhead& ahead) {
  if (is_even(page, sides)) {
    for (int f = 0; f < 6; ++f)
      if (!(flows.known >> f & 1)) std::memset(flows.through[f], 0, 64 * sizeof(int32_t));
    return {};
  }
  if (!page.kinds) return conduct_content<Content::one, kLive>(page, sides, step, heat, flows, ahead);
  return page.kinds->is_coded ? conduct_content<Content::coded, kLive>(page, sides, step, heat, flows, ahead)
                              : conduct_content<Content::many, kLive>(page, sides, step, heat, flows, ahead);
}

HeatResult Conduct(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat,
                   const HeatFlows& flows, const HeatAhead& ahead) {
  const world::HWY_NAMESPACE::WideVectors wide;
  return conduct_any<false>(page, sides, step, heat, flows, ahead);
}
HeatResult ConductLive(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat,
                       const HeatFlows& flows) {
  const world::HWY_NAMESPACE::WideVectors wide;
  return conduct_any<true>(page, sides, step, heat, flows, {});
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

HWY_EXPORT(Conduct);
HWY_EXPORT(ConductLive);

void ThermalKinds::finish() {
  static_assert(offsetof(ThermalKinds, kind) == kHotBytes);
  is_coded = all.size() <= 3;
  count = is_coded ? static_cast<int>(all.size()) : 0;
  if (all.size() == 3) {
    all.push_back(all[2]);
    for (uint16_t& k : kind) k = static_cast<uint16_t>(k + k / 2);
  }
  for (size_t row = 0; is_coded && row < std::size(code_row); ++row) {
    code_row[row] = 0;
    for (size_t z = 0; z < 8; ++z) code_row[row] |= static_cast<uint32_t>(kind[row * 8 + z]) << (z * 3);
  }
  limited = std::any_of(all.begin(), all.end(), is_limited);
  born_alike = std::all_of(all.begin(), all.end(),
                           [&](const ThermalVoxel& v) { return v.born == all[0].born && v.low == all[0].low; });
  for (size_t n = 0; n < std::size(few[0]); ++n) {
    const ThermalVoxel& v = all[std::min(n, all.size() - 1)];
    const float fields[] = {v.inverse, v.born, v.low, v.high, v.resistance, v.share};
    for (size_t f = 0; f < std::size(fields); ++f) few[f][n] = fields[f];
  }
}

HeatResult conduct_in_place(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat,
                            const HeatFlows& flows, const HeatAhead& ahead) {
  HeatResult result = HWY_DYNAMIC_DISPATCH(Conduct)(page, sides, step, heat, flows, ahead);
  if (result.flows) return result;
  // As much may flow out of each voxel as into it.
  HeatFlows all = flows;
  all.known = 0x3f;
  result = HWY_DYNAMIC_DISPATCH(ConductLive)(page, sides, step, heat, all);
  for (const int32_t* side : all.through)
    result.flows |= std::any_of(side, side + 64, [](int32_t n) { return n != 0; });
  result.live |= result.flows;
  return result;
}

namespace {
struct OwnFlows {
  alignas(64) int32_t of[6][64];
  HeatFlows all() { return {.through = {of[0], of[1], of[2], of[3], of[4], of[5]}, .known = 0}; }
};
}  // namespace

/// Whether something may flow in another phase is asked only where nothing changes in this one.
HeatResult conduct(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat) {
  OwnFlows flows;
  if (step.limit == 1.0f) {
    const HeatResult result = HWY_DYNAMIC_DISPATCH(Conduct)(page, sides, step, heat, flows.all(), {});
    if (result.flows) return result;
  }
  return HWY_DYNAMIC_DISPATCH(ConductLive)(page, sides, step, heat, flows.all());
}

bool is_live(const HeatSource& page, const HeatSource* sides, const HeatStep& step) {
  OwnFlows flows;
  alignas(64) int32_t unused[world::kLeafVoxels];
  return HWY_DYNAMIC_DISPATCH(ConductLive)(page, sides, step, unused, flows.all()).live;
}

void copy_side(const int32_t* heat, int face, int32_t* into) {
  const int axis = world::face_axis(face), at = world::face_sign(face) > 0 ? 7 : 0;
  if (!heat) {
    std::memset(into, 0, 64 * sizeof(int32_t));
    return;
  }
  if (axis == 0) std::memcpy(into, heat + at * 64, 64 * sizeof(int32_t));
  for (int k = 0; axis == 1 && k < 8; ++k) std::memcpy(into + k * 8, heat + k * 64 + at * 8, 8 * sizeof(int32_t));
  for (int k = 0; axis == 2 && k < 64; ++k) into[k] = heat[k * 8 + at];
}

bool side_is_live(const HeatSource& page, const HeatSource& beyond, int face, const HeatStep& step) {
  if (page.closed || beyond.closed) return false;
  const int axis = world::face_axis(face), own = world::face_sign(face) > 0 ? 7 : 0;
  const auto voxel = [](const HeatSource& s, int i) { return s.kinds ? s.kinds->all[s.kinds->kind[i]] : s.all; };
  const auto warmth = [](const HeatSource& s, const ThermalVoxel& v, int i) {
    return s.temperature ? s.temperature[i] : temperature(v, s.heat ? s.heat[i] : 0);
  };
  for (int u = 0; u < 8; ++u)
    for (int v = 0; v < 8; ++v) {
      const auto index = [&](int along) {
        return axis == 0 ? along * 64 + u * 8 + v : axis == 1 ? u * 64 + along * 8 + v : u * 64 + v * 8 + along;
      };
      const int i = index(own), j = index(7 - own);
      const ThermalVoxel a = voxel(page, i), b = voxel(beyond, j);
      const float size = std::abs(warmth(beyond, b, j) - warmth(page, a, i));
      const float wanted = size * (1.0f / (a.resistance + b.resistance) * step.scale);
      if (std::min(wanted + 63.0f / 64.0f, size * (std::min(a.share, b.share) * step.limit)) >= 1.0f) return true;
    }
  return false;
}

float heat_phase(uint64_t step) {
  uint32_t reversed = 0;
  for (int b = 0; b < 6; ++b) reversed |= static_cast<uint32_t>(step >> b & 1) << (5 - b);
  return static_cast<float>(reversed) / 64.0f;
}

}  // namespace sim
#endif
