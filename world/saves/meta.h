/// What a world holds beside blocks and layers as the rows of the table `meta`, and back: sun, sky and metadata here,
/// the rest in surroundings.h. Internal to world/saves.
#pragma once

#include <map>
#include <string>

#include "world/saves/assets.h"
#include "world/world.h"

namespace world {

/// What belongs into `meta` beside the save's own keys, which begin with "save."; and the assets that it names.
struct Meta {
  std::map<std::string, std::string> rows;
  std::map<std::vector<int64_t>, Asset> assets;
};
Meta meta_of(const World& world);
/// Rows come in the order of their keys, after the palette. `where` is what messages begin with.
Status read_meta_row(World& world, const std::string& key, const std::string& value, const std::string& where,
                     AssetReader& assets);

}  // namespace world
