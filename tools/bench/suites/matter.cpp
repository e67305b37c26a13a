/// What moves: grains, liquids, bodies and particles; heat, reactions and fire. Each group of rows is a file in
/// tools/bench/matter.
#include "tools/bench/matter/body_rows.h"
#include "tools/bench/matter/gas_rows.h"
#include "tools/bench/matter/heat_rows.h"
#include "tools/bench/matter/rule_rows.h"
#include "tools/bench/matter/support_rows.h"

namespace tools {

void add_suite_matter(Registry& registry) {
  add_rule_rows(registry);
  add_gas_rows(registry);
  add_body_rows(registry);
  add_heat_rows(registry);
  add_support_rows(registry);
}

}  // namespace tools
