/// Rows of suite `store` about whole leaves: blocks and layers as a simulation reads and writes them.
#pragma once

#include "tools/bench/benchmark.h"

namespace tools {

void add_leaf_rows(Registry& registry);

}  // namespace tools
