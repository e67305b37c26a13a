/// Forms of blocks: the same thing by what bears it and by the side that it looks to. Sides are told by names, as those
/// of Loam ("torch_east") and of Minecraft ("oak_stairs[facing=east,half=top]") say them; east is +x, south +z.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "tools/play/pick.h"
#include "world/proxies/proxy.h"
#include "world/world.h"

namespace tools {

/// What is placed where `target` says, of a block that something has to bear: the form of it that leans on the side
/// that was pointed at ("torch_east"), else the one that stands on what is below, else one that leans on any wall
/// there. None where nothing bears it. Other blocks are placed as they are.
std::optional<world::BlockId> form_beside(const world::World& world, const world::BlockShapes& shapes,
                                          world::BlockId block, const Pick& target);
/// The block of which this one is the form at a wall; itself, where it is none.
world::BlockId upright_form(const world::BlockPalette& palette, const world::BlockShapes& shapes, world::BlockId block);

/// The batch, and after it the end of what it takes the bearer from: torches on a wall that is broken, flowers on
/// ground that is dug away. What floated before stays.
world::EditBatch with_what_falls(const world::World& world, const world::BlockShapes& shapes, world::EditBatch batch);

/// Of each block the form that looks the other way; itself, where the palette has none.
struct TurnedForms {
  TurnedForms() = default;
  explicit TurnedForms(const world::BlockPalette& palette);
  std::vector<world::BlockId> turned;                  // by a quarter: what looked along x looks along z
  std::array<std::vector<world::BlockId>, 3> flipped;  // by axis
};

}  // namespace tools
