/// How a tick of conduction is cut into steps.
#pragma once

#include "sim/knobs.h"
#include "world/base/errors.h"

namespace sim {

/// r = diffusivity * dt / h^2 of an explicit step, in three dimensions: beyond it differences between neighbours grow.
/// source Richard Courant, Kurt Friedrichs, Hans Lewy. On the partial difference equations of mathematical physics.
///        1928
inline constexpr double kLargestStableRatio = 1.0 / 6.0;
/// Ticks a second that heat_speed is told for.
inline constexpr double kHeatTicksPerSecond = 20;
inline constexpr int kMostHeatSubsteps = 4096;

struct HeatPlan {
  int substeps = 1;
  double dt = 0;     // of a substep, s
  double ratio = 0;  // r of a substep, for the largest diffusivity
};

/// Refuses heat_substeps that leave an explicit step above r = 1/6, and a heat_speed that is negative or asks for more
/// than kMostHeatSubsteps. `largest_diffusivity`: m^2/s.
world::Result<HeatPlan> plan_heat(const SimKnobs& knobs, double largest_diffusivity);

}  // namespace sim
