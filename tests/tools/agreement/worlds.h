/// The worlds that rows of the table of agreement name: those that tests draw, shipped scenes, and files.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/backend.h"
#include "sim/matter/matter.h"
#include "tools/inhabitants.h"
#include "world/world.h"

namespace tools {

struct PicturedWorld {
  world::World world;
  std::vector<render::ParticleRecord> particles;
  std::vector<render::BodyRecord> bodies;
  std::unique_ptr<sim::Matter> matter;  // in place of both, where a scene is simulated
  InhabitantRecords records;

  /// Valid until the next call.
  render::Inhabitants inhabitants(const world::WorldPoint& eye);
};

/// After so many ticks of its matter. Nothing where its file is not on this machine.
world::Result<std::optional<PicturedWorld>> pictured_world(const std::string& name, int ticks);

}  // namespace tools
