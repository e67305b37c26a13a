/// What lies loose on the land stays where it was put: a new world is at rest.
#pragma once

#include <span>

#include "world/gen/landscape/canvas.h"
#include "world/gen/landscape/columns.h"
#include "world/gen/landscape/homestead.h"
#include "world/gen/landscape/terrain.h"

namespace world::landscape {

/// Puts rock or clay in place of grains that may fall or slide by the rule of sim/matter/rules/granular.cpp, whatever
/// their angle of repose. After everything else: reads the canvas, and beyond it the ground alone.
void hold_grains(const Columns& columns, const Terrain& terrain, std::span<const Homestead> homesteads,
                 const Materials& materials, Canvas& canvas);

/// What holds still in place of a grain: clay for mud, sandstone for sand, or the rock that is there. Other blocks
/// stay.
BlockId held(BlockId block, const Materials& materials, BlockId rock);

}  // namespace world::landscape
