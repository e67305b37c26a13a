/// Cubes of metals and of polished stone on plaster, under the sun and the sky: what subjects about gloss draw.
#pragma once

#include <memory>

#include "world/world.h"

namespace tools {

std::shared_ptr<world::World> metal_yard();

}  // namespace tools
