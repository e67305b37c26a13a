#include "tools/light.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "sim/light/flood.h"
#include "sim/light/flux.h"
#include "sim/light/sun.h"
#include "tools/away_regions.h"

namespace tools {

namespace {

/// Of the box that flux covers: up to 192 voxels a side, a second or two of work at 32 directions.
constexpr int32_t kMostFluxVoxels = 192;

/// The world's bounds and a voxel of air around them, cut to what flux covers around a point.
world::VoxelBox flux_box(const world::Store& store, world::VoxelPos around) {
  world::VoxelBox box = store.bounds();
  for (int a = 0; a < 3; ++a) {
    --box.min[a], ++box.max[a];
    if (box.max[a] - box.min[a] < kMostFluxVoxels) continue;
    box.min[a] = std::clamp(around[a] - kMostFluxVoxels / 2, box.min[a], box.max[a] - kMostFluxVoxels + 1);
    box.max[a] = box.min[a] + kMostFluxVoxels - 1;
  }
  return box;
}

}  // namespace

struct LightOfWorld::State {
  uint64_t store = 0, version = 0;
  // Levels.
  std::optional<sim::FloodLight> flood;
  std::optional<AwayRegions> away;
  world::LightChanges changes;
  // Flux, and what it was made for.
  int subscriber = 0;
  std::optional<sim::Flux> flux;
  world::Environment environment;
  world::VoxelBox box;
  int lamp_points = 0;
  world::SurfaceIrradiance irradiance;
};

LightOfWorld::LightOfWorld() : state_(std::make_unique<State>()) {}
LightOfWorld::~LightOfWorld() = default;

void LightOfWorld::stream(world::Streamer* streamer) {
  state_->flood.reset();
  state_->away.reset();
  if (streamer) state_->away.emplace(*streamer);
}

render::WorldLight LightOfWorld::follow_levels(const world::World& w, render::LightModel model) {
  State& s = *state_;
  s.flux.reset();
  if (!s.flood || s.flood->volume().model() != model) {
    s.flood.emplace(w.store, model);
    if (s.away) s.away->tell_all(*s.flood);
  }
  if (s.away) s.away->follow(*s.flood);
  const sim::LightReport done = s.flood->update();
  s.changes.note(s.flood->changed());
  if (!s.flood->changed().empty()) ++s.version;
  report_["bytes"] = s.flood->bytes();
  report_["leaves_computed"] = done.leaves_computed;
  report_["leaves_changed"] = done.leaves_changed;
  return {&s.flood->volume(), nullptr, s.version, &s.changes};
}

world::Result<render::WorldLight> LightOfWorld::follow_flux(const world::World& w, const world::WorldPoint& around,
                                                            const render::RenderKnobs& knobs) {
  State& s = *state_;
  s.flood.reset();
  const world::VoxelBox box = flux_box(w.store, around.voxel);
  const bool edited = s.flux && !w.store.take_dirty(s.subscriber).empty();
  if (!s.flux || edited || knobs.flux_lamp_points != s.lamp_points || box != s.box || w.environment != s.environment) {
    if (!s.flux) s.subscriber = w.store.subscribe();
    sim::Flux next(w.store, box, w.environment);
    const sim::LampLight lamps = knobs.flux_lamp_points > 0
                                     ? sim::lamps_on_surfaces(w.store, next.grid(), knobs.flux_lamp_points)
                                     : sim::LampLight{};
    next.set_direct(sim::sun_on_surfaces(w.store, next.grid(), w.environment), lamps);
    if (s.flux) next.continue_from(*s.flux);
    s.flux.emplace(std::move(next));
    s.lamp_points = knobs.flux_lamp_points, s.box = box, s.environment = w.environment;
  }
  TRY(const sim::FluxReport solved, s.flux->solve({knobs.flux_directions, knobs.flux_residual}));
  if (solved.sweeps > 0) s.irradiance = s.flux->surface_irradiance(), ++s.version;
  report_["bytes"] = solved.bytes + s.irradiance.bytes();
  report_["sweeps"] = solved.sweeps;
  report_["residual"] = solved.residual;
  report_["surfaces"] = solved.surfaces;
  return render::WorldLight{nullptr, &s.irradiance, s.version};
}

world::Result<render::WorldLight> LightOfWorld::follow(const world::World& w, const world::WorldPoint& around,
                                                       const render::RenderKnobs& knobs) {
  State& s = *state_;
  report_ = {};
  if (w.store.identity() != s.store) s.flux.reset(), s.flood.reset();
  s.store = w.store.identity();
  if (knobs.light_model == render::LightModel::none) {
    s.flux.reset(), s.flood.reset();
    return render::WorldLight{};
  }
  const auto start = std::chrono::steady_clock::now();
  report_["model"] = std::string(knob_choices(knobs.light_model)[static_cast<size_t>(knobs.light_model)]);
  render::WorldLight light;
  if (knobs.light_model == render::LightModel::flux) {
    TRY(light, follow_flux(w, around, knobs));
  } else {
    light = follow_levels(w, knobs.light_model);
  }
  report_["ms"] = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return light;
}

}  // namespace tools
