/// What a scene or a world says of how it is simulated. The names are those of the simulation, which resolves them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "world/space/world_point.h"

namespace world {

/// A box that falls, slides and comes to rest.
struct BodyRequest {
  std::string name;
  WorldPoint position;              // the middle of its bottom
  Vec3d size{1, 1, 1};              // m, each in [1/256, 64]
  Vec3d velocity{0};                // m/s
  double density_kg_per_m3 = 1000;  // [1, 1e5]
  double restitution = 0;           // of speed, [0, 1]
  double friction = 0.5;            // Coulomb's coefficient, [0, 10]

  friend bool operator==(const BodyRequest& a, const BodyRequest& b) {
    return a.name == b.name && a.position.voxel == b.position.voxel && a.position.fraction == b.position.fraction &&
           a.size == b.size && a.velocity == b.velocity && a.density_kg_per_m3 == b.density_kg_per_m3 &&
           a.restitution == b.restitution && a.friction == b.friction;
  }
};

/// Where particles come from, all the time: evenly in a box.
struct ParticleSource {
  std::string kind;  // a row of sim/bodies/particles.toml
  VoxelBox box;
  double per_s = 0;       // particles in a second of the world, >= 0
  Vec3d velocity{0};      // m/s, at first
  double spread_mps = 0;  // and so much in any direction, >= 0
  std::string brings;     // a liquid that comes down below the box, or none
  double mm_per_h = 0;    // of it, >= 0

  friend bool operator==(const ParticleSource&, const ParticleSource&) = default;
};

struct SimulationRequest {
  uint64_t seed = 1;                         // of all that is random
  std::vector<std::string> effects;          // asked for beyond what the content calls for
  std::map<std::string, std::string> knobs;  // name -> value, below those of the command line
  std::vector<BodyRequest> bodies = {};
  std::vector<ParticleSource> particles = {};
  /// What the simulation holds beside blocks and layers, by the names of its parts: only they know what it says. Empty
  /// before the first tick.
  std::map<std::string, std::string> state = {};

  friend bool operator==(const SimulationRequest&, const SimulationRequest&) = default;
};

}  // namespace world
