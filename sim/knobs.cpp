#include "sim/knobs.h"

#include "sim/matter/heat_plan.h"

namespace sim {

const world::KnobTable<SimKnobs>& sim_knobs() {
  static const world::KnobTable<SimKnobs> table = [] {
    world::KnobTable<SimKnobs> t;
#define KNOB(name, type, fast, usual, exact, unit, what) \
  t.add<type>(#name, &SimKnobs::name, fast, usual, exact, unit, what);
#define RANGE(name, low, high) t.limit<decltype(SimKnobs::name)>(#name, low, high);
#include "sim/knobs.def"
#undef KNOB
#undef RANGE
    return t;
  }();
  return table;
}

}  // namespace sim
