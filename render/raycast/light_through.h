/// What of light from far away arrives along a straight ray through what isn't opaque: see-through blocks let through
/// what they do of each band, straight on; shapes of blocks hide it. Opaque blocks are for others to ask for. The twin
/// of the rasterizer's shading/sun_blockers.glsl.h, by the formulas of render/see_through.shared.h; the light's
/// direction is the one that it has in air, as through a pile of plates. error  light goes straight where water and
/// glass would bend it, and never gathers to caustics: against paths
#pragma once

#include <span>

#include "render/image/image.h"
#include "render/raycast/straight_walk.h"
#include "world/proxies/proxy.h"

namespace render {

struct LightBlockers {
  const world::MaskWalker& occupied;
  const SeeThroughKinds& kinds;
  std::span<const uint8_t> cubes;    // hiding_cubes()
  const world::BlockShapes* shapes;  // null: all voxels are cubes
};

/// `direction` of the ray: unit. `from`: the part of a shape in the ray's first voxel that it starts on, or kNoPart.
Rgb light_through(const LightBlockers& blockers, const world::GridRay& ray, int from, LeafCache& blocks);

}  // namespace render
