/// Small worlds of benchmarks are boxes of blocks, one over the other.
#pragma once

#include <string_view>

#include "world/world.h"

namespace tools {

/// Both corners inclusive. The palette must have a block of that name.
inline void fill_block(world::World& world, const world::VoxelBox& box, std::string_view block) {
  world::EditBatch batch;
  batch.fill(box, world.palette->find(block).value());
  CHECK(world.store.apply(batch).ok());
}

}  // namespace tools
