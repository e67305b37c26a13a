/// Bodies and particles of one world, as its scene asks for them: what isn't asked for is never made.
///
/// Their tick follows that of the rules of matter, in the blocks as they are then, which they don't change. Bodies move
/// one after the other on one thread (see bodies.h: each meets the others where they are then); particles on all.
///
/// Bodies are part of the state and saved with the world, bit for bit. Particles hold no mass and nothing depends on
/// them: they are in no hash and no save, and a world that is loaded begins without any.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "sim/bodies/bodies.h"
#include "sim/bodies/particles.h"
#include "world/world.h"

namespace sim {

class Inhabitants {
 public:
  /// Null where the world asks for neither. Fails where a property is out of its range or a kind unknown. The world
  /// must outlive it and stay where it is.
  static world::Result<std::unique_ptr<Inhabitants>> make(const world::World& world, const SimKnobs& knobs,
                                                          uint64_t seed);
  /// The store must be up to date.
  void step(uint64_t tick);
  /// As Matter's: a body whose way meets the region waits.
  void set_unloaded(world::RegionPos r, bool unloaded);
  /// Whether a body moves, or has not been looked at.
  bool awake() const { return bodies_ && awake_; }

  struct Count {
    bool made = false;
    uint64_t moved = 0;  // sum over all ticks, of bodies that were awake or particles
    double ms = 0;
    size_t bytes = 0;
  };
  Count bodies_count() const;
  Count particles_count() const;
  const Bodies* bodies() const { return bodies_.get(); }
  const Particles* particles() const { return particles_.get(); }

  /// See Matter: only where there are particles already.
  std::unique_ptr<Particles> release_particles() { return std::move(particles_); }
  void adopt_particles(std::unique_ptr<Particles> particles) {
    if (particles_) particles_ = std::move(particles);
  }
  /// Of the bodies: as text, empty where there are none; and back.
  std::string state() const;
  world::Status restore(std::string_view state);

 private:
  Inhabitants(const world::World& world, const SimKnobs& knobs, uint64_t seed);
  void spawn(uint64_t tick);

  const world::World& world_;
  BodySettings body_settings_;
  ParticleSettings particle_settings_;
  std::unique_ptr<Bodies> bodies_;
  std::unique_ptr<Particles> particles_;
  std::vector<int> kind_of_;  // by source
  bool awake_ = true;
  Count bodies_count_, particles_count_;
};

}  // namespace sim
