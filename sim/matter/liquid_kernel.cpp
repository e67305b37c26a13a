#include "sim/matter/liquid_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "world/base/random.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/matter/liquid_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// Loops over rows of eight, which the compiler turns into vectors of each target.
HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

bool FlowDown(const LiquidView& view, LiquidFlow& flow) {
  uint16_t any = 0;
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const uint16_t* a = view.own + x * 64 + y * 8;
      const uint16_t* b = y > 0 ? a - 8 : view.below + x * 8;
      uint16_t* out = flow.down + x * 64 + y * 8;
      for (int z = 0; z < 8; ++z) {
        const uint16_t amount = a[z] == kNoEntry ? 0 : a[z];
        const uint16_t room = b[z] >= kFullVoxel ? 0 : static_cast<uint16_t>(kFullVoxel - b[z]);
        out[z] = std::min(amount, room);
        any |= out[z];
      }
    }
  return any != 0;
}

namespace hn = hwy::HWY_NAMESPACE;
using Row = hn::CappedTag<uint16_t, 8>;  // eight voxels along z, or a part of them

SideFlow FlowSideways(const LiquidView& view, const Spread& spread, uint64_t hash, LiquidFlow& flow) {
  const Row d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto zero = hn::Zero(d), no_entry = hn::Set(d, kNoEntry), one = hn::Set(d, uint16_t{1});
  const auto full = hn::Set(d, static_cast<uint16_t>(kFullVoxel)), film = hn::Set(d, spread.film);
  const auto almost_full = hn::Set(d, static_cast<uint16_t>(kFullVoxel - 1));
  const auto deep = hn::Set(d, spread.share[1]), thin = hn::Set(d, spread.share[0]);
  const auto base = hn::Set(d, static_cast<uint16_t>(hash)), twist = hn::Set(d, static_cast<uint16_t>(hash >> 16 | 1));
  auto any = zero, restless = zero;
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const int at = x * 64 + y * 8;
      const uint16_t* own = view.own + at;
      const uint16_t* below = y > 0 ? own - 8 : view.below + x * 8;
      const uint16_t* next_x = x < 7 ? own + 64 : view.side[0] + y * 8;
      const uint16_t* last_x = x > 0 ? own - 64 : view.side[2] + y * 8;
      uint16_t along_z[10];
      along_z[0] = view.side[3][x * 8 + y];
      std::memcpy(along_z + 1, own, 8 * sizeof(uint16_t));
      along_z[9] = view.side[1][x * 8 + y];
      const uint16_t* beside[kSides] = {next_x, along_z + 2, last_x, along_z};
      for (int z = 0; z < 8; z += lanes) {
        const auto here = hn::LoadU(d, own + z);
        const auto a = hn::IfThenZeroElse(hn::Eq(here, no_entry), here);
        const auto borne = hn::Gt(hn::LoadU(d, below + z), almost_full);  // kNoEntry is more than full too
        // Most liquids spread alike at any depth but the least.
        auto share = hn::IfThenElse(hn::Gt(a, hn::Set(d, uint16_t{63})), deep, thin);
        if (!spread.even) {
          uint16_t by_depth[8];
          for (int i = 0; i < lanes; ++i) {
            const uint16_t amount = own[z + i] == kNoEntry ? uint16_t{0} : own[z + i];
            by_depth[i] = spread.share[std::min<size_t>(amount / 64u, kFullVoxel / 64)];
          }
          share = hn::LoadU(d, by_depth);
        }
        share = hn::IfThenElseZero(borne, share);
        // The side whose turn it is, from two bits of a hash.
        auto r = hn::Mul(hn::Add(base, hn::Iota(d, static_cast<uint16_t>(at + z))), hn::Set(d, uint16_t{0x9e37}));
        r = hn::ShiftRight<14>(hn::Mul(hn::Xor(r, hn::ShiftRight<7>(r)), twist));
        const auto wets = hn::Gt(hn::Add(a, one), film);  // enough to wet what is dry
        for (int side = 0; side < kSides; ++side) {
          const auto b = hn::LoadU(d, beside[side] + z);
          // Of what fits, a quarter for each of the four sides from which more may come.
          const auto room = hn::ShiftRight<2>(hn::SaturatedSub(full, b));
          auto more = hn::SaturatedSub(a, b);
          more = hn::IfThenZeroElse(hn::Eq(more, one), more);  // level
          more = hn::IfThenZeroElse(hn::Eq(room, zero), more);
          more = hn::IfThenElse(hn::Eq(b, zero), hn::IfThenElseZero(wets, more), more);
          const auto high = hn::MulHigh(more, share), low = hn::Mul(more, share);
          const auto up = hn::IfThenElseZero(hn::Eq(r, hn::Set(d, static_cast<uint16_t>(side))),
                                             hn::IfThenZeroElse(hn::Eq(low, zero), one));
          const auto out = hn::Min(hn::Add(high, up), room);
          hn::StoreU(out, d, flow.side[side] + at + z);
          any = hn::Or(any, out);
          restless = hn::Or(restless, hn::Or(high, low));
        }
      }
    }
  return {!hn::AllTrue(d, hn::Eq(any, zero)), !hn::AllTrue(d, hn::Eq(restless, zero))};
}

bool HoldsBlock(const world::BlockId* blocks, world::BlockId block) {
  for (int row = 0; row < world::kLeafVoxels; row += 64) {
    uint16_t found = 0;
    for (int i = 0; i < 64; ++i) found |= static_cast<uint16_t>(blocks[row + i] == block);
    if (found) return true;
  }
  return false;
}

void MasksOf(const world::BlockId* blocks, const uint16_t* amounts, world::BlockId liquid, uint16_t most,
             LiquidMasks& masks) {
  const Row d;
  const size_t lanes = hn::Lanes(d);
  const auto is = hn::Set(d, liquid), air = hn::Set(d, world::kAir);
  const auto below_full = hn::Set(d, static_cast<uint16_t>(kFullVoxel - 1)),
             below_most = hn::Set(d, static_cast<uint16_t>(most - 1));
  world::LeafMask* out[4] = {&masks.full, &masks.part, &masks.most, &masks.air};
  for (int w = 0; w < 8; ++w) {
    uint64_t bits[4] = {};
    for (size_t b = 0; b < 64; b += lanes) {
      const size_t at = static_cast<size_t>(w) * 64 + b;
      const auto id = hn::LoadU(d, blocks + at);
      const auto liquid_here = hn::Eq(id, is);
      const auto amount = amounts ? hn::LoadU(d, amounts + at) : hn::Set(d, static_cast<uint16_t>(kFullVoxel));
      const auto full = hn::Gt(amount, below_full);
      const auto part = hn::AndNot(hn::VecFromMask(d, full), hn::VecFromMask(d, liquid_here));
      const auto of = [&](auto mask, size_t k) {
        uint8_t byte[8] = {};
        hn::StoreMaskBits(d, mask, byte);
        bits[k] |= static_cast<uint64_t>(byte[0] & ((1u << lanes) - 1)) << b;
      };
      of(hn::MaskFromVec(hn::And(hn::VecFromMask(d, full), hn::VecFromMask(d, liquid_here))), 0);
      of(hn::MaskFromVec(part), 1);
      of(hn::MaskFromVec(hn::And(part, hn::VecFromMask(d, hn::Gt(amount, below_most)))), 2);
      of(hn::Eq(id, air), 3);
    }
    for (size_t k = 0; k < 4; ++k) out[k]->word[w] = bits[k];
  }
}

HWY_INLINE uint64_t changed_bits(const uint16_t* before, const uint16_t* after) {
  uint64_t bits = 0;
  for (int z = 0; z < 8; ++z) bits |= static_cast<uint64_t>(before[z] != after[z]) << z;
  return bits;
}

void ApplyDown(const LiquidFlow& flow, const LiquidInflow& inflow, uint16_t* own, world::LeafMask& changed) {
  for (int x = 0; x < 8; ++x) {
    uint64_t bits = 0;
    for (int y = 0; y < 8; ++y) {
      const int at = x * 64 + y * 8;
      const uint16_t* in = y < 7 ? flow.down + at + 8 : inflow.above + x * 8;
      uint16_t now[8];
      for (int z = 0; z < 8; ++z) now[z] = static_cast<uint16_t>(own[at + z] - flow.down[at + z] + in[z]);
      bits |= changed_bits(own + at, now) << (y * 8);
      for (int z = 0; z < 8; ++z) own[at + z] = now[z];
    }
    changed.word[x] = bits;
  }
}

void ApplySideways(const LiquidFlow& flow, const LiquidInflow& inflow, uint16_t* own, world::LeafMask& changed) {
  for (int x = 0; x < 8; ++x) {
    uint64_t bits = 0;
    for (int y = 0; y < 8; ++y) {
      const int at = x * 64 + y * 8;
      const uint16_t* from_last_x = x > 0 ? flow.side[0] + at - 64 : inflow.side[0] + y * 8;
      const uint16_t* from_next_x = x < 7 ? flow.side[2] + at + 64 : inflow.side[2] + y * 8;
      uint16_t from_last_z[8], from_next_z[8], now[8];
      for (int z = 0; z < 8; ++z) {
        from_last_z[z] = z > 0 ? flow.side[1][at + z - 1] : inflow.side[1][x * 8 + y];
        from_next_z[z] = z < 7 ? flow.side[3][at + z + 1] : inflow.side[3][x * 8 + y];
      }
      for (int z = 0; z < 8; ++z)
        now[z] = static_cast<uint16_t>(own[at + z] - flow.side[0][at + z] - flow.side[1][at + z] -
                                       flow.side[2][at + z] - flow.side[3][at + z] + from_last_x[z] + from_next_x[z] +
                                       from_last_z[z] + from_next_z[z]);
      bits |= changed_bits(own + at, now) << (y * 8);
      for (int z = 0; z < 8; ++z) own[at + z] = now[z];
    }
    changed.word[x] = bits;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

HWY_EXPORT(FlowDown);
HWY_EXPORT(FlowSideways);
HWY_EXPORT(HoldsBlock);
HWY_EXPORT(MasksOf);
HWY_EXPORT(ApplyDown);
HWY_EXPORT(ApplySideways);

bool flow_down(const LiquidView& view, LiquidFlow& flow) { return HWY_DYNAMIC_DISPATCH(FlowDown)(view, flow); }
bool holds_block(const world::BlockId* blocks, world::BlockId block) {
  return HWY_DYNAMIC_DISPATCH(HoldsBlock)(blocks, block);
}
LiquidMasks masks_of(const world::BlockId* blocks, const uint16_t* amounts, world::BlockId liquid, uint16_t most) {
  LiquidMasks masks;
  HWY_DYNAMIC_DISPATCH(MasksOf)(blocks, amounts, liquid, most, masks);
  return masks;
}
SideFlow flow_sideways(const LiquidView& view, const Spread& spread, uint64_t hash, LiquidFlow& flow) {
  return HWY_DYNAMIC_DISPATCH(FlowSideways)(view, spread, hash, flow);
}
world::LeafMask apply_down(const LiquidFlow& flow, const LiquidInflow& inflow, uint16_t* own) {
  world::LeafMask changed;
  HWY_DYNAMIC_DISPATCH(ApplyDown)(flow, inflow, own, changed);
  return changed;
}
world::LeafMask apply_sideways(const LiquidFlow& flow, const LiquidInflow& inflow, uint16_t* own) {
  world::LeafMask changed;
  HWY_DYNAMIC_DISPATCH(ApplySideways)(flow, inflow, own, changed);
  return changed;
}

Spread spread_of(double density, double viscosity_pa_s, double tick_s, int film) {
  constexpr double kMostShare = 0.2;
  Spread spread;
  for (size_t i = 0; i < spread.share.size(); ++i) {
    const double h = (static_cast<double>(i) + 0.5) * 64 / kFullVoxel;  // m
    const double diffusivity = 9.81 * density * h * h * h / (3 * viscosity_pa_s);
    spread.share[i] = static_cast<uint16_t>(std::clamp(diffusivity * tick_s, 1.0 / 65536, kMostShare) * 65536);
  }
  spread.film = static_cast<uint16_t>(film);
  spread.even = std::all_of(spread.share.begin() + 1, spread.share.end(),
                            [&](uint16_t share) { return share == spread.share[1]; });
  return spread;
}

}  // namespace sim
#endif
