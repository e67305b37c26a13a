#include "tools/inhabitants.h"

#include <cmath>
#include <cstdlib>

namespace tools {

void InhabitantRecords::take(const sim::Matter& matter, world::VoxelPos origin) {
  origin_ = origin;
  particles_.clear(), bodies_.clear(), bodies_way_.clear();
  if (const sim::Particles* particles = matter.particles()) {
    const world::VoxelPos from = particles->origin() - origin;
    const auto kinds = particles->kinds();
    for (size_t kind = 0; kind < kinds.size(); ++kind) {
      const sim::ParticleKind& k = kinds[kind];
      for (const uint32_t index : particles->blocks(static_cast<int>(kind))) {
        const sim::ParticleBlock& block = particles->block(index);
        for (int i = 0; i < block.count; ++i) {
          constexpr float kUnit = 1.0f / (1 << sim::kParticleFixedLog2);
          const auto at = [&](int axis) {
            return static_cast<float>(from[axis]) + static_cast<float>(block.at[axis][i]) * kUnit;
          };
          particles_.push_back({at(0), at(1), at(2), 0.5f * k.size_m, k.colour, k.opacity, k.radiance,
                                block.velocity[0][i], block.velocity[1][i], block.velocity[2][i]});
        }
      }
    }
  }
  if (const sim::Bodies* bodies = matter.bodies())
    for (const sim::Body& body : bodies->all()) {
      const world::Vec3d size = sim::from_fixed(body.box.size);
      const world::Vec3d low = sim::world_point(body.box.min) - world::WorldPoint{origin, world::Vec3d(0.0)};
      const glm::vec3 middle(low + 0.5 * size), half(0.5 * size);
      bodies_.push_back({middle.x, middle.y, middle.z, half.x, half.y, half.z, {}});
      // Wood is 700 kg/m^3, stone 2600: the lighter, the paler and browner.
      const auto heavy = static_cast<float>(std::min(body.described.density / 3000, 1.0));
      const world::WorldPoint from = sim::world_point(body.drawn_from);
      bodies_way_.emplace_back(sim::world_point(body.box.min) - from);
      bodies_.back().albedo = {0.65f - 0.35f * heavy, 0.5f - 0.2f * heavy, 0.3f};
    }
}

render::Inhabitants InhabitantRecords::view_at(double part) {
  const auto back = static_cast<float>(part - 1);
  const float back_s = back * static_cast<float>(sim::kMatterTick.seconds());
  particles_between_ = particles_, bodies_between_ = bodies_;
  for (render::ParticleRecord& p : particles_between_)
    p.x += back_s * p.velocity_x, p.y += back_s * p.velocity_y, p.z += back_s * p.velocity_z;
  for (size_t i = 0; i < bodies_between_.size(); ++i) {
    render::BodyRecord& b = bodies_between_[i];
    b.x += back * bodies_way_[i].x, b.y += back * bodies_way_[i].y, b.z += back * bodies_way_[i].z;
  }
  return {origin_, particles_between_, bodies_between_};
}

void set_cloud_drift(world::Environment& environment, uint64_t tick) {
  if (environment.clouds.cover > 0)
    environment.clouds.drifted = environment.clouds.drift * sim::seconds_at(tick, sim::kMatterTick);
}

world::Result<std::unique_ptr<sim::Matter>> simulate_before(world::World& world, uint64_t ticks) {
  const auto saved = world.metadata.find("simulated_ticks");
  const uint64_t before = saved == world.metadata.end() ? 0 : std::strtoull(saved->second.c_str(), nullptr, 10);
  if (before + ticks > 0) set_cloud_drift(world.environment, before + ticks);
  if (ticks == 0 && world.simulation.bodies.empty()) return std::unique_ptr<sim::Matter>();
  TRY(sim::MatterOptions options, sim::matter_options(world, world::Accuracy::usual));
  auto matter = std::make_unique<sim::Matter>(world, options);
  TRY_STATUS(matter->begin());
  for (uint64_t tick = 0; tick < ticks; ++tick) matter->step();
  matter->flush();
  return matter;
}

}  // namespace tools
