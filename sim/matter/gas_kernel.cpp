#include "sim/matter/gas_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstring>

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

HWY_INLINE Units Diffusion(Units difference, Units pressure) {
  const Part d;
  const auto rounded = hn::SaturatedAdd(difference, hn::Set(d, uint16_t{31}));
  const auto wanted = hn::Add(hn::ShiftRight<5>(rounded), hn::ShiftRight<4>(pressure));
  const auto below = hn::SaturatedSub(difference, hn::Set(d, uint16_t{1}));
  return hn::Min(wanted, hn::MulHigh(below, hn::Set(d, uint16_t{10923})));
}

/// Units that go from a to b, mod 2^16: those that come are negative. None where either is kNoGas.
HWY_INLINE Units FlowEvenly(Units a, Units other) {
  const Part d;
  const auto full = hn::Set(d, static_cast<uint16_t>(kFullVoxel)), no_gas = hn::Set(d, kNoGas);
  const auto b = hn::IfThenElse(hn::Or(hn::Eq(a, no_gas), hn::Eq(other, no_gas)), a, other);
  const auto more = hn::SaturatedSub(a, b), less = hn::SaturatedSub(b, a);
  const auto beyond_a = hn::SaturatedSub(a, full), beyond_b = hn::SaturatedSub(b, full);
  const auto pressure = hn::Or(hn::SaturatedSub(beyond_a, beyond_b), hn::SaturatedSub(beyond_b, beyond_a));
  const auto units = Diffusion(hn::Or(more, less), pressure);
  return hn::Sub(hn::Min(units, more), hn::Min(units, less));
}

/// The same from a source to where its gas tends to.
HWY_INLINE Units FlowAlong(Units source, Units target, Units share) {
  const Part d;
  const auto full = hn::Set(d, static_cast<uint16_t>(kFullVoxel)), one = hn::Set(d, uint16_t{1});
  const auto no_gas = hn::Set(d, kNoGas);
  const auto more = hn::SaturatedSub(source, target), less = hn::SaturatedSub(target, source);
  const auto beyond_s = hn::SaturatedSub(source, full), beyond_t = hn::SaturatedSub(target, full);
  const auto high = hn::SaturatedSub(beyond_s, beyond_t), low = hn::SaturatedSub(beyond_t, beyond_s);
  const auto room = hn::ShiftLeft<4>(hn::SaturatedSub(hn::Sub(full, one), target));
  const auto drift = hn::MulHigh(hn::MulHigh(source, room), share);
  const auto units = Diffusion(hn::Or(more, less), hn::Or(high, low));
  const auto even = hn::Sub(hn::Min(units, more), hn::Min(units, less));
  const auto on = hn::Add(drift, hn::Add(hn::ShiftRight<5>(more), hn::ShiftRight<4>(high)));
  const auto off = hn::Add(hn::ShiftRight<5>(less), hn::ShiftRight<4>(low));
  const auto net =
      hn::Sub(hn::SaturatedSub(hn::SaturatedSub(on, off), one), hn::SaturatedSub(hn::SaturatedSub(off, on), one));
  const auto flow = hn::IfThenElse(hn::Eq(drift, hn::Zero(d)), even, net);
  return hn::IfThenZeroElse(hn::Or(hn::Eq(source, no_gas), hn::Eq(target, no_gas)), flow);
}

HWY_INLINE bool any_of_eight(const uint16_t* units) {
  uint64_t two[2];
  std::memcpy(two, units, sizeof two);
  return (two[0] | two[1]) != 0;
}

// Each flow is found once: along x from one slab of 64 voxels to the next, along y and z in buffers.
GasFlow FlowGas(const GasView& view, const GasNature& nature, uint16_t* HWY_RESTRICT next) {
  const Part d;
  const size_t lanes = hn::Lanes(d);
  const auto zero = hn::Zero(d), one = hn::Set(d, uint16_t{1});
  const auto share = hn::Set(d, nature.share), thins = hn::Set(d, nature.thins_of);
  const auto thin = hn::Set(d, static_cast<uint16_t>(kThinGas));
  auto any = zero;
  GasFlow flow;
  const auto reach = [&](int face, bool crosses) { flow.reaches |= static_cast<uint32_t>(crosses) << face; };
  alignas(64) uint16_t from_last[64];         // from the slab before
  alignas(64) uint16_t column[192], up[128];  // below, the slab, above; from each of these to the next, from below on
  alignas(64) uint16_t to_z[128], from_z[64], beside[64], first[64], from_beside[64];
  std::fill_n(column, 192, kNoGas);
  std::fill_n(beside, 64, kNoGas);
  std::fill_n(first, 64, kNoGas);
  auto entering = zero;
  for (size_t at = 0; at < 64; at += lanes) {
    const auto units = FlowEvenly(hn::LoadU(d, view.beside[world::kFaceNegX] + at), hn::LoadU(d, view.own + at));
    hn::StoreU(units, d, from_last + at);
    entering = hn::Or(entering, units);
  }
  reach(world::kFaceNegX, !hn::AllTrue(d, hn::Eq(entering, zero)));
  auto leaving = zero;
  for (int x = 0; x < 8; ++x) {
    const uint16_t* own = view.own + x * 64;
    const uint16_t* next_slab = x < 7 ? own + 64 : view.beside[world::kFacePosX];
    // Along y.
    std::memcpy(column, view.beside[world::kFaceNegY] + x * 8, 8 * sizeof(uint16_t));
    std::memcpy(column + 8, own, 64 * sizeof(uint16_t));
    std::memcpy(column + 72, view.beside[world::kFacePosY] + x * 8, 8 * sizeof(uint16_t));
    for (size_t at = 0; at < 72; at += lanes) {
      const auto lower = hn::LoadU(d, column + at), upper = hn::LoadU(d, column + at + 8);
      const auto units = nature.rises ? FlowAlong(lower, upper, share) : hn::Sub(zero, FlowAlong(upper, lower, share));
      hn::StoreU(units, d, up + at);
    }
    reach(world::kFaceNegY, any_of_eight(up));
    reach(world::kFacePosY, any_of_eight(up + 64));
    // Along z: what is next to each in memory, but for the ends of rows.
    alignas(64) uint16_t following[64];
    std::memcpy(following, own + 1, 63 * sizeof(uint16_t));
    for (int y = 0; y < 8; ++y) {
      following[y * 8 + 7] = view.beside[world::kFacePosZ][x * 8 + y];
      beside[y] = view.beside[world::kFaceNegZ][x * 8 + y];
      first[y] = own[y * 8];
    }
    for (size_t at = 0; at < 64; at += lanes)
      hn::StoreU(FlowEvenly(hn::LoadU(d, own + at), hn::LoadU(d, following + at)), d, to_z + at);
    for (size_t at = 0; at < 8; at += lanes)
      hn::StoreU(FlowEvenly(hn::LoadU(d, beside + at), hn::LoadU(d, first + at)), d, from_beside + at);
    std::memcpy(from_z + 1, to_z, 63 * sizeof(uint16_t));
    uint16_t last = 0;
    for (int y = 0; y < 8; ++y) {
      from_z[y * 8] = from_beside[y];
      last |= to_z[y * 8 + 7];
    }
    reach(world::kFaceNegZ, any_of_eight(from_beside));
    reach(world::kFacePosZ, last != 0);
    // All that goes and comes.
    auto lost = zero;
    for (size_t at = 0; at < 64; at += lanes) {
      const auto a = hn::LoadU(d, own + at);
      const auto to_next = FlowEvenly(a, hn::LoadU(d, next_slab + at));
      const auto to_above = hn::LoadU(d, up + 8 + at), to_following = hn::LoadU(d, to_z + at);
      const auto goes = hn::Add(to_next, hn::Add(to_above, to_following));
      const auto comes =
          hn::Add(hn::LoadU(d, from_last + at), hn::Add(hn::LoadU(d, up + at), hn::LoadU(d, from_z + at)));
      hn::StoreU(to_next, d, from_last + at);
      any = hn::Or(any, hn::Or(to_next, hn::Or(to_above, to_following)));
      if (x == 7) leaving = hn::Or(leaving, to_next);
      auto now = hn::Add(hn::Sub(a, goes), comes);
      if (nature.thins_of != 0) {
        const auto most = hn::Min(now, hn::Add(hn::MulHigh(now, thins), one));
        const auto gone = hn::IfThenElseZero(hn::Lt(now, thin), most);
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
  reach(world::kFacePosX, !hn::AllTrue(d, hn::Eq(leaving, zero)));
  flow.flows = flow.lost > 0 || flow.reaches != 0 || !hn::AllTrue(d, hn::Eq(any, zero));
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
