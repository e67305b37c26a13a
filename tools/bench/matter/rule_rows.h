/// Rows of the suite `matter` about the rules of grains and liquids (sim/matter/rules).
#pragma once

#include "tools/bench/benchmark.h"

namespace tools {

void add_rule_rows(Registry& registry);

}  // namespace tools
