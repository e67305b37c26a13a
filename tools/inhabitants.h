/// Bodies and particles of a simulation as a picture's records.
#pragma once

#include <memory>
#include <vector>

#include "render/backend.h"
#include "sim/matter/matter.h"

namespace tools {

class InhabitantRecords {
 public:
  /// Takes them as they are now, relative to `origin`: near the camera, so that floats do.
  void take(const sim::Matter& matter, world::VoxelPos origin);
  /// Valid until the next take().
  render::Inhabitants view() const { return {origin_, particles_, bodies_}; }
  /// The same at a part of the way from the tick before to this one, [0, 1]. Valid until the next call, or take().
  render::Inhabitants view_at(double part);
  bool empty() const { return particles_.empty() && bodies_.empty(); }

 private:
  world::VoxelPos origin_;
  std::vector<render::ParticleRecord> particles_;
  std::vector<render::BodyRecord> bodies_;
  std::vector<glm::vec3> bodies_way_;  // of each in the last tick, m
  std::vector<render::ParticleRecord> particles_between_;
  std::vector<render::BodyRecord> bodies_between_;
};

/// Clouds are where the wind has taken them by that tick of the world.
void set_cloud_drift(world::Environment& environment, uint64_t tick);

/// The world's matter after `ticks` more of them, written back into the world; null where none are asked for and no
/// body stands in it. What it holds beside blocks goes on from the world's saved state; clouds drift on.
world::Result<std::unique_ptr<sim::Matter>> simulate_before(world::World& world, uint64_t ticks);

}  // namespace tools
