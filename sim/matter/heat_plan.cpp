#include "sim/matter/heat_plan.h"

#include <cmath>

#include <fmt/format.h>

namespace sim {

world::Result<HeatPlan> plan_heat(const SimKnobs& knobs, double largest_diffusivity) {
  const double speed = static_cast<double>(knobs.heat_speed);
  if (!(speed >= 0 && speed < 1e12))
    return world::usage_error(fmt::format("heat_speed is {}, but must be at least 0 and below 1e12", speed));
  if (knobs.heat_substeps < 0 || knobs.heat_substeps > kMostHeatSubsteps)
    return world::usage_error(
        fmt::format("heat_substeps is {}, but must be in [0, {}]", knobs.heat_substeps, kMostHeatSubsteps));
  if (knobs.heat_interval < 1 || knobs.heat_interval > kMostHeatInterval)
    return world::usage_error(
        fmt::format("heat_interval is {}, but must be in [1, {}]", knobs.heat_interval, kMostHeatInterval));
  HeatPlan plan;
  const double of_a_tick = largest_diffusivity * speed / kHeatTicksPerSecond;
  while (plan.interval < knobs.heat_interval && of_a_tick * (plan.interval + 1) <= kLargestStableRatio) ++plan.interval;
  const double dt = speed / kHeatTicksPerSecond * plan.interval, ratio = largest_diffusivity * dt;
  const bool is_explicit = knobs.heat_scheme == HeatScheme::explicit_steps;
  plan.substeps = std::max(knobs.heat_substeps, 1);
  // The last bits of ratio don't decide: what is 1/6 but for rounding is stable.
  const double needed = is_explicit ? std::ceil(ratio / kLargestStableRatio * (1 - 1e-12)) : 1;
  if (knobs.heat_substeps == 0) plan.substeps = static_cast<int>(std::max(std::min(needed, 1e6), 1.0));
  if (plan.substeps > kMostHeatSubsteps || needed > plan.substeps)
    return world::usage_error(fmt::format(
        "explicit heat needs {:.0f} substeps a step at heat_speed={}, {} are allowed: r would be {:.4g}, above 1/6; "
        "raise heat_substeps, lower heat_speed, or use heat_scheme=implicit",
        needed, speed, knobs.heat_substeps == 0 ? kMostHeatSubsteps : plan.substeps, ratio / plan.substeps));
  plan.dt = dt / plan.substeps;
  plan.ratio = ratio / plan.substeps;
  return plan;
}

}  // namespace sim
