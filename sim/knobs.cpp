#include "sim/knobs.h"

namespace sim {

const world::KnobTable<SimKnobs>& sim_knobs() {
  static const world::KnobTable<SimKnobs> table = [] {
    world::KnobTable<SimKnobs> t;
#define KNOB(name, type, fast, usual, exact, unit, what) \
  t.add<type>(#name, &SimKnobs::name, fast, usual, exact, unit, what);
#include "sim/knobs.def"
#undef KNOB
    return t;
  }();
  return table;
}

}  // namespace sim
