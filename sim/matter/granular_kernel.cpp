#include "sim/matter/granular_kernel.h"

#include "world/base/random.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/matter/granular_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Half a leaf at most: with whole ones in a register, steps along x would need permutations of their own.
using Words = hn::CappedTag<uint64_t, 4>;
using Part = hn::Vec<Words>;
constexpr Words kWords;
constexpr size_t kLanes = hn::MaxLanes(kWords), kParts = 8 / kLanes;

/// 512 bits.
struct V {
  Part part[kParts];
};
template <class Operation>
HWY_INLINE V each(Operation operation) {
  V v;
  for (size_t i = 0; i < kParts; ++i) v.part[i] = operation(i);
  return v;
}
HWY_INLINE V load(const world::LeafMask& m) {
  return each([&](size_t i) { return hn::Load(kWords, m.word + i * kLanes); });
}
HWY_INLINE void store(world::LeafMask& m, const V& v) {
  for (size_t i = 0; i < kParts; ++i) hn::Store(v.part[i], kWords, m.word + i * kLanes);
}
HWY_INLINE V none() {
  return each([](size_t) { return hn::Zero(kWords); });
}
HWY_INLINE V operator|(const V& a, const V& b) {
  return each([&](size_t i) { return hn::Or(a.part[i], b.part[i]); });
}
HWY_INLINE V operator&(const V& a, const V& b) {
  return each([&](size_t i) { return hn::And(a.part[i], b.part[i]); });
}
/// a & ~b.
HWY_INLINE V without(const V& a, const V& b) {
  return each([&](size_t i) { return hn::AndNot(b.part[i], a.part[i]); });
}
HWY_INLINE V masked(const V& a, uint64_t bits) {
  return each([&](size_t i) { return hn::And(a.part[i], hn::Set(kWords, bits)); });
}
template <int kBits>
HWY_INLINE V left(const V& a) {
  return each([&](size_t i) { return hn::ShiftLeft<kBits>(a.part[i]); });
}
template <int kBits>
HWY_INLINE V right(const V& a) {
  return each([&](size_t i) { return hn::ShiftRight<kBits>(a.part[i]); });
}
HWY_INLINE bool any(const V& v) {
  Part all = v.part[0];
  for (size_t i = 1; i < kParts; ++i) all = hn::Or(all, v.part[i]);
  return !hn::AllTrue(kWords, hn::Eq(all, hn::Zero(kWords)));
}

constexpr uint64_t kFirst = 0x0101010101010101ull, kLast = kFirst << 7;  // z = 0, z = 7
constexpr uint64_t kFirstRow = 0xff;                                     // y = 0

// What stands at a step from each voxel, in the mask and in the one beyond.
HWY_INLINE V at_below(const V& m, const V& below) { return left<8>(m) | right<56>(below); }
HWY_INLINE V at_above(const V& m, const V& above) { return right<8>(m) | left<56>(above); }
HWY_INLINE V two_below(const V& m, const V& below) { return left<16>(m) | right<48>(below); }
HWY_INLINE V at_next_z(const V& m, const V& next) {
  return masked(right<1>(m), ~kLast) | left<7>(masked(next, kFirst));
}
HWY_INLINE V at_last_z(const V& m, const V& last) {
  return left<1>(masked(m, ~kLast)) | masked(right<7>(last), kFirst);
}

/// Lane i: the word kStep on, of the page and of the one beyond.
template <int kStep>
HWY_INLINE V at_word(const V& m, const V& beyond) {
  const auto part = [&](int i) {
    const int n = static_cast<int>(kParts);
    return i < 0 ? beyond.part[i + n] : i < n ? m.part[i] : beyond.part[i - n];
  };
  return each([&](size_t index) {
    const int i = static_cast<int>(index);
#if HWY_TARGET == HWY_SCALAR
    return part(i + kStep);
#else
    constexpr int kSign = kStep < 0 ? -1 : 1;
    const Part a = part(kStep < 0 ? i - 1 : i), b = part(kStep < 0 ? i : i + 1);
    if constexpr (kStep == 2 * kSign) {
      if constexpr (kLanes == 2) return kSign < 0 ? a : b;
      if constexpr (kLanes == 4) return hn::ConcatLowerUpper(kWords, b, a);
    } else {
      if constexpr (kLanes == 2) return hn::CombineShiftRightBytes<8>(kWords, b, a);
      if constexpr (kLanes == 4) {
        const Part middle = hn::ConcatLowerUpper(kWords, b, a);
        return kSign < 0 ? hn::CombineShiftRightBytes<8>(kWords, b, middle)
                         : hn::CombineShiftRightBytes<8>(kWords, middle, a);
      }
    }
#endif
  });
}
HWY_INLINE V at_next_x(const V& m, const V& next) { return at_word<1>(m, next); }
HWY_INLINE V at_last_x(const V& m, const V& last) { return at_word<-1>(m, last); }

template <int kSide>
HWY_INLINE V at_side(const V& m, const V& beyond) {
  if constexpr (kSide == 0) return at_next_x(m, beyond);
  if constexpr (kSide == 1) return at_next_z(m, beyond);
  if constexpr (kSide == 2) return at_last_x(m, beyond);
  return at_last_z(m, beyond);
}
/// Two steps to the side.
template <int kSide>
HWY_INLINE V at_two(const V& m, const V& beyond) {
  if constexpr (kSide == 0) return at_word<2>(m, beyond);
  if constexpr (kSide == 1)
    return masked(right<2>(m), ~(kLast | kLast >> 1)) | left<6>(masked(beyond, kFirst | kFirst << 1));
  if constexpr (kSide == 2) return at_word<-2>(m, beyond);
  return left<2>(masked(m, ~(kLast | kLast >> 1))) | masked(right<6>(beyond), kFirst | kFirst << 1);
}
constexpr size_t kSidePage[kSides] = {around_index(1, 0, 0), around_index(0, 0, 1), around_index(-1, 0, 0),
                                      around_index(0, 0, -1)};
constexpr size_t kSideBelowPage[kSides] = {around_index(1, -1, 0), around_index(0, -1, 1), around_index(-1, -1, 0),
                                           around_index(0, -1, -1)};

struct Order {
  V start_low, start_high, reversed;
};
/// A round of products of 32 bits: a change of any bit of a lane reaches most of the lane.
HWY_INLINE Part scramble(Part s) {
#if HWY_TARGET == HWY_SCALAR
  const uint64_t v = hn::GetLane(s), x = (v & 0xffffffffu) * 0x9e3779b1u, y = (v >> 32) * 0x85ebca77u;
  return hn::Set(kWords, x ^ (y << 32 | y >> 32));
#else
  const hn::Repartition<uint32_t, Words> halves;
  const Part a = hn::MulEven(hn::BitCast(halves, s), hn::Set(halves, 0x9e3779b1u));
  const Part b = hn::MulEven(hn::BitCast(halves, hn::ShiftRight<32>(s)), hn::Set(halves, 0x85ebca77u));
  return hn::Xor(a, hn::Or(hn::ShiftLeft<32>(b), hn::ShiftRight<32>(b)));
#endif
}
// Fractional parts of square roots of primes: the words of a page start apart.
alignas(64) constexpr uint64_t kApart[8] = {0x6a09e667f3bcc908, 0xbb67ae8584caa73b, 0x3c6ef372fe94f82b,
                                            0xa54ff53a5f1d36f1, 0x510e527fade682d1, 0x9b05688c2b3e6c1f,
                                            0x1f83d9abfb41bd6b, 0x5be0cd19137e2179};
HWY_INLINE void order_of(uint64_t page_hash, uint64_t tick, OrderStream stream, Order& order) {
  const uint64_t base = world::mix64(page_hash + (tick * 4 + static_cast<uint64_t>(stream)) * 0x9e3779b97f4a7c15ull);
  for (size_t i = 0; i < kParts; ++i) {
    const Part apart = hn::Load(kWords, kApart + i * kLanes);
    Part s = scramble(scramble(hn::Xor(apart, hn::Set(kWords, base))));
    order.start_low.part[i] = s;
    s = scramble(hn::Add(s, apart));
    order.start_high.part[i] = s;
    s = scramble(hn::Add(s, apart));
    order.reversed.part[i] = s;
  }
}

/// Of each voxel's options at most one, by its order: start, and on from there round the vertical, either way.
HWY_INLINE void choose(const V* options, const Order& order, V* chosen) {
  for (size_t i = 0; i < kParts; ++i) {
    const Part low = order.start_low.part[i], high = order.start_high.part[i], back = order.reversed.part[i];
    const Part o[kSides] = {options[0].part[i], options[1].part[i], options[2].part[i], options[3].part[i]};
    const Part start[kSides] = {hn::AndNot(high, hn::AndNot(low, hn::Set(kWords, ~0ull))), hn::AndNot(high, low),
                                hn::AndNot(low, high), hn::And(high, low)};
    Part c[kSides];
    for (int d = 0; d < kSides; ++d) c[d] = hn::And(start[d], o[d]);
    for (int s = 0; s < kSides; ++s) {
      const Part rest = hn::AndNot(o[s], start[s]);
      Part forward = hn::AndNot(back, rest), backward = hn::And(back, rest);
      for (int k = 1; k < kSides; ++k) {
        const int f = (s + k) & 3, b = (s - k) & 3;
        c[f] = hn::Or(c[f], hn::And(forward, o[f]));
        c[b] = hn::Or(c[b], hn::And(backward, o[b]));
        forward = hn::AndNot(o[f], forward);
        backward = hn::AndNot(o[b], backward);
      }
    }
    for (int d = 0; d < kSides; ++d) chosen[d].part[i] = c[d];
  }
}

template <int kSide>
HWY_INLINE V slide_option(const GranularPlanes& planes, const std::array<PageId, 27>& around, const V& occupied,
                          const V& below, const V& resting, const GranularPage& page) {
  const V side = load(planes.occupied[around[kSidePage[kSide]]]);
  const V free_side = without(resting, at_side<kSide>(occupied, side));
  if (!any(free_side)) return none();
  const V side_below_page = load(planes.occupied[around[kSideBelowPage[kSide]]]);
  // One down: of the page, and of the page at the side.
  const V down = at_below(occupied, below), side_down = at_below(side, side_below_page);
  const V blocked = at_side<kSide>(down, side_down);
  V option = without(free_side, blocked);
  if (page.any_steep)
    option = without(option,
                     load(page.steep) & at_side<kSide>(two_below(occupied, below), two_below(side, side_below_page)));
  if (page.any_smooth) {
    const V may_roll = free_side & blocked & load(page.smooth);
    if (any(may_roll))
      option = option | without(without(may_roll, at_two<kSide>(occupied, side)), at_two<kSide>(down, side_down));
  }
  return option;
}

void Decide(const GranularPlanes& planes, std::span<const PageId> pages) {
  for (const PageId p : pages) {
    GranularPage& page = planes.pages[p];
    const std::array<PageId, 27>& around = planes.around[p];
    const V grain = load(planes.grain[p]), occupied = load(planes.occupied[p]);
    const V below = load(planes.occupied[around[kBelow]]);
    const V fall = without(grain, at_below(occupied, below));
    const V resting = without(grain, fall);
    uint32_t spill = 0;
    page.falls = any(fall) ? planes.tick + 1 : 0;
    if (page.falls) {
      store(page.fall, fall);
      if (any(masked(fall, kFirstRow))) spill |= 16;
    }
    page.slides = 0;
    if (any(resting)) {
      V options[kSides];
      options[0] = slide_option<0>(planes, around, occupied, below, resting, page);
      options[1] = slide_option<1>(planes, around, occupied, below, resting, page);
      options[2] = slide_option<2>(planes, around, occupied, below, resting, page);
      options[3] = slide_option<3>(planes, around, occupied, below, resting, page);
      if (any((options[0] | options[1]) | (options[2] | options[3]))) {
        Order order;
        order_of(planes.hash[p], planes.tick, OrderStream::decide, order);
        V chosen[kSides];
        choose(options, order, chosen);
        for (int d = 0; d < kSides; ++d) store(page.slide[d], chosen[d]);
        page.slides = planes.tick + 1;
        if (page.slide[0].word[7]) spill |= 1;
        if (any(masked(chosen[1], kLast))) spill |= 2;
        if (page.slide[2].word[0]) spill |= 4;
        if (any(masked(chosen[3], kFirst))) spill |= 8;
      }
    }
    page.spill = spill;
  }
}

HWY_INLINE V decided_fall(const GranularPlanes& planes, PageId p) {
  return planes.pages[p].falls == planes.tick + 1 ? load(planes.pages[p].fall) : none();
}
HWY_INLINE bool slides(const GranularPlanes& planes, PageId p) { return planes.pages[p].slides == planes.tick + 1; }
HWY_INLINE bool accepts(const GranularPlanes& planes, PageId p) { return planes.pages[p].accepts == planes.tick + 1; }

/// Grains that come by sliding to kSide.
template <int kSide>
HWY_INLINE V coming(const GranularPlanes& planes, PageId p, const std::array<PageId, 27>& around) {
  constexpr int kFrom = kSide ^ 2;
  const PageId beyond = around[kSidePage[kFrom]];
  const bool own = slides(planes, p), other = slides(planes, beyond);
  if (!own && !other) return none();
  return at_side<kFrom>(own ? load(planes.pages[p].slide[kSide]) : none(),
                        other ? load(planes.pages[beyond].slide[kSide]) : none());
}

void Accept(const GranularPlanes& planes, std::span<const PageId> pages) {
  for (const PageId p : pages) {
    GranularPage& page = planes.pages[p];
    const std::array<PageId, 27>& around = planes.around[p];
    V in[kSides] = {coming<0>(planes, p, around), coming<1>(planes, p, around), coming<2>(planes, p, around),
                    coming<3>(planes, p, around)};
    page.accepts = 0;
    if (!any((in[0] | in[1]) | (in[2] | in[3]))) continue;
    const V falling = at_above(decided_fall(planes, p), decided_fall(planes, around[kAbove]));
    for (V& i : in) i = without(i, falling);
    // Most voxels are wanted once.
    const V once = in[0] | in[1], twice = in[0] & in[1], rest = in[2] | in[3];
    if (any(twice | (in[2] & in[3]) | (once & rest))) {
      Order order;
      order_of(planes.hash[p], planes.tick, OrderStream::accept, order);
      V chosen[kSides];
      choose(in, order, chosen);
      for (int d = 0; d < kSides; ++d) store(page.accept[d], chosen[d]);
    } else {
      for (int d = 0; d < kSides; ++d) store(page.accept[d], in[d]);
    }
    page.accepts = planes.tick + 1;
  }
}

template <int kSide>
HWY_INLINE V leaving(const GranularPlanes& planes, PageId p, const std::array<PageId, 27>& around) {
  const PageId beyond = around[kSidePage[kSide]];
  const bool own = accepts(planes, p), other = accepts(planes, beyond);
  if (!own && !other) return none();
  return load(planes.pages[p].slide[kSide]) & at_side<kSide>(own ? load(planes.pages[p].accept[kSide]) : none(),
                                                             other ? load(planes.pages[beyond].accept[kSide]) : none());
}

/// Grains of the page that go, by where; those that come; returns all voxels that change.
struct Moves {
  V out_below, in_above, out[kSides], in[kSides], gone, come;
};
HWY_INLINE void moves_of(const GranularPlanes& planes, PageId p, Moves& m) {
  const std::array<PageId, 27>& around = planes.around[p];
  m.out_below = decided_fall(planes, p);
  m.in_above = at_above(m.out_below, decided_fall(planes, around[kAbove]));
  m.gone = m.out_below;
  m.come = m.in_above;
  const bool out = slides(planes, p), in = accepts(planes, p);
  m.out[0] = out ? leaving<0>(planes, p, around) : none();
  m.out[1] = out ? leaving<1>(planes, p, around) : none();
  m.out[2] = out ? leaving<2>(planes, p, around) : none();
  m.out[3] = out ? leaving<3>(planes, p, around) : none();
  for (int d = 0; d < kSides; ++d) {
    m.in[d] = in ? load(planes.pages[p].accept[d]) : none();
    m.gone = m.gone | m.out[d];
    m.come = m.come | m.in[d];
  }
}

void FindMoves(const GranularPlanes& planes, std::span<const PageId> pages, PageMoves* moves) {
  for (size_t n = 0; n < pages.size(); ++n) {
    Moves m;
    moves_of(planes, pages[n], m);
    store(moves[n].out_below, m.out_below);
    store(moves[n].in_above, m.in_above);
    for (int d = 0; d < kSides; ++d) {
      store(moves[n].out[d], m.out[d]);
      store(moves[n].in[d], m.in[d]);
    }
  }
}

uint64_t Apply(const GranularPlanes& planes, std::span<const PageId> pages, world::LeafMask* moved) {
  uint64_t count = 0;
  for (size_t n = 0; n < pages.size(); ++n) {
    const PageId p = pages[n];
    Moves m;
    moves_of(planes, p, m);
    const V change = m.gone | m.come;
    store(moved[n], change);
    if (!any(change)) continue;
    const V grain = without(load(planes.grain[p]), m.gone) | m.come;
    store(planes.grain[p], grain);
    store(planes.occupied[p], grain | load(planes.closed[p]));
    for (const uint64_t w : moved[n].word) count += hwy::PopCount(w);
  }
  return count;
}

void RandomOrderOf(uint64_t page_hash, uint64_t tick, OrderStream stream, RandomOrder& into) {
  Order order;
  order_of(page_hash, tick, stream, order);
  store(into.start_low, order.start_low);
  store(into.start_high, order.start_high);
  store(into.reversed, order.reversed);
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

HWY_EXPORT(Decide);
HWY_EXPORT(Accept);
HWY_EXPORT(FindMoves);
HWY_EXPORT(Apply);
HWY_EXPORT(RandomOrderOf);

void decide_pages(const GranularPlanes& planes, std::span<const PageId> pages) {
  HWY_DYNAMIC_DISPATCH(Decide)(planes, pages);
}
void accept_pages(const GranularPlanes& planes, std::span<const PageId> pages) {
  HWY_DYNAMIC_DISPATCH(Accept)(planes, pages);
}
void find_moves(const GranularPlanes& planes, std::span<const PageId> pages, PageMoves* moves) {
  HWY_DYNAMIC_DISPATCH(FindMoves)(planes, pages, moves);
}
uint64_t apply_pages(const GranularPlanes& planes, std::span<const PageId> pages, world::LeafMask* moved) {
  return HWY_DYNAMIC_DISPATCH(Apply)(planes, pages, moved);
}
RandomOrder random_order(uint64_t page_hash, uint64_t tick, OrderStream stream) {
  RandomOrder order;
  HWY_DYNAMIC_DISPATCH(RandomOrderOf)(page_hash, tick, stream, order);
  return order;
}

uint16_t roughness(uint64_t page_hash, int index) {
  return static_cast<uint16_t>(world::hash_combine(page_hash, static_cast<uint64_t>(index)) >> 48);
}

}  // namespace sim
#endif
