/// Rows of the suite `matter` about heat, reactions and fire.
#pragma once

#include "tools/bench/benchmark.h"

namespace tools {

void add_heat_rows(Registry& registry);

}  // namespace tools
