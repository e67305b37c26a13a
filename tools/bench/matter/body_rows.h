/// Rows of the suite `matter` about bodies and particles.
#pragma once

#include "tools/bench/benchmark.h"

namespace tools {

void add_body_rows(Registry& registry);

}  // namespace tools
