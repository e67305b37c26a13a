/// Which ticks conduct heat, and how such a step is cut into parts.
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
inline constexpr int kMostHeatSubsteps = 4096, kMostHeatInterval = 64;

struct HeatPlan {
  int interval = 1;  // ticks that a step stands for; it is done in the last of them
  int substeps = 1;  // of a step
  double dt = 0;     // of a substep, s
  double ratio = 0;  // r of a substep, for the largest diffusivity
};

/// The interval is heat_interval, or as many ticks as leave r of a step at 1/6 or below: more would save nothing.
/// Refuses a heat_interval out of [1, kMostHeatInterval], heat_substeps that leave an explicit step above r = 1/6, and
/// a heat_speed that is negative or asks for more than kMostHeatSubsteps. `largest_diffusivity`: m^2/s.
world::Result<HeatPlan> plan_heat(const SimKnobs& knobs, double largest_diffusivity);

}  // namespace sim
