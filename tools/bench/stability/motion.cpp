/// Bodies, oscillators and clocks: P and TM of the catalogue.
#include <cmath>

#include "sim/bodies/bodies.h"
#include "sim/bodies/integrators.h"
#include "sim/clock.h"
#include "tools/bench/stability.h"

namespace tools {

namespace {

sim::BodyDescription smooth_box(world::WorldPoint foot, world::Vec3d size, world::Vec3d velocity) {
  sim::BodyDescription d;
  d.foot = foot, d.size = size, d.velocity = velocity;
  d.friction = 0, d.drag_coefficient = 0;
  return d;
}

Result<double> tunnelled() {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{200, -20, -20}, {200, 20, 20}}, w.palette->find("stone").value());
  TRY_STATUS(w.store.apply(batch));
  sim::BodySettings settings;
  settings.gravity = 0;
  double worst = 0;
  for (const double speed : {10.0, 76.0, 1e3, 3333.3, 1e4}) {
    sim::Bodies bodies(w.store);
    TRY(const sim::BodyId id,
        bodies.add(smooth_box(world::WorldPoint::from(0, 0, 0), {0.25, 0.25, 0.25}, {speed, 0, 0})));
    for (int i = 0; i < static_cast<int>(200 / speed * 60) + 3; ++i) bodies.step(settings);
    worst = std::max(worst, std::abs(sim::from_fixed(bodies.find(id)->box.max(0)) - 200));
  }
  return worst;
}
/// As far as a box is past the wall that is moved first and tested then.
double tunnelled_naive() {
  double worst = 0;
  for (const double speed : {76.0, 1e4}) {
    double x = 0;
    for (int i = 0; i < static_cast<int>(200 / speed * 60) + 3 && !(x > 200 && x < 201); ++i) x += speed / 60;
    worst = std::max(worst, x - 201);
  }
  return worst;
}

Result<double> rest_moves() {
  constexpr int32_t kFar = (1 << 30) - 8192;
  world::World w(world::standard_blocks());
  const world::VoxelPos origin{kFar, kFar / 8 * 7, -kFar};
  world::EditBatch batch;
  batch.fill({origin + world::VoxelPos{-8, -3, -8}, origin + world::VoxelPos{8, -1, 8}},
             w.palette->find("stone").value());
  TRY_STATUS(w.store.apply(batch));
  sim::Bodies bodies(w.store);
  world::WorldPoint foot = world::WorldPoint::from(0.3, 0, 0.7);
  foot.voxel = foot.voxel + origin;
  TRY(const sim::BodyId id, bodies.add(smooth_box(foot, {0.6, 1.8, 0.6}, {0, 0, 0})));
  const sim::BodyBox before = bodies.find(id)->box;
  double moved = 0;
  for (int i = 0; i < 100'000; ++i) {
    if (i % 16 == 0) bodies.set_velocity(id, {0, -1e-3, 0});  // else it sleeps, and shows nothing
    bodies.step({});
    moved += !(bodies.find(id)->box == before);
  }
  return moved;
}

double energy_drift(sim::Integrator integrator) {
  constexpr double dt = 1.0 / 60;
  sim::Motion<double> m{1, 0};
  double worst = 0;
  for (int n = 0; n < 60000; ++n) {
    m = sim::integrate(integrator, m, dt, [](double x, double) { return -x; });
    worst = std::max(worst, std::abs(m.position * m.position + m.velocity * m.velocity - 1));
  }
  return worst;
}

/// Seconds that a clock is off after sixty million ticks of 1/60 s.
double clock_drift(bool as_float) {
  constexpr uint64_t kTicks = 60'000'000;
  if (as_float) {
    float seconds = 0;
    for (uint64_t i = 0; i < kTicks; ++i) seconds += 1.0f / 60;
    return std::abs(double{seconds} - kTicks / 60.0);
  }
  return std::abs(sim::seconds_at(kTicks) - kTicks / 60.0);
}

}  // namespace

void add_stability_motion(std::vector<StabilityCase>& cases) {
  cases.push_back({"P4", "nothing passes a wall of a metre, up to 10 km/s", "m", 0, "exact sweeps",
                   [](BenchContext&) { return tunnelled(); }, tunnelled_naive});
  cases.push_back({"P2", "what stands stays where it is at the world's border", "ticks that moved it", 0, "fixed point",
                   [](BenchContext&) { return rest_moves(); }});
  cases.push_back({"P9", "an oscillator keeps its energy for 1000 s", "relative", 1.0 / 3600, "dt^2, second order",
                   [](BenchContext&) -> Result<double> { return energy_drift(sim::Integrator::velocity_verlet); },
                   [] { return energy_drift(sim::Integrator::explicit_euler); }});
  cases.push_back({"TM2", "a clock doesn't drift in sixty million ticks", "s", 0, "whole numbers",
                   [](BenchContext&) -> Result<double> { return clock_drift(false); },
                   [] { return clock_drift(true); }});
}

}  // namespace tools
