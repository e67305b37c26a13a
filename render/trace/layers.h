/// What a picture knows of each pixel beside its light: how far its surface is, which way it looks and what it is. By a
/// ray through the middle of each pixel, so that all backends' pictures have the same.
///
/// cost   a ray a pixel through a scene that is built for it
#pragma once

#include "render/backend.h"
#include "render/image/framebuffer.h"
#include "world/world.h"

namespace render {

/// Ids of what isn't a block, whose id is its number in the palette; 0 is what no surface is on.
constexpr uint32_t kMeshIds = 0x10000, kLuminaireIds = 0x20000;

/// Fills those of the buffers that are attached:
///   depth     metres along the camera's axis (d32), infinity where there is no surface
///   normal    of the surface, on the side that is seen; 0 0 0 in float32 where there is none
///   material  the block's id; kMeshIds + instance, kLuminaireIds + luminaire
world::Status draw_layers(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                          const Framebuffer& out);

/// The end of a picture by rays: bodies and particles over it, then the effects. `bodies_drawn`: it has them already.
world::Status finish_traced(const world::WorldView& view, const Inhabitants& inhabitants, const Camera& camera,
                            const RenderKnobs& knobs, Frame& frame, bool bodies_drawn = false);

}  // namespace render
