/// The sun on the surfaces of a flux grid: what it sends on each, where nothing opaque stands between.
///
/// error   one ray from the middle of a face: the edge of a shadow is right to half a voxel
/// cost    a ray a surface that looks towards the sun (world/store/parallel_rays.h)
#pragma once

#include <vector>

#include "sim/light/flux_grid.h"
#include "world/scenes/environment.h"
#include "world/units/quantity.h"

namespace sim {

/// W/m^2 by number of surface; empty where no sun shines.
std::vector<world::Irradiance3> sun_on_surfaces(const world::Store& store, const FluxGrid& grid,
                                                const world::Environment& environment);

}  // namespace sim
