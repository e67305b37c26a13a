#include <cstring>

#include "sim/matter/heat_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/matter/heat_relax.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "sim/matter/heat_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

/// 10^3 values: a leaf and one layer around it, rows of 16 floats of which 3..12 are used.
constexpr int kPitch = 16, kPlane = 10 * kPitch;
constexpr int at(int x, int y, int z) { return (x + 1) * kPlane + (y + 1) * kPitch + 4 + z; }
struct alignas(64) Padded {
  float value[10 * kPlane];
};
constexpr int kStep[6] = {-kPlane, kPlane, -kPitch, kPitch, -1, 1};
static_assert(world::kFaceNegX == 0 && world::kFacePosX == 1 && world::kFaceNegY == 2 && world::kFacePosY == 3 &&
              world::kFaceNegZ == 4 && world::kFacePosZ == 5);

/// `row` writes eight values of a source from an index on. Across a closed side all is as here: nothing flows.
template <class RowOf>
HWY_INLINE void fill(const HeatSource& page, const HeatSource* sides, Padded& into, RowOf row) {
  for (int k = 0; k < 64; ++k) row(page, k * 8, into.value + at(k >> 3, k & 7, 0));
  for (int face = 0; face < 6; ++face) {
    const HeatSource& s = sides[face].closed ? page : sides[face];
    const int own = face & 1 ? 7 : 0, there = sides[face].closed ? own : 7 - own, out = face & 1 ? 8 : -1;
    for (int k = 0; k < 8; ++k) {
      if (face < 2) row(s, there * 64 + k * 8, into.value + at(out, k, 0));
      if (face == 2 || face == 3) row(s, k * 64 + there * 8, into.value + at(k, out, 0));
      if (face < 4) continue;
      for (int y = 0; y < 8; ++y) {
        float eight[8];
        row(s, k * 64 + y * 8, eight);
        into.value[at(k, y, out)] = eight[there];
      }
    }
  }
}

void Temperatures(const HeatSource& page, float* into) { page_temperatures(page, 0, world::kLeafVoxels, into); }

void Relax(const HeatSource& page, const HeatSource* sides, const HeatStep& step, const float* old, const float* before,
           float weight, float* into) {
  Padded t, resistance, share;
  fill(page, sides, t, [](const HeatSource& s, int i, float* row) { page_temperatures(s, i, 8, row); });
  fill(page, sides, resistance,
       [](const HeatSource& s, int i, float* row) { page_numbers(s, kResistance, i, 8, row); });
  fill(page, sides, share, [](const HeatSource& s, int i, float* row) { page_numbers(s, kShare, i, 8, row); });
  // share is a sixth of the capacity.
  const V six = hn::Set(kRow, 6.0f), scale = hn::Set(kRow, step.scale), w = hn::Set(kRow, weight);
  for (int i = 0; i < world::kLeafVoxels; i += static_cast<int>(kLanes)) {
    const int n = at(i >> 6, i >> 3 & 7, i & 7);
    const V r = hn::LoadU(kRow, resistance.value + n);
    const V capacity = hn::Mul(hn::LoadU(kRow, share.value + n), six);
    V up = hn::Mul(capacity, hn::LoadU(kRow, old + i)), down = capacity;
    for (const int beside : kStep) {
      const V g =
          hn::Mul(hn::Div(hn::Set(kRow, 1.0f), hn::Add(r, hn::LoadU(kRow, resistance.value + n + beside))), scale);
      up = hn::Add(up, hn::Mul(g, hn::LoadU(kRow, t.value + n + beside)));
      down = hn::Add(down, g);
    }
    const V b = hn::LoadU(kRow, before + i);
    hn::StoreU(hn::Add(hn::Mul(w, hn::Sub(hn::Div(up, down), b)), b), kRow, into + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

HWY_EXPORT(Temperatures);
HWY_EXPORT(Relax);

void temperatures(const HeatSource& page, float* into) { HWY_DYNAMIC_DISPATCH(Temperatures)(page, into); }
void relax(const HeatSource& page, const HeatSource* sides, const HeatStep& step, const float* old, const float* before,
           float weight, float* into) {
  HWY_DYNAMIC_DISPATCH(Relax)(page, sides, step, old, before, weight, into);
}

}  // namespace sim
#endif
