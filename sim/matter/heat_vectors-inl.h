/// Rows of a page of heat as vectors: what heat_kernel.cpp and heat_relax.cpp share, compiled once for each target.
#if defined(SIM_MATTER_HEAT_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_MATTER_HEAT_VECTORS_INL_H
#undef SIM_MATTER_HEAT_VECTORS_INL_H
#else
#define SIM_MATTER_HEAT_VECTORS_INL_H
#endif

#include <cstring>

#include <hwy/highway.h>

#include "sim/matter/heat_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A row of a leaf along z at most.
using Row = hn::CappedTag<float, 8>;
using IntRow = hn::RebindToSigned<Row>;
using CodeRow = hn::RebindToUnsigned<Row>;
using KindRow = hn::Rebind<uint16_t, Row>;
constexpr Row kRow;
constexpr IntRow kIntRow;
constexpr CodeRow kCodeRow;
constexpr KindRow kKindRow;
using V = hn::Vec<Row>;
using I = hn::Vec<IntRow>;
constexpr size_t kLanes = hn::MaxLanes(kRow);

HWY_INLINE I kinds_at(const uint16_t* kind) { return hn::PromoteTo(kIntRow, hn::LoadU(kKindRow, kind)); }

/// The numbers of a coded row's voxels from z on, in the lowest three bits; what lies above them isn't theirs.
HWY_INLINE I codes_in_row(uint32_t row, int z) {
  alignas(32) static constexpr uint32_t kShift[8] = {0, 3, 6, 9, 12, 15, 18, 21};
  return hn::BitCast(kIntRow, hn::Shr(hn::Set(kCodeRow, row), hn::LoadU(kCodeRow, kShift + z)));
}

/// Eight numbers, of which the lowest three bits of a lane name one. Made before a loop: they stay in a register.
class Eight {
 public:
  /// `from`: eight of them, on 32 bytes.
  HWY_INLINE explicit Eight(const float* from) : from_(from), table_(hn::Load(kRow, from)) {}
  HWY_INLINE V operator()(I k) const {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
    return V{_mm256_permutevar8x32_ps(table_.raw, k.raw)};
#else
    return hn::GatherIndex(kRow, from_, hn::And(k, hn::Set(kIntRow, 7)));
#endif
  }

 private:
  const float* from_;
  V table_;
};

/// One number of voxels, by their kinds.
class Numbers {
 public:
  HWY_INLINE Numbers(const ThermalKinds& kinds, ThermalField field)
      : few_(kinds.all.size() <= 8), from_(&kinds.all[0].inverse + field), eight_(kinds.few[field]) {
    static_assert(sizeof(ThermalVoxel) == 6 * sizeof(float));
  }
  HWY_INLINE V operator()(I kind) const {
    if (few_) return eight_(kind);
    return hn::GatherIndex(kRow, from_, hn::Mul(kind, hn::Set(kIntRow, 6)));
  }

 private:
  bool few_;
  const float* from_;
  Eight eight_;
};

/// Calls use(warmth), where warmth(heats, kinds) are temperatures; kinds are asked for in a page that isn't of one
/// material only. Made before a loop: a check in each row would cost as much as the rest.
template <class Use>
HWY_INLINE void with_warmth(const HeatSource& s, Use use) {
  const auto clamp = [](V t, V low, V high) { return hn::Min(hn::Max(t, low), high); };
  const auto number = [](I heat) { return hn::ConvertTo(kRow, heat); };
  if (const ThermalKinds* kinds = s.kinds) {
    const Numbers inverse(*kinds, kInverse), born(*kinds, kBorn), low(*kinds, kLow), high(*kinds, kHigh);
    if (kinds->limited)
      use([&](I heat, auto kind) {
        const I k = kind();
        return clamp(hn::Add(hn::Mul(number(heat), inverse(k)), born(k)), low(k), high(k));
      });
    else
      use([&](I heat, auto kind) { return hn::Mul(number(heat), inverse(kind())); });
    return;
  }
  const V inverse = hn::Set(kRow, s.all.inverse), born = hn::Set(kRow, s.all.born), low = hn::Set(kRow, s.all.low),
          high = hn::Set(kRow, s.all.high);
  if (is_limited(s.all))
    use([&](I heat, auto) { return clamp(hn::Add(hn::Mul(number(heat), inverse), born), low, high); });
  else
    use([&](I heat, auto) { return hn::Mul(number(heat), inverse); });
}

alignas(64) inline constexpr int32_t kNoHeats[world::kLeafVoxels] = {};

/// Temperatures of `count` voxels of a page from index i on, multiples of 8.
HWY_INLINE void page_temperatures(const HeatSource& s, int i, int count, float* into) {
  if (s.temperature) {
    std::memcpy(into, s.temperature + i, static_cast<size_t>(count) * sizeof(float));
    return;
  }
  const int32_t* heat = s.heat ? s.heat : kNoHeats;
  const bool coded = s.kinds && s.kinds->is_coded;
  with_warmth(s, [&](auto warmth) {
    const auto each = [&](auto kind) {
      for (int k = i; k < i + count; k += static_cast<int>(kLanes))
        hn::StoreU(warmth(hn::LoadU(kIntRow, heat + k), [&] { return kind(k); }), kRow, into + k - i);
    };
    if (coded)
      each([&](int k) { return codes_in_row(s.kinds->code_row[k >> 3], k & 7); });
    else
      each([&](int k) { return kinds_at(s.kinds->kind + k); });
  });
}
HWY_INLINE void page_numbers(const HeatSource& s, ThermalField field, int i, int count, float* into) {
  const auto each = [&](auto one) {
    for (int k = 0; k < count; k += static_cast<int>(kLanes)) hn::StoreU(one(i + k), kRow, into + k);
  };
  if (!s.kinds) return each([&](int) { return hn::Set(kRow, (&s.all.inverse)[field]); });
  const Numbers numbers(*s.kinds, field);
  each([&](int k) { return numbers(kinds_at(s.kinds->kind + k)); });
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#endif
