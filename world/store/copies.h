/// Stores made of other stores: the same elsewhere, or without one of its blocks.
#pragma once

#include "world/store/store.h"

namespace world {

/// Blocks and layers, moved. `offset`: each a multiple of kRegionSize; nothing may pass the world's border.
Store moved(const Store& from, VoxelPos offset, const BlockPalette& palette);

/// Blocks and layers, with air in the place of a block.
Store without_block(const Store& from, BlockId block, const BlockPalette& palette);

}  // namespace world
