/// What moves: bodies and particles. Each group of rows is a file in tools/bench/matter.
#include "tools/bench/matter/body_rows.h"

namespace tools {

void add_suite_matter(Registry& registry) { add_body_rows(registry); }

}  // namespace tools
