/// A world of one's own to edit: benchmarks share theirs; and how large it is.
#pragma once

#include "world/world.h"

namespace tools {

/// The regions within the box (inclusive, in regions), their blocks and the palette; nothing else.
world::World copy_regions(const world::World& from, world::RegionPos min, world::RegionPos max);

/// The whole regions that hold a store's blocks.
world::VoxelBox region_box(const world::Store& store);

}  // namespace tools
