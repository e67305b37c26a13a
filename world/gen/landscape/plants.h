/// Trees, reeds, grass and flowers. A plant's place is a hash of its cell, and each region draws its part of every
/// plant that touches it, always in the order of the cells, so borders don't show.
#pragma once

#include <span>

#include "world/gen/landscape/canvas.h"
#include "world/gen/landscape/columns.h"
#include "world/gen/landscape/homestead.h"
#include "world/gen/landscape/terrain.h"

namespace world::landscape {

/// `density` in [0, 1]: the share of places for a tree that have one.
void draw_trees(uint64_t seed, double density, const Columns& columns, const Terrain& terrain,
                std::span<const Homestead> homesteads, const Materials& materials, Canvas& canvas);
/// After everything else: what grows only where its ground is still open.
void draw_undergrowth(uint64_t seed, const Columns& columns, const Materials& materials, Canvas& canvas);

}  // namespace world::landscape
