/// A lumpy cloud of 48 voxels a side that subjects about media and about surfaces of densities share.
#pragma once

#include <memory>

#include "world/base/errors.h"
#include "world/media/medium.h"
#include "world/space/coords.h"

namespace tools {

constexpr int kCloudLeaves = 6;  // a side

/// In [0, 1.4) at a voxel of [0, 48)^3: a ball that thins outwards, in waves.
float cloud_density(world::VoxelPos v);
world::Result<std::shared_ptr<const world::DensityField>> cloud_field();

}  // namespace tools
