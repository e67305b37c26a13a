/// MagicaVoxel .vox -> world; the mapping is described in vox.cpp.
#pragma once

#include "world/formats/format.h"
#include "world/formats/vox/vox_file.h"

namespace world {

/// The world of a parsed file. `name` is for errors.
Result<World> world_from_vox(const vox::File& file, const std::string& name, const ImportOptions& options,
                             ImportReport& report);
const Format& vox_format();

}  // namespace world
