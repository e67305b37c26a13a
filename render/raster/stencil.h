/// A stencil beside the depth image: a byte a pixel that says where a later draw of the same picture may draw. Made by
/// the passes that need one (Targets::stencil), in an image of its own, so that pictures without have none.
#pragma once

#include "render/raster/pass.h"

namespace render::raster {

/// Makes the picture's stencil where there is none yet.
world::Status fit_stencil(PassContext& context);
/// Before its first use in a picture: what it held is lost.
void discard_stencil(VkCommandBuffer commands, const Targets& targets);
/// Between two draws.
void stencil_barrier(VkCommandBuffer commands, const Targets& targets);
/// Draws into these colours, and into the stencil or where it says. `clear_stencil`, `clear_colour`: both to 0 first.
void begin_with_stencil(VkCommandBuffer commands, const Targets& targets, std::span<const VkImageView> colour,
                        bool clear_stencil, bool clear_colour);

/// A state that writes 1 into the stencil, or one that draws only where it holds `value`. No depth.
GraphicsState into_stencil(const Targets& targets);
GraphicsState where_stencil(const Targets& targets, uint32_t value);

}  // namespace render::raster
