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

/// One side of eight voxels.
HWY_INLINE uint16_t side_row(const uint16_t* a, const uint16_t* b, const uint16_t* share, const uint16_t* turn,
                             uint16_t side, uint16_t film, uint16_t* out) {
  uint16_t any = 0;
  for (int z = 0; z < 8; ++z) {
    // Of what fits, a quarter for each of the four sides from which more may come.
    const uint16_t room = b[z] < kFullVoxel ? static_cast<uint16_t>((kFullVoxel - b[z]) / 4) : uint16_t{0};
    const bool flows = room > 0 && b[z] < a[z] && a[z] - b[z] > 1 && (b[z] > 0 || a[z] >= film);
    const uint32_t product = static_cast<uint32_t>(flows ? a[z] - b[z] : 0) * share[z];
    const uint32_t up = turn[z] == side ? 0xffffu : 0u;  // share is 0 where the voxel isn't borne: then nothing flows
    out[z] = std::min(static_cast<uint16_t>((product + (product ? up : 0)) >> 16), room);
    any |= static_cast<uint16_t>(product != 0);
  }
  return any;
}

SideFlow FlowSideways(const LiquidView& view, const Spread& spread, uint64_t hash, LiquidFlow& flow) {
  uint16_t any = 0, restless = 0;
  const auto base = static_cast<uint16_t>(hash), twist = static_cast<uint16_t>(hash >> 16 | 1);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const int at = x * 64 + y * 8;
      const uint16_t* own = view.own + at;
      const uint16_t* below = y > 0 ? own - 8 : view.below + x * 8;
      alignas(16) uint16_t a[8], share[8], turn[8], last[8], next[8];
      uint16_t some = 0;
      for (int z = 0; z < 8; ++z) {
        a[z] = own[z] == kNoEntry ? 0 : own[z];
        some |= a[z];
      }
      if (!some) {
        for (int d = 0; d < kSides; ++d)
          for (int z = 0; z < 8; ++z) flow.side[d][at + z] = 0;
        continue;
      }
      // kNoEntry is more than full too. Most liquids spread alike at any depth but the least.
      if (spread.even) {
        const uint16_t deep = spread.share[1], thin = spread.share[0];
        for (int z = 0; z < 8; ++z) share[z] = below[z] >= kFullVoxel ? (a[z] >= 64 ? deep : thin) : uint16_t{0};
      } else {
        for (int z = 0; z < 8; ++z)
          share[z] = below[z] >= kFullVoxel ? spread.share[std::min<size_t>(a[z] / 64u, kFullVoxel / 64)] : uint16_t{0};
      }
      for (int z = 0; z < 8; ++z) {
        uint16_t r =
            static_cast<uint16_t>(static_cast<uint16_t>(base + static_cast<uint16_t>(at + z)) * uint16_t{0x9e37});
        r = static_cast<uint16_t>((r ^ r >> 7) * twist);
        turn[z] = static_cast<uint16_t>(r >> 14);
      }
      std::memcpy(last + 1, own, 7 * sizeof(uint16_t));
      std::memcpy(next, own + 1, 7 * sizeof(uint16_t));
      last[0] = view.side[3][x * 8 + y];
      next[7] = view.side[1][x * 8 + y];
      const uint16_t* beside[kSides] = {x < 7 ? own + 64 : view.side[0] + y * 8, next,
                                        x > 0 ? own - 64 : view.side[2] + y * 8, last};
      for (int d = 0; d < kSides; ++d) {
        uint16_t* out = flow.side[d] + at;
        restless |= side_row(a, beside[d], share, turn, static_cast<uint16_t>(d), spread.film, out);
        for (int z = 0; z < 8; ++z) any |= out[z];
      }
    }
  return {any != 0, restless != 0};
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
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::CappedTag<uint16_t, 8> d;
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
