/// Rows of suite `store` about saves, regions at rest and worlds larger than memory.
#pragma once

#include "tools/bench/benchmark.h"

namespace tools {

void add_save_rows(Registry& registry);

}  // namespace tools
