/// The granular rule on bit planes: what pages decide, accept and become. Internal to sim/matter.
///
///   fall     a grain whose lower neighbour can be entered goes there
///   slide    another, where it doesn't rest, to one of the four sides that it may take, by a random order
///   accept   a voxel that several grains want takes the one from above, else one by a random order
///
/// So each voxel gives at most one grain and takes at most one, and only where it held none: pairs that swap what they
/// hold, all disjoint. The result depends on no order of pages or voxels, and prefers no side.
///
/// A grain may slide to a side that can be entered, by the criterion of its place:
///   usual    where the voxel under the side can be entered too: heaps of slope 1
///   steep    and the one under that: slope 2
///   smooth   also where that is so one voxel further, and the way there can be entered: slope 1/2
///
/// cost   `loam bench run matter`
/// source Per Bak, Chao Tang, Kurt Wiesenfeld. Self-organized criticality: an explanation of 1/f noise. 1987 (slopes
///        above a critical one topple)
#pragma once

#include <cstdint>
#include <span>

#include "sim/matter/cells.h"
#include "sim/matter/sides.h"

namespace sim {

/// What is decided in a tick, by page. Masks are valid where the number beside them is the tick's plus 1.
struct GranularPage {
  world::LeafMask fall, slide[kSides];          // of grains: where they go
  world::LeafMask accept[kSides];               // of voxels: one that slides to this side comes in
  world::LeafMask smooth, steep;                // of places, for grains of the kind places_of
  uint64_t falls = 0, slides = 0, accepts = 0;  // ticks
  world::BlockId places_of = world::kAir;       // kAir: none yet; kMixedPlaces: each for the grain that is there
  bool any_smooth = false, any_steep = false;
  uint32_t version = 0;  // of the page's content when they were found
  uint32_t spill = 0;    // bit d: something slides out of the page to side d; bit 4: falls out
};
inline constexpr world::BlockId kMixedPlaces = 0xffff;

/// Everything by page.
struct GranularPlanes {
  const world::LeafMask* closed;
  world::LeafMask* grain;
  world::LeafMask* occupied;
  GranularPage* pages;
  const std::array<PageId, 27>* around;
  const uint64_t* hash;
  uint64_t tick;
};

/// Falls and slides of grains.
void decide_pages(const GranularPlanes& planes, std::span<const PageId> pages);
/// Which grains of the neighbours the pages take. Every page decided before.
void accept_pages(const GranularPlanes& planes, std::span<const PageId> pages);
/// Grains of a page that go, and voxels to which grains come.
struct PageMoves {
  world::LeafMask out_below, in_above, out[kSides], in[kSides];
};
/// Of each page; nothing moves yet.
void find_moves(const GranularPlanes& planes, std::span<const PageId> pages, PageMoves* moves);
/// Moves the grains' bits. moved[i]: voxels of pages[i] that changed; returns how many.
uint64_t apply_pages(const GranularPlanes& planes, std::span<const PageId> pages, world::LeafMask* moved);

/// Three random bits for each voxel of a page: where a round of choices starts (two), and which way it goes.
struct RandomOrder {
  world::LeafMask start_low, start_high, reversed;
};
enum class OrderStream : uint64_t { decide = 1, accept = 2 };
RandomOrder random_order(uint64_t page_hash, uint64_t tick, OrderStream stream);

/// 16 random bits of a place: grains are smooth there where they are less than smooth_of, steep below steep_of.
uint16_t roughness(uint64_t page_hash, int index);

}  // namespace sim
