#include "sim/matter/liquid_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "world/base/random.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/matter/liquid_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "world/base/wide_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Two rows of eight voxels along z, or one.
using Rows = hn::CappedTag<uint16_t, 16>;
using Row = hn::CappedTag<uint16_t, 8>;
using V = hn::Vec<Rows>;
constexpr Rows kRows;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(kRows));
constexpr int kRowLanes = std::min(kLanes, 8);
constexpr uint16_t kFull = kFullVoxel, kShareBits = 0x3fff;

HWY_INLINE V set(uint16_t value) { return hn::Set(kRows, value); }
HWY_INLINE bool any_of(V v) { return !hn::AllTrue(kRows, hn::Eq(v, hn::Zero(kRows))); }

/// What two rows hold, told from 8 pieces of them.
LiquidRows RowsOf(const uint16_t* own, uint8_t pairs, LiquidRows rows) {
  const V no_entry = set(kNoEntry);
  for (int k = 0; k < 4; ++k) {
    if (!(pairs >> k & 1)) continue;
    V wet = hn::Zero(kRows), least = no_entry;
    for (int x = 0; x < 8; ++x)
      for (int at = 0; at < 16; at += kLanes) {
        const V v = hn::Load(kRows, own + x * 64 + k * 16 + at);
        wet = hn::Or(wet, hn::IfThenZeroElse(hn::Eq(v, no_entry), v));
        least = hn::Min(least, v);
      }
    const auto bit = static_cast<uint8_t>(1u << k);
    const bool full = hn::AllTrue(kRows, hn::Eq(hn::Max(least, set(kFull)), least));
    rows.wet = static_cast<uint8_t>(any_of(wet) ? rows.wet | bit : rows.wet & ~bit);
    rows.full = static_cast<uint8_t>(full ? rows.full | bit : rows.full & ~bit);
  }
  return rows;
}

void ViewAmounts(const world::BlockId* blocks, const uint16_t* amounts, world::BlockId liquid, uint16_t* own) {
  const V is = set(liquid), air = set(world::kAir), no_entry = set(kNoEntry);
  for (int i = 0; i < world::kLeafVoxels; i += kLanes) {
    const V id = hn::LoadU(kRows, blocks + i), amount = amounts ? hn::LoadU(kRows, amounts + i) : set(kFull);
    const V other = hn::IfThenZeroElse(hn::Eq(id, air), no_entry);
    hn::Store(hn::IfThenElse(hn::Eq(id, is), amount, other), kRows, own + i);
  }
}

/// Copies rows in which nothing flows, and says what became of the others.
LiquidMove Finish(const LiquidPart& page, uint8_t live, uint16_t* next) {
  V changed = hn::Zero(kRows);
  for (int x = 0; x < 8; ++x)
    for (int at = 0; at < 64; at += kLanes) {
      const int i = x * 64 + at;
      if (live >> (at / 16) & 1)
        changed = hn::Or(changed, hn::Xor(hn::Load(kRows, page.own + i), hn::Load(kRows, next + i)));
    }
  LiquidMove move;
  move.changed = any_of(changed);
  move.rows = move.changed ? RowsOf(next, live, page.rows) : page.rows;
  return move;
}

void CopyRest(const LiquidPart& page, uint8_t live, uint16_t* next) {
  for (int at = 0; at < 64; at += kLanes) {
    if (live >> (at / 16) & 1) continue;
    for (int x = 0; x < 8; ++x) hn::Store(hn::Load(kRows, page.own + x * 64 + at), kRows, next + x * 64 + at);
  }
}

/// Into the highest row alone, of a page out of which nothing flows.
LiquidMove FallInto(const LiquidPart& page, const LiquidPart& above, uint16_t* next) {
  const Row d;
  CopyRest(page, 0, next);
  for (int x = 0; x < 8; ++x)
    for (int z = 0; z < 8; z += static_cast<int>(hn::MaxLanes(d))) {
      const auto own = hn::LoadU(d, page.own + x * 64 + 56 + z), over = hn::LoadU(d, above.own + x * 64 + z);
      const auto more = hn::IfThenZeroElse(hn::Eq(over, hn::Set(d, kNoEntry)), over);
      const auto room = hn::SaturatedSub(hn::Set(d, kFull), own);
      hn::StoreU(hn::Add(own, hn::Min(more, room)), d, next + x * 64 + 56 + z);
    }
  return Finish(page, 8, next);
}

LiquidMove Fall(const LiquidPart& page, const LiquidPart& below, const LiquidPart& above, bool gives, bool above_gives,
                uint16_t* next) {
  const world::HWY_NAMESPACE::WideVectors wide;
  if (!gives) return FallInto(page, above, next);
  // A pair of rows is live where something may leave it or come in.
  const unsigned wet = page.rows.wet, full = page.rows.full;
  const unsigned under_full = full << 1 | (below.rows.full >> 3 & 1u);
  const unsigned over_wet = wet >> 1 | (above_gives ? (above.rows.wet & 1u) << 3 : 0u);
  const auto live = static_cast<uint8_t>(((wet & ~(full & under_full)) | (over_wet & ~full)) & 15u);
  LiquidMove move;
  move.rows = page.rows;
  if (!live) return move;
  CopyRest(page, live, next);
  V bottom = hn::Zero(kRows);
  const V no_entry = set(kNoEntry), all = set(kFull);
  for (int x = 0; x < 8; ++x) {
    // The row below, eight of the page, the row above.
    alignas(64) uint16_t column[8 + 64 + 8 + 16];
    std::memcpy(column, below.own + x * 64 + 56, 8 * sizeof(uint16_t));
    std::memcpy(column + 8, page.own + x * 64, 64 * sizeof(uint16_t));
    if (above_gives)
      std::memcpy(column + 72, above.own + x * 64, 8 * sizeof(uint16_t));
    else
      std::fill_n(column + 72, 8, kNoEntry);
    for (int at = 0; at < 64; at += kLanes) {
      if (!(live >> (at / 16) & 1)) continue;
      const V under = hn::LoadU(kRows, column + at), own = hn::LoadU(kRows, column + 8 + at),
              over = hn::LoadU(kRows, column + 16 + at);
      const V out = hn::Min(hn::IfThenZeroElse(hn::Eq(own, no_entry), own), hn::SaturatedSub(all, under));
      const V in = hn::Min(hn::IfThenZeroElse(hn::Eq(over, no_entry), over), hn::SaturatedSub(all, own));
      hn::Store(hn::Add(hn::Sub(own, out), in), kRows, next + x * 64 + at);
      if (at < 8) bottom = hn::Or(bottom, out);
    }
  }
  move = Finish(page, live, next);
  alignas(64) uint16_t lowest[16] = {};
  hn::Store(bottom, kRows, lowest);
  for (int z = 0; z < 8; ++z)
    if (lowest[z]) move.out = kOutBelow;
  return move;
}

void PushOf(const uint16_t* own, const uint16_t* below, uint8_t rows, const Spread& spread, uint64_t hash,
            uint16_t* push) {
  const V almost_full = set(kFull - 1), deep = set(spread.share[1]), thin = set(spread.share[0]);
  const V base = set(static_cast<uint16_t>(hash)), twist = set(static_cast<uint16_t>(hash >> 16 | 1));
  const V most = set(0xffff);
  for (int x = 0; x < 8; ++x)
    for (int at = 0; at < 64; at += kLanes) {
      if (!(rows >> (at / 16) & 1)) continue;
      const int i = x * 64 + at;
      const V amount = hn::Load(kRows, own + i);
      if (!any_of(hn::IfThenZeroElse(hn::Eq(amount, most), amount))) continue;
      alignas(64) uint16_t lowest[16];
      if (at < 8) {
        std::memcpy(lowest, below + x * 64 + 56 + at, kRowLanes * sizeof(uint16_t));
        std::memcpy(lowest + 8, own + x * 64, 8 * sizeof(uint16_t));
      }
      const V under = at < 8 ? hn::Load(kRows, lowest) : hn::LoadU(kRows, own + i - 8);
      // Most liquids spread alike at any depth but the least.
      V share = hn::IfThenElse(hn::Gt(amount, set(63)), deep, thin);
      if (!spread.even) {
        alignas(64) uint16_t by_depth[16];
        for (int z = 0; z < kLanes; ++z)
          by_depth[z] = spread.share[std::min<size_t>((own[i + z] == kNoEntry ? 0u : own[i + z]) / 64u, kFull / 64)];
        share = hn::Load(kRows, by_depth);
      }
      share = hn::IfThenElseZero(hn::Gt(under, almost_full), share);  // kNoEntry is more than full too
      // The side whose turn it is, from two bits of a hash.
      V turn = hn::Mul(hn::Add(base, hn::Iota(kRows, static_cast<uint16_t>(i))), set(0x9e37));
      turn = hn::Mul(hn::Xor(turn, hn::ShiftRight<7>(turn)), twist);
      hn::Store(hn::Or(share, hn::And(turn, hn::Xor(most, set(kShareBits)))), kRows, push + i);
    }
}

struct Through {
  V flow;   // from the first to the second voxel, modulo 2^16
  V gives;  // all bits where the first gives
  V out;    // as much
  V would;  // not 0 where something would flow, if its turn came
};
/// What flows through a face; `ahead`, `back`: the side of the second as seen from the first, and the other way.
HWY_INLINE Through through(V a, V b, V push_a, V push_b, uint16_t ahead, uint16_t back, V film) {
  const V zero = hn::Zero(kRows), one = set(1), no_entry = set(kNoEntry);
  const V high = hn::Max(a, b), low = hn::Min(a, b);
  const auto first = hn::Eq(high, a);
  // Of what fits, a quarter for each of the four sides from which more may come.
  const V room = hn::ShiftRight<2>(hn::SaturatedSub(set(kFull), low));
  V more = hn::IfThenZeroElse(hn::Eq(high, no_entry), hn::Sub(high, low));
  more = hn::IfThenZeroElse(hn::Eq(more, one), more);  // level
  more = hn::IfThenZeroElse(hn::Eq(room, zero), more);
  // What is dry is wetted by a film at least.
  const V wets = hn::VecFromMask(kRows, hn::Gt(hn::Add(high, one), film));
  const V dry = hn::VecFromMask(kRows, hn::Eq(low, zero));
  more = hn::And(more, hn::Or(wets, hn::Not(dry)));
  const V push = hn::IfThenElse(first, push_a, push_b), share = hn::And(push, set(kShareBits));
  const V whole = hn::MulHigh(more, share), part = hn::Mul(more, share);
  const V side = hn::IfThenElse(first, set(ahead), set(back));
  const V up = hn::IfThenElseZero(hn::Eq(hn::ShiftRight<14>(push), side), hn::IfThenZeroElse(hn::Eq(part, zero), one));
  Through t;
  t.out = hn::Min(hn::Add(whole, up), room);
  t.flow = hn::IfThenElse(first, t.out, hn::Sub(zero, t.out));
  t.gives = hn::VecFromMask(kRows, first);
  t.would = hn::Or(whole, part);
  return t;
}

HWY_INLINE V load_push(const uint16_t* push, int i) { return push ? hn::LoadU(kRows, push + i) : hn::Zero(kRows); }

/// 64 voxels of a side across z, by x * 8 + y: the amounts or pushes at z.
void plane_of(const uint16_t* values, int z, uint16_t* into) {
  if (!values) {
    std::fill_n(into, 64, uint16_t{0});
    return;
  }
  for (int i = 0; i < 64; ++i) into[i] = values[i * 8 + z];
}

/// Through the side of the page across z; what flows is added to next. `own_first`: the page lies before the side.
template <bool kOwnFirst>
void slide_across_z(const LiquidPart& page, const LiquidPart& side, V film, LiquidMove& move, uint16_t* next) {
  alignas(64) uint16_t own[64], push[64], other[64], other_push[64];
  constexpr int kOwnZ = kOwnFirst ? 7 : 0;
  plane_of(page.own, kOwnZ, own);
  plane_of(page.push, kOwnZ, push);
  plane_of(side.own, 7 - kOwnZ, other);
  plane_of(side.push, 7 - kOwnZ, other_push);
  V out = hn::Zero(kRows), would = out;
  for (int i = 0; i < 64; i += kLanes) {
    const V a = hn::Load(kRows, kOwnFirst ? own + i : other + i), b = hn::Load(kRows, kOwnFirst ? other + i : own + i);
    const V pa = hn::Load(kRows, kOwnFirst ? push + i : other_push + i),
            pb = hn::Load(kRows, kOwnFirst ? other_push + i : push + i);
    const Through t = through(a, b, pa, pb, 1, 3, film);
    const V mine = kOwnFirst ? t.gives : hn::Not(t.gives);
    out = hn::Or(out, hn::And(mine, t.out));
    would = hn::Or(would, hn::And(mine, t.would));
    hn::Store(kOwnFirst ? hn::Sub(a, t.flow) : hn::Add(b, t.flow), kRows, own + i);
    hn::Store(kOwnFirst ? hn::Sub(hn::Zero(kRows), t.flow) : t.flow, kRows, push + i);
  }
  for (int i = 0; i < 64; ++i) next[i * 8 + kOwnZ] = static_cast<uint16_t>(next[i * 8 + kOwnZ] + push[i]);
  if (any_of(out)) move.out = static_cast<uint8_t>(move.out | (kOwnFirst ? 2 : 8));
  move.restless |= any_of(would);
}

LiquidMove Slide(const LiquidPart& page, const LiquidPart (&sides)[kSides], uint16_t film_amount, uint16_t* next) {
  const world::HWY_NAMESPACE::WideVectors wide;
  unsigned wet = page.push ? page.rows.wet : 0u, full = page.rows.full;
  for (const LiquidPart& side : sides) {
    if (side.push) wet |= side.rows.wet;
    full &= side.rows.full;
  }
  const auto live = static_cast<uint8_t>(wet & ~full & 15u);
  LiquidMove move;
  move.rows = page.rows;
  if (!live) return move;
  CopyRest(page, live, next);
  const V film = set(film_amount);
  // The last voxel of each row, beyond which the next page lies.
  alignas(64) uint16_t last_z[16] = {};
  last_z[7] = last_z[15] = kNoEntry;
  [[maybe_unused]] const V end_of_row = hn::Load(kRows, last_z);
  V would = hn::Zero(kRows), out_low = would, out_high = would;
  for (int at = 0; at < 64; at += kLanes) {
    if (!(live >> (at / 16) & 1)) continue;
    V here = hn::Load(kRows, page.own + at), push = load_push(page.push, at);
    const Through before =
        through(hn::LoadU(kRows, sides[2].own + 448 + at), here, load_push(sides[2].push, 448 + at), push, 0, 2, film);
    out_low = hn::Or(out_low, hn::AndNot(before.gives, before.out));
    would = hn::Or(would, hn::AndNot(before.gives, before.would));
    V sum = hn::Add(here, before.flow);
    for (int x = 0; x < 8; ++x) {
      const int i = x * 64 + at;
      const V ahead = x < 7 ? hn::Load(kRows, page.own + i + 64) : hn::LoadU(kRows, sides[0].own + at);
      const V push_ahead = x < 7 ? load_push(page.push, i + 64) : load_push(sides[0].push, at);
      const Through t = through(here, ahead, push, push_ahead, 0, 2, film);
      if (x == 7) {
        out_high = hn::Or(out_high, hn::And(t.gives, t.out));
        would = hn::Or(would, hn::And(t.gives, t.would));
      } else {
        would = hn::Or(would, t.would);
      }
#if HWY_TARGET == HWY_SCALAR
      const bool first = (i & 7) == 0, last = (i & 7) == 7;
      const Through z = through(here, last ? set(kNoEntry) : hn::Load(kRows, page.own + i + 1), push,
                                last ? hn::Zero(kRows) : load_push(page.push, i + 1), 1, 3, film);
      const V from_last =
          first ? hn::Zero(kRows)
                : through(hn::Load(kRows, page.own + i - 1), here, load_push(page.push, i - 1), push, 1, 3, film).flow;
#else
      const Through z = through(here, hn::Or(hn::ShiftRightLanes<1>(kRows, here), end_of_row), push,
                                hn::ShiftRightLanes<1>(kRows, push), 1, 3, film);
      const V from_last = hn::ShiftLeftLanes<1>(kRows, z.flow);
#endif
      would = hn::Or(would, z.would);
      sum = hn::Sub(hn::Sub(sum, t.flow), hn::Sub(z.flow, from_last));
      hn::Store(sum, kRows, next + i);
      sum = hn::Add(ahead, t.flow);
      here = ahead, push = push_ahead;
    }
  }
  move.restless = any_of(would);
  move.out = static_cast<uint8_t>((any_of(out_high) ? 1 : 0) | (any_of(out_low) ? 4 : 0));
  const auto is_still = [&](const LiquidPart& side) {
    return (page.rows.full & side.rows.full) == 15 || !(page.rows.wet | side.rows.wet);
  };
  if (!is_still(sides[1])) slide_across_z<true>(page, sides[1], film, move, next);
  if (!is_still(sides[3])) slide_across_z<false>(page, sides[3], film, move, next);
  const LiquidMove done = Finish(page, live, next);
  move.rows = done.rows, move.changed = done.changed;
  return move;
}

void WriteAmounts(const uint16_t* own, world::BlockId liquid, world::BlockId* blocks, uint16_t* amounts,
                  world::LeafMask& changed) {
  const V is = set(liquid), no_entry = set(kNoEntry), zero = hn::Zero(kRows), air = set(world::kAir);
  for (int x = 0; x < 8; ++x) {
    uint64_t bits = 0;
    for (int at = 0; at < 64; at += kLanes) {
      const int i = x * 64 + at;
      const V now = hn::Load(kRows, own + i), id = hn::LoadU(kRows, blocks + i), amount = hn::LoadU(kRows, amounts + i);
      const auto can_enter = hn::Ne(now, no_entry);
      const V next_id = hn::IfThenElse(can_enter, hn::IfThenElse(hn::Eq(now, zero), air, is), id);
      const V next_amount = hn::IfThenElse(can_enter, now, amount);
      const auto moved = hn::Or(hn::Ne(next_id, id), hn::Ne(next_amount, amount));
      hn::StoreU(next_id, kRows, blocks + i);
      hn::StoreU(next_amount, kRows, amounts + i);
      uint8_t bytes[8] = {};
      hn::StoreMaskBits(kRows, moved, bytes);
      bits |= (static_cast<uint64_t>(bytes[0]) | static_cast<uint64_t>(bytes[1]) << 8) << at;
    }
    changed.word[x] = bits;
  }
}

void MasksOf(const uint16_t* own, uint16_t most, LiquidMasks& masks) {
  const V zero = hn::Zero(kRows), no_entry = set(kNoEntry), below_full = set(kFull - 1);
  const V below_most = set(static_cast<uint16_t>(most - 1));
  world::LeafMask* out[4] = {&masks.full, &masks.part, &masks.most, &masks.air};
  for (int x = 0; x < 8; ++x) {
    uint64_t bits[4] = {};
    for (int at = 0; at < 64; at += kLanes) {
      const V v = hn::Load(kRows, own + x * 64 + at);
      const V liquid = hn::IfThenZeroElse(hn::Eq(v, no_entry), v);
      const auto full = hn::Gt(liquid, below_full), part = hn::AndNot(full, hn::Gt(liquid, zero));
      const auto of = [&](auto mask, size_t k) {
        uint8_t bytes[8] = {};
        hn::StoreMaskBits(kRows, mask, bytes);
        bits[k] |= (static_cast<uint64_t>(bytes[0]) | static_cast<uint64_t>(bytes[1]) << 8) << at;
      };
      of(full, 0), of(part, 1), of(hn::And(part, hn::Gt(liquid, below_most)), 2), of(hn::Eq(v, zero), 3);
    }
    for (size_t k = 0; k < 4; ++k) out[k]->word[x] = bits[k];
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

HWY_EXPORT(RowsOf);
HWY_EXPORT(ViewAmounts);
HWY_EXPORT(Fall);
HWY_EXPORT(PushOf);
HWY_EXPORT(Slide);
HWY_EXPORT(WriteAmounts);
HWY_EXPORT(MasksOf);

LiquidRows view_amounts(const world::BlockId* blocks, const uint16_t* amounts, world::BlockId liquid, uint16_t* own) {
  HWY_DYNAMIC_DISPATCH(ViewAmounts)(blocks, amounts, liquid, own);
  return rows_of(own);
}
LiquidRows view_planes(const world::LeafMask& occupied, uint16_t* own) {
  for (int i = 0; i < world::kLeafVoxels; ++i) own[i] = occupied.test(i) ? kNoEntry : uint16_t{0};
  return rows_of(own);
}
LiquidRows rows_of(const uint16_t* own) { return HWY_DYNAMIC_DISPATCH(RowsOf)(own, 15, {}); }
LiquidMove fall(const LiquidPart& page, const LiquidPart& below, const LiquidPart& above, bool gives, bool above_gives,
                uint16_t* next) {
  return HWY_DYNAMIC_DISPATCH(Fall)(page, below, above, gives, above_gives, next);
}
void push_of(const uint16_t* own, const uint16_t* below, uint8_t rows, const Spread& spread, uint64_t hash,
             uint16_t* push) {
  HWY_DYNAMIC_DISPATCH(PushOf)(own, below, rows, spread, hash, push);
}
LiquidMove slide(const LiquidPart& page, const LiquidPart (&sides)[kSides], uint16_t film, uint16_t* next) {
  return HWY_DYNAMIC_DISPATCH(Slide)(page, sides, film, next);
}
world::LeafMask write_amounts(const uint16_t* own, world::BlockId liquid, world::BlockId* blocks, uint16_t* amounts) {
  world::LeafMask changed;
  HWY_DYNAMIC_DISPATCH(WriteAmounts)(own, liquid, blocks, amounts, changed);
  return changed;
}
void find_masks(const uint16_t* own, uint16_t most, LiquidMasks& masks) {
  HWY_DYNAMIC_DISPATCH(MasksOf)(own, most, masks);
}

Spread spread_of(double density, double viscosity_pa_s, double tick_s, int film) {
  constexpr double kMostShare = 0.2;
  Spread spread;
  for (size_t i = 0; i < spread.share.size(); ++i) {
    const double h = (static_cast<double>(i) + 0.5) * 64 / kFullVoxel;  // m
    const double diffusivity = 9.81 * density * h * h * h / (3 * viscosity_pa_s);
    spread.share[i] = static_cast<uint16_t>(std::clamp(diffusivity * tick_s, 1.0 / 65536, kMostShare) * 65536);
  }
  static_assert(kMostShare * 65536 < 1 << 14, "a push keeps the side in two bits above the share");
  spread.film = static_cast<uint16_t>(film);
  spread.even = std::all_of(spread.share.begin() + 1, spread.share.end(),
                            [&](uint16_t share) { return share == spread.share[1]; });
  return spread;
}

}  // namespace sim
#endif
