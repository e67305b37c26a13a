/// A block state as later versions of Minecraft write it: {Name: "minecraft:oak_log", Properties: {axis: "y"}}.
#pragma once

#include <optional>
#include <string>

#include "world/formats/nbt/nbt.h"

namespace world::nbt {

/// Reads the compound that `in` stands in: "minecraft:oak_log[axis=y]", properties sorted by name. Nothing where it
/// has no name or is damaged.
std::optional<std::string> read_block_state(Reader& in);

}  // namespace world::nbt
