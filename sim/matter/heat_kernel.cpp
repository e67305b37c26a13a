#include "sim/matter/heat_kernel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "world/space/coords.h"
#include "world/store/leaf_shifts.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/matter/heat_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "sim/matter/heat_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

constexpr int kVoxels = world::kLeafVoxels, kStep = static_cast<int>(kLanes);
constexpr int kPitch = 16;  // of a row's nine faces along z
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

/// Numbers by voxel of a page; what lies behind the last is read by the last row, and not used.
struct alignas(64) OwnRows {
  float t[kVoxels + 8], resistance[kVoxels + 8], share[kVoxels + 8];
};

template <bool kOne>
HWY_INLINE void read_own(const HeatSource& page, OwnRows& own) {
  page_temperatures(page, 0, kVoxels, own.t);
  if constexpr (!kOne) {
    page_numbers(page, kResistance, 0, kVoxels, own.resistance);
    page_numbers(page, kShare, 0, kVoxels, own.share);
  }
  for (int i = kVoxels; i < kVoxels + 8; ++i) own.t[i] = 0, own.resistance[i] = 1, own.share[i] = 0;
}

/// The 64 values of a side in one piece: those across y are rows, those across z the first or last of each row.
template <int kAxis, class T>
HWY_INLINE const T* gather(const T* from, int at, T* into) {
  if (!from) return nullptr;
  if constexpr (kAxis == 0) return from + at * 64;
  for (int k = 0; kAxis == 1 && k < 8; ++k) std::memcpy(into + k * 8, from + k * 64 + at * 8, 8 * sizeof(T));
  for (int k = 0; kAxis == 2 && k < 64; ++k) into[k] = from[k * 8 + at];
  return into;
}

/// What flows into the page through the 64 faces of one side.
template <int kAxis, bool kOne, bool kLive>
HWY_INLINE void flow_through_side(const HeatSource& page, const HeatSource& beyond, bool high, const OwnRows& own,
                                  Faces<kLive>& faces, int32_t* into) {
  if (beyond.closed) {
    std::memset(into, 0, 64 * sizeof(int32_t));
    return;
  }
  const int here = high ? 7 : 0, there = 7 - here;
  alignas(64) float t[64], resistance[64], share[64], other[64];
  alignas(64) int32_t heat[64];
  alignas(64) uint16_t kind[64];
  const float* own_t = gather<kAxis>(own.t, here, t);
  const float* own_resistance = kOne ? nullptr : gather<kAxis>(own.resistance, here, resistance);
  const float* own_shares = kOne ? nullptr : gather<kAxis>(own.share, here, share);
  const uint16_t* kinds = beyond.kinds ? gather<kAxis>(beyond.kinds->kind, there, kind) : nullptr;
  const float* other_t = gather<kAxis>(beyond.temperature, there, other);
  if (!other_t) {
    temperatures_of(beyond, gather<kAxis>(beyond.heat, there, heat), kinds, 64, other);
    other_t = other;
  }
  const auto each = [&](auto conductance) {
    for (int i = 0; i < 64; i += kStep)
      hn::StoreU(faces.flow(hn::LoadU(kRow, own_t + i), hn::LoadU(kRow, other_t + i), conductance(i)), kIntRow,
                 into + i);
  };
  const V r_page = hn::Set(kRow, page.all.resistance), share_page = hn::Set(kRow, page.all.share);
  const V r_beyond = hn::Set(kRow, beyond.all.resistance), share_beyond = hn::Set(kRow, beyond.all.share);
  const auto own_r = [&](int i) {
    if constexpr (kOne) return r_page;
    return hn::LoadU(kRow, own_resistance + i);
  };
  const auto own_share = [&](int i) {
    if constexpr (kOne) return share_page;
    return hn::LoadU(kRow, own_shares + i);
  };
  if (kinds) {
    const Numbers r(*beyond.kinds, kResistance), capacity(*beyond.kinds, kShare);
    each([&](int i) {
      const I n = kinds_at(kinds + i);
      return faces.between(own_r(i), own_share(i), r(n), capacity(n));
    });
  } else if (kOne) {
    const Conductance all = faces.between(r_page, share_page, r_beyond, share_beyond);
    each([&](int) { return all; });
  } else {
    each([&](int i) { return faces.between(own_r(i), own_share(i), r_beyond, share_beyond); });
  }
}

HWY_INLINE void negate(const int32_t* from, int count, int32_t* into) {
  for (int i = 0; i < count; i += kStep) hn::StoreU(hn::Neg(hn::LoadU(kIntRow, from + i)), kIntRow, into + i);
}

HWY_INLINE uint64_t bits_of(hn::Mask<IntRow> mask) {
  uint8_t bits[8] = {};
  hn::StoreMaskBits(kIntRow, mask, bits);
  return bits[0];
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

/// What isn't there is not asked for.
HWY_INLINE void fetch(const int32_t* from, int offset) {
  if (from) __builtin_prefetch(from + offset);
}

/// Every face once: what flows into one voxel flows out of the other.
template <bool kOne, bool kLive>
HWY_INLINE HeatResult conduct_page(const HeatSource& page, const HeatSource* sides, const HeatStep& step,
                                   const OwnRows& own, int32_t* heat, const HeatAhead& ahead) {
  Faces<kLive> faces(step);
  alignas(64) int32_t side[6][64];
  flow_through_side<0, kOne>(page, sides[0], false, own, faces, side[0]);
  flow_through_side<0, kOne>(page, sides[1], true, own, faces, side[1]);
  flow_through_side<1, kOne>(page, sides[2], false, own, faces, side[2]);
  flow_through_side<1, kOne>(page, sides[3], true, own, faces, side[3]);
  flow_through_side<2, kOne>(page, sides[4], false, own, faces, side[4]);
  flow_through_side<2, kOne>(page, sides[5], true, own, faces, side[5]);

  const Conductance all = faces.between(page.all, page.all);
  const auto between = [&](int i, int j) {
    if constexpr (kOne) return all;
    return faces.between(hn::Load(kRow, own.resistance + i), hn::Load(kRow, own.share + i),
                         hn::LoadU(kRow, own.resistance + j), hn::LoadU(kRow, own.share + j));
  };
  // Faces across z, row by row: nine of a row, the outer two of them found above. In memory, so that shifting them by a
  // voxel is a load.
  alignas(64) int32_t along[64 * kPitch];
  static constexpr float kInner[8] = {1, 1, 1, 1, 1, 1, 1, 0};
  for (int row = 0; row < 64; ++row) {
    if (row % 2 == 0) fetch(ahead.own, row * 8);
    if (row % 16 == 0) fetch(ahead.low_x, 7 * 64 + row);
    if (row % 16 == 1) fetch(ahead.high_x, row);
    if (row % 8 == 0) fetch(ahead.high_y, row * 8);
    for (int z = 0; z < 8; z += kStep) {
      const int i = row * 8 + z;
      const V t = hn::Load(kRow, own.t + i);
      V next = hn::LoadU(kRow, own.t + i + 1);
      if constexpr (kLive)  // The last isn't a face, and mustn't count.
        next = hn::IfThenElse(hn::Gt(hn::LoadU(kRow, kInner + z), hn::Zero(kRow)), next, t);
      hn::StoreU(faces.flow(t, next, between(i, i + 1)), kIntRow, along + row * kPitch + 1 + z);
    }
    along[row * kPitch] = -side[4][row];
    along[row * kPitch + 8] = side[5][row];
  }
  // Faces across y and x are kept from the row and the plane before.
  alignas(64) int32_t behind[64], below[8];
  negate(side[0], 64, behind);
  static constexpr int32_t kNoHeat[kVoxels] = {};
  const int32_t* before = page.heat ? page.heat : kNoHeat;
  world::LeafMask changed;
  for (int x = 0; x < 8; ++x) {
    negate(side[2] + x * 8, 8, below);
    uint64_t word = 0;
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; z += kStep) {
        const int row = x * 8 + y, i = row * 8 + z;
        if (z == 0 && y % 2 == 0 && ahead.into) __builtin_prefetch(ahead.into + i, 1);
        const V t = hn::Load(kRow, own.t + i);
        const I across_x = x == 7 ? hn::LoadU(kIntRow, side[1] + y * 8 + z)
                                  : faces.flow(t, hn::Load(kRow, own.t + i + 64), between(i, i + 64));
        const I across_y = y == 7 ? hn::LoadU(kIntRow, side[3] + x * 8 + z)
                                  : faces.flow(t, hn::Load(kRow, own.t + i + 8), between(i, i + 8));
        const I along_z =
            hn::Sub(hn::LoadU(kIntRow, along + row * kPitch + 1 + z), hn::LoadU(kIntRow, along + row * kPitch + z));
        const I net = hn::Add(hn::Add(hn::Sub(across_x, hn::LoadU(kIntRow, behind + y * 8 + z)),
                                      hn::Sub(across_y, hn::LoadU(kIntRow, below + z))),
                              along_z);
        hn::StoreU(across_x, kIntRow, behind + y * 8 + z);
        hn::StoreU(across_y, kIntRow, below + z);
        hn::StoreU(hn::Add(hn::LoadU(kIntRow, before + i), net), kIntRow, heat + i);
        word |= (bits_of(hn::Ne(net, hn::Zero(kIntRow)))) << (y * 8 + z);
      }
    changed.word[x] = word;
  }
  HeatResult result = result_of(changed);
  if constexpr (kLive) {
    result.flows = !hn::AllTrue(kRow, hn::Lt(faces.now, hn::Set(kRow, 1.0f)));
    result.live = result.flows || !hn::AllTrue(kRow, hn::Lt(faces.ever, hn::Set(kRow, 1.0f)));
  }
  return result;
}

/// Whether page and neighbours are at rest, each of one material, and equally warm.
bool is_even(const HeatSource& page, const HeatSource* sides) {
  const auto even = [](const HeatSource& s) { return !s.heat && !s.temperature && !s.kinds; };
  if (!even(page)) return false;
  const float t = temperature(page.all, 0);
  return std::all_of(sides, sides + 6,
                     [&](const HeatSource& s) { return s.closed || (even(s) && temperature(s.all, 0) == t); });
}

/// Whether something may flow in another phase is asked only where nothing changes in this one.
template <bool kOne>
HWY_INLINE HeatResult conduct_material(const HeatSource& page, const HeatSource* sides, const HeatStep& step,
                                       int32_t* heat, const HeatAhead& ahead) {
  OwnRows own;
  read_own<kOne>(page, own);
  if (step.limit == 1.0f) {
    const HeatResult result = conduct_page<kOne, false>(page, sides, step, own, heat, ahead);
    if (result.flows) return result;
  }
  return conduct_page<kOne, true>(page, sides, step, own, heat, ahead);
}

HeatResult Conduct(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat,
                   const HeatAhead& ahead) {
  if (is_even(page, sides)) return {};
  return page.kinds ? conduct_material<false>(page, sides, step, heat, ahead)
                    : conduct_material<true>(page, sides, step, heat, ahead);
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

HWY_EXPORT(Conduct);

HeatResult conduct(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat,
                   const HeatAhead& ahead) {
  return HWY_DYNAMIC_DISPATCH(Conduct)(page, sides, step, heat, ahead);
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
