/// A file that is nothing but a fog volume, as pictures show it.
#pragma once

#include "world/world.h"

namespace world {

/// True of what import makes of a fog volume: a block where it is active, so that it can be counted and exported, and
/// its numbers as the layer `density`.
bool is_fog(const World& world);
/// Makes of it what a picture should show: a density_grid medium over the layer, as thick as a cloud, with air in the
/// place of the block. Where media sample densities already, they stay as they are. Other worlds stay too.
Status show_fog(World& world);

}  // namespace world
