#include "sim/matter/heat_kernel.h"

#include "world/space/coords.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/matter/heat_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A row of a leaf along z at most.
using Row = hn::CappedTag<float, 8>;
using IntRow = hn::RebindToSigned<Row>;
constexpr Row kRow;
constexpr IntRow kIntRow;
using V = hn::Vec<Row>;
using I = hn::Vec<IntRow>;
constexpr size_t kLanes = hn::MaxLanes(kRow);

/// 10^3 values: a leaf and one layer around it, rows of 16 floats of which 3..12 are used.
constexpr int kPitch = 16, kPlane = 10 * kPitch;
constexpr int at(int x, int y, int z) { return (x + 1) * kPlane + (y + 1) * kPitch + 4 + z; }
struct alignas(64) Padded {
  float value[10 * kPlane];
};
constexpr int kStep[6] = {-kPlane, kPlane, -kPitch, kPitch, -1, 1};
static_assert(world::kFaceNegX == 0 && world::kFacePosX == 1 && world::kFaceNegY == 2 && world::kFacePosY == 3 &&
              world::kFaceNegZ == 4 && world::kFacePosZ == 5);

HWY_INLINE float one_temperature(const HeatSource& s, int i) {
  if (s.temperature) return s.temperature[i];
  const int32_t heat = s.heat ? s.heat[i] : 0;
  if (!s.arrays) return temperature(s.all, heat);
  const ThermalArrays& a = *s.arrays;
  return temperature({a.inverse[i], a.born[i], a.low[i], a.high[i], 0, 0}, heat);
}

/// Eight temperatures from index i on, a multiple of 8.
HWY_INLINE void row_of(const HeatSource& s, int i, float* into) {
  for (size_t k = 0; k < 8; k += kLanes) {
    const auto n = static_cast<size_t>(i) + k;
    V t;
    if (s.temperature) {
      t = hn::LoadU(kRow, s.temperature + n);
    } else {
      const V heat = s.heat ? hn::ConvertTo(kRow, hn::LoadU(kIntRow, s.heat + n)) : hn::Zero(kRow);
      if (const ThermalArrays* a = s.arrays) {
        t = hn::Add(hn::Mul(heat, hn::Load(kRow, a->inverse + n)), hn::Load(kRow, a->born + n));
        t = hn::Min(hn::Max(t, hn::Load(kRow, a->low + n)), hn::Load(kRow, a->high + n));
      } else {
        t = hn::Add(hn::Mul(heat, hn::Set(kRow, s.all.inverse)), hn::Set(kRow, s.all.born));
        t = hn::Min(hn::Max(t, hn::Set(kRow, s.all.low)), hn::Set(kRow, s.all.high));
      }
    }
    hn::StoreU(t, kRow, into + k);
  }
}

template <class Visit>
HWY_INLINE void for_each_row(Visit visit) {
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) visit(x, y);
}

template <class RowOf, class OneOf>
HWY_INLINE void fill(const HeatSource& page, const HeatSource* sides, Padded& into, RowOf row, OneOf one) {
  for_each_row([&](int x, int y) { row(page, x * 64 + y * 8, into.value + at(x, y, 0)); });
  // Across a closed side it is as warm as here: nothing flows.
  for (int face = 0; face < 2; ++face) {
    const HeatSource& s = sides[face];
    const int own = face == 0 ? 0 : 7, there = s.closed ? own : 7 - own, out = face == 0 ? -1 : 8;
    for (int y = 0; y < 8; ++y) row(s.closed ? page : s, there * 64 + y * 8, into.value + at(out, y, 0));
  }
  for (int face = 2; face < 4; ++face) {
    const HeatSource& s = sides[face];
    const int own = face == 2 ? 0 : 7, there = s.closed ? own : 7 - own, out = face == 2 ? -1 : 8;
    for (int x = 0; x < 8; ++x) row(s.closed ? page : s, x * 64 + there * 8, into.value + at(x, out, 0));
  }
  for (int face = 4; face < 6; ++face) {
    const HeatSource& s = sides[face];
    const int own = face == 4 ? 0 : 7, there = s.closed ? own : 7 - own, out = face == 4 ? -1 : 8;
    for_each_row([&](int x, int y) { into.value[at(x, y, out)] = one(s.closed ? page : s, x * 64 + y * 8 + there); });
  }
}

HWY_INLINE void fill_temperatures(const HeatSource& page, const HeatSource* sides, Padded& t) {
  // Not by their names: as pointers they wouldn't be inlined, and cost as much as the rest.
  fill(
      page, sides, t, [](const HeatSource& s, int i, float* into) { row_of(s, i, into); },
      [](const HeatSource& s, int i) { return one_temperature(s, i); });
}
HWY_INLINE void fill_materials(const HeatSource& page, const HeatSource* sides, Padded& resistance, Padded& share) {
  const auto filler = [](float ThermalVoxel::*all, const float* (*array)(const ThermalArrays&)) {
    return std::pair{[=](const HeatSource& s, int i, float* into) {
                       for (int k = 0; k < 8; ++k) into[k] = s.arrays ? array(*s.arrays)[i + k] : s.all.*all;
                     },
                     [=](const HeatSource& s, int i) { return s.arrays ? array(*s.arrays)[i] : s.all.*all; }};
  };
  const auto r = filler(&ThermalVoxel::resistance, [](const ThermalArrays& a) { return +a.resistance; });
  const auto c = filler(&ThermalVoxel::share, [](const ThermalArrays& a) { return +a.share; });
  fill(page, sides, resistance, r.first, r.second);
  fill(page, sides, share, c.first, c.second);
}

bool one_material(const HeatSource& page, const HeatSource* sides) {
  if (page.arrays) return false;
  for (int f = 0; f < 6; ++f)
    if (!sides[f].closed &&
        (sides[f].arrays || sides[f].all.resistance != page.all.resistance || sides[f].all.share != page.all.share))
      return false;
  return true;
}

struct Face {
  V difference, conductance, share;
};
template <bool kOne>
HWY_INLINE Face face_of(const HeatSource& page, const HeatStep& step, const Padded& t, const Padded* resistance,
                        const Padded* share, int n, int face) {
  const int m = n + kStep[face];
  const V own = hn::LoadU(kRow, t.value + n), other = hn::LoadU(kRow, t.value + m);
  const V scale = hn::Set(kRow, step.scale), one = hn::Set(kRow, 1.0f), limit = hn::Set(kRow, step.limit);
  Face f;
  f.difference = hn::Sub(other, own);
  if constexpr (kOne) {
    const V r = hn::Set(kRow, page.all.resistance);
    f.conductance = hn::Mul(hn::Div(one, hn::Add(r, r)), scale);
    f.share = hn::Mul(hn::Set(kRow, page.all.share), limit);
  } else {
    const V r = hn::Add(hn::LoadU(kRow, resistance->value + n), hn::LoadU(kRow, resistance->value + m));
    f.conductance = hn::Mul(hn::Div(one, r), scale);
    f.share = hn::Mul(hn::Min(hn::LoadU(kRow, share->value + n), hn::LoadU(kRow, share->value + m)), limit);
  }
  return f;
}

template <bool kOne, bool kLive>
HWY_INLINE HeatResult conduct_rows(const HeatSource& page, const HeatStep& step, const Padded& t, const Padded* res,
                                   const Padded* share, int32_t* heat) {
  const V phase = hn::Set(kRow, step.phase), last = hn::Set(kRow, 63.0f / 64.0f);
  const Face whole = kOne ? face_of<kOne>(page, step, t, res, share, at(0, 0, 0), 0) : Face{};
  HeatResult result;
  I flowed = hn::Zero(kIntRow);
  V most = hn::Zero(kRow);
  for_each_row([&](int x, int y) {
    for (int z = 0; z < 8; z += static_cast<int>(kLanes)) {
      const int n = at(x, y, z);
      const auto i = static_cast<size_t>(x * 64 + y * 8 + z);
      const I before = page.heat ? hn::LoadU(kIntRow, page.heat + i) : hn::Zero(kIntRow);
      I sum = before;
      const V own = hn::LoadU(kRow, t.value + n);
      for (int face = 0; face < 6; ++face) {
        Face f;
        if constexpr (kOne) {
          f = whole;
          f.difference = hn::Sub(hn::LoadU(kRow, t.value + n + kStep[face]), own);
        } else {
          f = face_of<kOne>(page, step, t, res, share, n, face);
        }
        const V size = hn::Abs(f.difference), wanted = hn::Mul(size, f.conductance), allowed = hn::Mul(size, f.share);
        const I flow =
            hn::ConvertTo(kIntRow, hn::CopySignToAbs(hn::Min(hn::Add(wanted, phase), allowed), f.difference));
        if constexpr (kLive) most = hn::Max(most, hn::Min(hn::Add(wanted, last), allowed));
        sum = hn::Add(sum, flow);
        flowed = hn::Or(flowed, flow);
      }
      hn::StoreU(sum, kIntRow, heat + i);
      uint8_t bits[8] = {};
      hn::StoreMaskBits(kIntRow, hn::Ne(sum, before), bits);
      result.changed.word[x] |= static_cast<uint64_t>(bits[0]) << (y * 8 + z);
    }
  });
  result.flows = !hn::AllTrue(kIntRow, hn::Eq(flowed, hn::Zero(kIntRow)));
  result.live = result.flows || (kLive && !hn::AllTrue(kRow, hn::Lt(most, hn::Set(kRow, 1.0f))));
  return result;
}

/// Whether something may flow in another phase is asked only where nothing does in this one.
template <bool kOne>
HWY_INLINE HeatResult conduct_page(const HeatSource& page, const HeatStep& step, const Padded& t, const Padded* res,
                                   const Padded* share, int32_t* heat) {
  const HeatResult result = conduct_rows<kOne, false>(page, step, t, res, share, heat);
  return result.flows ? result : conduct_rows<kOne, true>(page, step, t, res, share, heat);
}

HeatResult Conduct(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat) {
  Padded t;
  fill_temperatures(page, sides, t);
  if (one_material(page, sides)) return conduct_page<true>(page, step, t, nullptr, nullptr, heat);
  Padded resistance, share;
  fill_materials(page, sides, resistance, share);
  return conduct_page<false>(page, step, t, &resistance, &share, heat);
}

void Temperatures(const HeatSource& page, float* into) {
  for (int i = 0; i < world::kLeafVoxels; i += 8) row_of(page, i, into + i);
}

void Relax(const HeatSource& page, const HeatSource* sides, const HeatStep& step, const float* old, const float* before,
           float weight, float* into) {
  Padded t, resistance, share;
  fill_temperatures(page, sides, t);
  fill_materials(page, sides, resistance, share);
  // share is a sixth of the capacity.
  const V six = hn::Set(kRow, 6.0f), scale = hn::Set(kRow, step.scale), w = hn::Set(kRow, weight);
  for_each_row([&](int x, int y) {
    for (int z = 0; z < 8; z += static_cast<int>(kLanes)) {
      const int n = at(x, y, z);
      const auto i = static_cast<size_t>(x * 64 + y * 8 + z);
      const V r = hn::LoadU(kRow, resistance.value + n);
      const V capacity = hn::Mul(hn::LoadU(kRow, share.value + n), six);
      V up = hn::Mul(capacity, hn::LoadU(kRow, old + i)), down = capacity;
      for (int face = 0; face < 6; ++face) {
        const V g = hn::Mul(
            hn::Div(hn::Set(kRow, 1.0f), hn::Add(r, hn::LoadU(kRow, resistance.value + n + kStep[face]))), scale);
        up = hn::Add(up, hn::Mul(g, hn::LoadU(kRow, t.value + n + kStep[face])));
        down = hn::Add(down, g);
      }
      const V b = hn::LoadU(kRow, before + i);
      hn::StoreU(hn::Add(hn::Mul(w, hn::Sub(hn::Div(up, down), b)), b), kRow, into + i);
    }
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

HWY_EXPORT(Conduct);
HWY_EXPORT(Temperatures);
HWY_EXPORT(Relax);

HeatResult conduct(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat) {
  return HWY_DYNAMIC_DISPATCH(Conduct)(page, sides, step, heat);
}
void temperatures(const HeatSource& page, float* into) { HWY_DYNAMIC_DISPATCH(Temperatures)(page, into); }
void relax(const HeatSource& page, const HeatSource* sides, const HeatStep& step, const float* old, const float* before,
           float weight, float* into) {
  HWY_DYNAMIC_DISPATCH(Relax)(page, sides, step, old, before, weight, into);
}

bool side_is_live(const HeatSource& page, const HeatSource& beyond, int face, const HeatStep& step) {
  if (page.closed || beyond.closed) return false;
  const int axis = world::face_axis(face), own = world::face_sign(face) > 0 ? 7 : 0;
  const auto voxel = [](const HeatSource& s, int i) {
    if (!s.arrays) return s.all;
    const ThermalArrays& a = *s.arrays;
    return ThermalVoxel{a.inverse[i], a.born[i], a.low[i], a.high[i], a.resistance[i], a.share[i]};
  };
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
