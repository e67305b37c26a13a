/// Pictures of heights <-> worlds; the mapping is described in png_height.cpp.
#pragma once

#include <span>

#include "world/formats/format.h"

namespace world {

Result<World> world_from_height_png(std::span<const uint8_t> bytes, const std::string& name,
                                    const ImportOptions& options, ImportReport& report);
const Format& png_height_format();

}  // namespace world
