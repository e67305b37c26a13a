/// Rows of the suite `matter` about support.
#pragma once

#include "tools/bench/benchmark.h"

namespace tools {

void add_support_rows(Registry& registry);

}  // namespace tools
