#include "sim/matter/gas_kernel.h"

#include <array>
#include <cmath>
#include <cstring>
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/matter/gas_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Part = hn::CappedTag<uint16_t, 64>;  // of the 64 voxels of one x
using Units = hn::Vec<Part>;

// Lanes of the 64 voxels of one x that touch a side.
template <bool kAlongY>
constexpr std::array<uint16_t, 64> TouchingLanes(int at) {
  std::array<uint16_t, 64> lanes{};
  for (int i = 0; i < 64; ++i) lanes[static_cast<size_t>(i)] = (kAlongY ? i >> 3 : i & 7) == at ? 0xffff : 0;
  return lanes;
}
alignas(64) constexpr std::array<uint16_t, 64> kTouching[4] = {TouchingLanes<true>(0), TouchingLanes<true>(7),
                                                               TouchingLanes<false>(0), TouchingLanes<false>(7)};

HWY_INLINE Units Diffusion(Units difference, Units pressure) {
  const Part d;
  const auto rounded = hn::SaturatedAdd(difference, hn::Set(d, uint16_t{31}));
  const auto wanted = hn::Add(hn::ShiftRight<5>(rounded), hn::ShiftRight<4>(pressure));
  const auto below = hn::SaturatedSub(difference, hn::Set(d, uint16_t{1}));
  return hn::Min(wanted, hn::MulHigh(below, hn::Set(d, uint16_t{10923})));
}

/// What goes from a to b, and what comes; b is a where nothing can cross.
HWY_INLINE void FlowEvenly(Units a, Units b, Units& out, Units& in) {
  const Part d;
  const auto full = hn::Set(d, static_cast<uint16_t>(kFullVoxel));
  const auto more = hn::SaturatedSub(a, b), less = hn::SaturatedSub(b, a);
  const auto beyond_a = hn::SaturatedSub(a, full), beyond_b = hn::SaturatedSub(b, full);
  const auto pressure = hn::Or(hn::SaturatedSub(beyond_a, beyond_b), hn::SaturatedSub(beyond_b, beyond_a));
  const auto units = Diffusion(hn::Or(more, less), pressure);
  out = hn::Min(units, more);
  in = hn::Min(units, less);
}

/// What goes from a source to where its gas tends to, and what comes back.
HWY_INLINE void FlowAlong(Units source, Units target, Units share, Units& out, Units& back) {
  const Part d;
  const auto full = hn::Set(d, static_cast<uint16_t>(kFullVoxel)), one = hn::Set(d, uint16_t{1});
  const auto more = hn::SaturatedSub(source, target), less = hn::SaturatedSub(target, source);
  const auto beyond_s = hn::SaturatedSub(source, full), beyond_t = hn::SaturatedSub(target, full);
  const auto high = hn::SaturatedSub(beyond_s, beyond_t), low = hn::SaturatedSub(beyond_t, beyond_s);
  const auto room = hn::ShiftLeft<4>(hn::SaturatedSub(hn::Sub(full, one), target));
  const auto drift = hn::MulHigh(hn::MulHigh(source, room), share);
  const auto still = hn::Eq(drift, hn::Zero(d));
  const auto even = Diffusion(hn::Or(more, less), hn::Or(high, low));
  const auto on = hn::Add(drift, hn::Add(hn::ShiftRight<5>(more), hn::ShiftRight<4>(high)));
  const auto off = hn::Add(hn::ShiftRight<5>(less), hn::ShiftRight<4>(low));
  out = hn::IfThenElse(still, hn::Min(even, more), hn::SaturatedSub(hn::SaturatedSub(on, off), one));
  back = hn::IfThenElse(still, hn::Min(even, less), hn::SaturatedSub(hn::SaturatedSub(off, on), one));
}

GasFlow FlowGas(const GasView& view, const GasNature& nature, uint16_t* HWY_RESTRICT next) {
  const Part d;
  const size_t lanes = hn::Lanes(d);
  const auto zero = hn::Zero(d), one = hn::Set(d, uint16_t{1}), no_gas = hn::Set(d, kNoGas),
             share = hn::Set(d, nature.share), thins = hn::Set(d, nature.thins_of);
  const auto thin = hn::Set(d, static_cast<uint16_t>(kThinGas));
  auto any = zero;
  GasFlow flow;
  for (int x = 0; x < 8; ++x) {
    const uint16_t* own = view.own + x * 64;
    alignas(64) uint16_t shifted[4][64];  // the voxels across the faces of y and z
    std::memcpy(shifted[0], view.beside[world::kFaceNegY] + x * 8, 8 * sizeof(uint16_t));
    std::memcpy(shifted[0] + 8, own, 56 * sizeof(uint16_t));
    std::memcpy(shifted[1], own + 8, 56 * sizeof(uint16_t));
    std::memcpy(shifted[1] + 56, view.beside[world::kFacePosY] + x * 8, 8 * sizeof(uint16_t));
    std::memcpy(shifted[2] + 1, own, 63 * sizeof(uint16_t));
    std::memcpy(shifted[3], own + 1, 63 * sizeof(uint16_t));
    for (int y = 0; y < 8; ++y) {
      shifted[2][y * 8] = view.beside[world::kFaceNegZ][x * 8 + y];
      shifted[3][y * 8 + 7] = view.beside[world::kFacePosZ][x * 8 + y];
    }
    const uint16_t* across[6] = {x > 0 ? own - 64 : view.beside[world::kFaceNegX],
                                 x < 7 ? own + 64 : view.beside[world::kFacePosX],
                                 shifted[0],
                                 shifted[1],
                                 shifted[2],
                                 shifted[3]};
    auto lost = zero;
    for (size_t at = 0; at < 64; at += lanes) {
      const auto a = hn::LoadU(d, own + at);
      const auto is_wall = hn::Eq(a, no_gas);
      auto now = a, out = zero, in = zero;
      const auto take = [&](int face, Units goes, Units comes) {
        now = hn::Add(hn::Sub(now, goes), comes);
        const auto crosses = hn::Or(goes, comes);
        any = hn::Or(any, crosses);
        // Who is beside the page has to look too.
        if (face < 2 && x != (face == world::kFaceNegX ? 0 : 7)) return;
        const auto touching = face < 2 ? crosses : hn::And(crosses, hn::LoadU(d, kTouching[face - 2].data() + at));
        flow.reaches |= static_cast<uint32_t>(!hn::AllTrue(d, hn::Eq(touching, zero))) << face;
      };
      const auto flow_to_side = [&](auto face) {
        const auto beside = hn::LoadU(d, across[face] + at);
        const auto b = hn::IfThenElse(hn::Or(is_wall, hn::Eq(beside, no_gas)), a, beside);
        FlowEvenly(a, b, out, in);
        take(face, out, in);
      };
      flow_to_side(std::integral_constant<int, world::kFaceNegX>{});
      flow_to_side(std::integral_constant<int, world::kFacePosX>{});
      flow_to_side(std::integral_constant<int, world::kFaceNegZ>{});
      flow_to_side(std::integral_constant<int, world::kFacePosZ>{});
      const int ahead = nature.rises ? world::kFacePosY : world::kFaceNegY, behind = world::opposite_face(ahead);
      const auto target = hn::LoadU(d, across[ahead] + at), source = hn::LoadU(d, across[behind] + at);
      const auto stops = hn::Or(is_wall, hn::Eq(target, no_gas)), starts = hn::Or(is_wall, hn::Eq(source, no_gas));
      FlowAlong(a, target, share, out, in);
      take(ahead, hn::IfThenZeroElse(stops, out), hn::IfThenZeroElse(stops, in));
      FlowAlong(source, a, share, in, out);
      take(behind, hn::IfThenZeroElse(starts, out), hn::IfThenZeroElse(starts, in));
      if (nature.thins_of != 0) {
        const auto goes = hn::Min(now, hn::Add(hn::MulHigh(now, thins), one));
        const auto gone = hn::IfThenElseZero(hn::Lt(now, thin), goes);
        now = hn::Sub(now, gone);
        lost = hn::Add(lost, gone);
      }
      hn::StoreU(now, d, next + x * 64 + at);
    }
    if (!hn::AllTrue(d, hn::Eq(lost, zero))) {
      uint16_t by_lane[64];
      hn::StoreU(lost, d, by_lane);
      for (size_t i = 0; i < lanes; ++i) flow.lost += by_lane[i];
    }
  }
  flow.flows = flow.lost > 0 || !hn::AllTrue(d, hn::Eq(any, zero));
  return flow;
}

void ViewGas(const world::BlockId* blocks, const uint16_t* amounts, world::BlockId gas, uint16_t* HWY_RESTRICT own) {
  const Part d;
  const size_t lanes = hn::Lanes(d);
  const auto is = hn::Set(d, gas), air = hn::Set(d, world::kAir), no_gas = hn::Set(d, kNoGas);
  const auto full = hn::Set(d, static_cast<uint16_t>(kFullVoxel));
  for (size_t at = 0; at < world::kLeafVoxels; at += lanes) {
    const auto id = hn::LoadU(d, blocks + at);
    const auto amount = amounts ? hn::LoadU(d, amounts + at) : full;
    const auto open = hn::IfThenZeroElse(hn::Eq(id, air), no_gas);
    hn::StoreU(hn::IfThenElse(hn::Eq(id, is), amount, open), d, own + at);
  }
}

template <class Mask>
HWY_INLINE uint64_t MaskBits(Mask mask) {
  const Part d;
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  uint64_t bits = 0;
  std::memcpy(&bits, bytes, sizeof bits);
  return hn::Lanes(d) < 64 ? bits & ((uint64_t{1} << hn::Lanes(d)) - 1) : bits;
}

void StoreGas(const uint16_t* own, const uint16_t* next, world::BlockId gas, world::BlockId* HWY_RESTRICT blocks,
              uint16_t* HWY_RESTRICT amounts, world::LeafMask& changed) {
  const Part d;
  const size_t lanes = hn::Lanes(d);
  const auto is = hn::Set(d, gas), air = hn::Set(d, world::kAir), zero = hn::Zero(d);
  for (size_t at = 0; at < world::kLeafVoxels; at += lanes) {
    const auto before = hn::LoadU(d, own + at), after = hn::LoadU(d, next + at);
    const auto other = hn::Ne(before, after);
    if (hn::AllFalse(d, other)) continue;
    const auto id = hn::IfThenElse(hn::Eq(after, zero), air, is);
    hn::StoreU(hn::IfThenElse(other, id, hn::LoadU(d, blocks + at)), d, blocks + at);
    hn::StoreU(hn::IfThenElse(other, after, hn::LoadU(d, amounts + at)), d, amounts + at);
    changed.word[at >> 6] |= MaskBits(other) << (at & 63);
  }
}

void MaskOf(const world::BlockId* ids, world::BlockId block, world::LeafMask& mask) {
  const Part d;
  const size_t lanes = hn::Lanes(d);
  const auto is = hn::Set(d, block);
  for (size_t at = 0; at < world::kLeafVoxels; at += lanes)
    mask.word[at >> 6] |= MaskBits(hn::Eq(hn::LoadU(d, ids + at), is)) << (at & 63);
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

HWY_EXPORT(FlowGas);
HWY_EXPORT(ViewGas);
HWY_EXPORT(StoreGas);
HWY_EXPORT(MaskOf);

GasFlow flow_gas(const GasView& view, const GasNature& nature, uint16_t* next) {
  return HWY_DYNAMIC_DISPATCH(FlowGas)(view, nature, next);
}
void view_gas(const world::BlockId* blocks, const uint16_t* amounts, world::BlockId gas, uint16_t* own) {
  HWY_DYNAMIC_DISPATCH(ViewGas)(blocks, amounts, gas, own);
}
world::LeafMask store_gas(const uint16_t* own, const uint16_t* next, world::BlockId gas, world::BlockId* blocks,
                          uint16_t* amounts) {
  world::LeafMask changed;
  HWY_DYNAMIC_DISPATCH(StoreGas)(own, next, gas, blocks, amounts, changed);
  return changed;
}

world::LeafMask mask_of(const world::BlockId* ids, world::BlockId block) {
  world::LeafMask mask;
  HWY_DYNAMIC_DISPATCH(MaskOf)(ids, block, mask);
  return mask;
}

GasNature gas_nature(double density, double air_density, double thins_per_s, double tick_s) {
  constexpr double kGravity = 9.81, kHeight = 1, kMostShare = 0.25;
  const double speed = std::sqrt(kGravity * kHeight * std::abs(air_density - density) / air_density);
  GasNature nature;
  nature.share = static_cast<uint16_t>(std::min(speed * tick_s / kHeight, kMostShare) * 65536);
  nature.rises = density < air_density;
  nature.thins_of = static_cast<uint16_t>(std::clamp(thins_per_s * tick_s, 0.0, 0.5) * 65536);
  return nature;
}

}  // namespace sim
#endif
