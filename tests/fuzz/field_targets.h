/// The targets of fields, heights, surfaces and points; targets() holds them too.
#pragma once

#include "tests/fuzz/targets.h"

namespace world::fuzz {

std::vector<Target> field_targets();

}  // namespace world::fuzz
