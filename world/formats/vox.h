/// MagicaVoxel .vox -> world; the mapping is described in vox.cpp.
#pragma once

#include "world/formats/format.h"
#include "world/formats/vox/vox_file.h"

namespace world {

/// The world of a parsed file. `name` is for errors.
Result<World> world_from_vox(const vox::File& file, const std::string& name, const ImportOptions& options,
                             ImportReport& report);
/// The block of one entry of the palette.
Block block_of_colour(int colour, vox::Colour c, const vox::Dictionary& material);

/// World -> .vox: models of at most 256^3, placed by a scene graph; see vox/write.cpp.
Status write_vox(const World& world, const std::filesystem::path& path);
std::vector<std::string> vox_losses(const World& world);
/// What _emit = 1 at _flux = 0 means; see the head of vox.cpp.
constexpr double kVoxEmittedWatts = 3600;

const Format& vox_format();

}  // namespace world
