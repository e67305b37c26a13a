/// A hash table of positions of regions or leaves, as shaders look places up: from region_hash() on, slot by slot, the
/// position and its place + 1; w = 0: free.
#pragma once

#include <bit>
#include <cstdint>
#include <span>

#include "render/raster/raster.shared.h"

namespace render::raster {

/// For so many positions: a power of 2, at least half of it free, so that each search ends.
constexpr uint32_t place_slots(size_t positions) { return std::bit_ceil(static_cast<uint32_t>(2 * positions + 1)); }

/// table: of place_slots(), starting with zeros. A position is added once.
template <class Position>
void add_place(std::span<ivec4> table, const Position& at, uint32_t place) {
  const size_t last = table.size() - 1;
  size_t slot = region_hash(at.x, at.y, at.z) & last;
  while (table[slot].w) slot = (slot + 1) & last;
  table[slot] = ivec4(at.x, at.y, at.z, static_cast<int>(place) + 1);
}

}  // namespace render::raster
