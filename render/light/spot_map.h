/// The shadow map of one spot light, made by rays through the grid: what luminaire_shadow=map reads in place of a ray a
/// point.
///
/// cost    4 bytes and a ray a texel, once for each edit
/// error   shadows' edges are right to a texel; light leaks below what is thinner than the bias
#pragma once

#include <vector>

#include "render/light/spot_map.shared.h"
#include "world/luminaires/kinds.h"
#include "world/store/ray_stream.h"

namespace render {

/// Whether a luminaire can have one: a spot, with or without a slide, that isn't too wide.
bool has_spot_map(const world::Luminaire& luminaire);

/// Distances from the light to the first opaque voxel, m, by row; far where there is none.
std::vector<float> spot_map(const world::Luminaire& luminaire, const world::RayStream& opaque, int texels);

}  // namespace render
