/// Clouds as pictures ask for them: the record of clouds.shared.h, made of an Environment.
#pragma once

#include "world/scenes/clouds.shared.h"
#include "world/scenes/environment.h"
#include "world/space/coords.h"

namespace world {

/// Places are then relative to the corner of the voxel `from`; the sun and the sky are the environment's.
shared::CloudLayer cloud_layer(const Environment& environment, VoxelPos from);

}  // namespace world
