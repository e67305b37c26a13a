/// The knobs of simulation, each declared once in sim/knobs.def. Passed to what needs them, never global.
#pragma once

#include "sim/bodies/integrators.h"
#include "sim/matter/heat_schemes.h"
#include "sim/matter/liquid_models.h"
#include "world/base/knobs.h"

namespace sim {

struct SimKnobs {
#define KNOB(name, type, fast, usual, exact, unit, what) type name = usual;
#define RANGE(name, low, high)
#include "sim/knobs.def"
#undef KNOB
#undef RANGE
};

/// One row for each knob, in order of declaration.
const world::KnobTable<SimKnobs>& sim_knobs();

}  // namespace sim
