/// A world of one's own to edit: benchmarks share theirs.
#pragma once

#include "world/world.h"

namespace tools {

/// The regions within the box (inclusive, in regions), their blocks and the palette; nothing else.
world::World copy_regions(const world::World& from, world::RegionPos min, world::RegionPos max);

}  // namespace tools
