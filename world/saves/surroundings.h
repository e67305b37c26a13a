/// What stands in a world beside its voxels - luminaires, media, meshes, cameras, the knobs of its pictures, and what
/// it asks of the simulation - as rows of the table `meta`: TOML, a table a record, some hundred records a row. Numbers
/// are written so that the same bits are read back, and what has its usual value is left out. What the simulation holds
/// is text of its own, a row "scene.state.PART" a part. Internal to world/saves.
#pragma once

#include <map>
#include <string>

#include "world/saves/assets.h"
#include "world/world.h"

namespace world {

/// Adds the rows, whose keys begin with "scene."; and the assets that they name, by their parts.
void put_surroundings(const World& world, std::map<std::string, std::string>& rows,
                      std::map<std::vector<int64_t>, Asset>& assets);

/// Takes in one row. Rows come in the order of their keys, after the palette: meshes name media and blocks.
/// Density grids over the world's own layer stay without a field. `where` is what messages begin with.
Status read_surroundings(World& world, const std::string& key, const std::string& text, const std::string& where,
                         AssetReader& assets);

}  // namespace world
