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
using KindRow = hn::Rebind<uint16_t, Row>;
constexpr Row kRow;
constexpr IntRow kIntRow;
constexpr KindRow kKindRow;
using V = hn::Vec<Row>;
using I = hn::Vec<IntRow>;
constexpr size_t kLanes = hn::MaxLanes(kRow);

HWY_INLINE I kinds_at(const uint16_t* kind) { return hn::PromoteTo(kIntRow, hn::LoadU(kKindRow, kind)); }

/// One number of voxels, by their kinds. Made before a loop: the table stays in a register.
class Numbers {
 public:
  HWY_INLINE Numbers(const ThermalKinds& kinds, ThermalField field)
      : few_(kinds.all.size() <= 8), from_(&kinds.all[0].inverse + field), table_(hn::Zero(kRow)) {
    static_assert(sizeof(ThermalVoxel) == 6 * sizeof(float));
    if constexpr (kLanes == 8) table_ = hn::Load(kRow, kinds.few[field]);
  }
  HWY_INLINE V operator()(I kind) const {
    if constexpr (kLanes == 8)
      if (few_) return hn::TableLookupLanes(table_, hn::IndicesFromVec(kRow, kind));
    return hn::GatherIndex(kRow, from_, hn::Mul(kind, hn::Set(kIntRow, 6)));
  }

 private:
  bool few_;
  const float* from_;
  V table_;
};

/// Temperatures of `count` voxels, a multiple of 8, by their heats (null: none) and, in a page that isn't of one
/// material, their kinds. Loops of their own for what is common: a check in each row would cost as much as the rest.
HWY_INLINE void temperatures_of(const HeatSource& s, const int32_t* heat, const uint16_t* kind, int count,
                                float* into) {
  const auto each = [&](auto one) {
    for (int i = 0; i < count; i += static_cast<int>(kLanes)) hn::StoreU(one(i), kRow, into + i);
  };
  const auto heats = [&](int i) { return hn::ConvertTo(kRow, hn::LoadU(kIntRow, heat + i)); };
  if (const ThermalKinds* kinds = s.kinds) {
    const Numbers inverse(*kinds, kInverse), born(*kinds, kBorn), low(*kinds, kLow), high(*kinds, kHigh);
    const auto limited = [&](V t, I k) { return hn::Min(hn::Max(hn::Add(t, born(k)), low(k)), high(k)); };
    if (heat && !kinds->limited)
      each([&](int i) { return hn::Mul(heats(i), inverse(kinds_at(kind + i))); });
    else if (heat)
      each([&](int i) {
        const I k = kinds_at(kind + i);
        return limited(hn::Mul(heats(i), inverse(k)), k);
      });
    else
      each([&](int i) { return limited(hn::Zero(kRow), kinds_at(kind + i)); });
    return;
  }
  const V inverse = hn::Set(kRow, s.all.inverse), born = hn::Set(kRow, s.all.born), low = hn::Set(kRow, s.all.low),
          high = hn::Set(kRow, s.all.high);
  if (heat && !is_limited(s.all))
    each([&](int i) { return hn::Mul(heats(i), inverse); });
  else if (heat)
    each([&](int i) { return hn::Min(hn::Max(hn::Add(hn::Mul(heats(i), inverse), born), low), high); });
  else
    each([&](int) { return hn::Min(hn::Max(born, low), high); });
}

/// Of `count` voxels of a page from index i on, multiples of 8.
HWY_INLINE void page_temperatures(const HeatSource& s, int i, int count, float* into) {
  if (s.temperature)
    std::memcpy(into, s.temperature + i, static_cast<size_t>(count) * sizeof(float));
  else
    temperatures_of(s, s.heat ? s.heat + i : nullptr, s.kinds ? s.kinds->kind + i : nullptr, count, into);
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
