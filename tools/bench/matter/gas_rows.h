/// Rows of the suite `matter` about gases (sim/matter/rules/gas.cpp).
#pragma once

#include "tools/bench/benchmark.h"

namespace tools {

void add_gas_rows(Registry& registry);

}  // namespace tools
