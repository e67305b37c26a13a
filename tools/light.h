/// The light that a picture's knobs ask for: simulated for its world and kept until either changes.
#pragma once

#include <memory>
#include <string>

#include <nlohmann/json.hpp>

#include "render/backend.h"
#include "world/streaming/streamer.h"
#include "world/world.h"

namespace tools {

class LightOfWorld {
 public:
  LightOfWorld();
  ~LightOfWorld();
  /// Brings the light up to date and returns it; nothing where knobs.light_model is none. `around` is where light
  /// matters where a model can't cover all of the world.
  world::Result<render::WorldLight> follow(const world::World& world, const world::WorldPoint& around,
                                           const render::RenderKnobs& knobs);
  /// The world is streamed from now on: what is away gives no light and takes none, in models of levels. The streamer
  /// must outlive this; null: all of the world is there.
  void stream(world::Streamer* streamer);
  /// What the last follow() cost: model, ms, bytes, and what the model says of itself.
  const nlohmann::json& report() const { return report_; }

 private:
  render::WorldLight follow_levels(const world::World& world, render::LightModel model);
  world::Result<render::WorldLight> follow_flux(const world::World& world, const world::WorldPoint& around,
                                                const render::RenderKnobs& knobs);
  struct State;
  std::unique_ptr<State> state_;
  nlohmann::json report_;
};

}  // namespace tools
