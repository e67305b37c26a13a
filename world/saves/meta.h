/// A world's surroundings and metadata as the rows of the table `meta`, and back. Internal to world/saves.
#pragma once

#include <map>
#include <string>

#include "world/world.h"

namespace world {

/// What belongs into `meta` beside the save's own keys, which begin with "save.".
std::map<std::string, std::string> meta_of(const World& world);
/// False where the row is none of those, or its numbers are out of range.
bool read_meta_row(World& world, const std::string& key, const std::string& value);

}  // namespace world
