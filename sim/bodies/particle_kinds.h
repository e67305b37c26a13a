/// Kinds of particles: rows of sim/bodies/particles.toml, which says what each key means.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "world/base/errors.h"
#include "world/units/quantity.h"

namespace sim {

enum class ParticleMeets : uint8_t { solid, occupied };
enum class ParticleHit : uint8_t { die, bounce, slide };

struct ParticleKind {
  std::string name, what;
  double gravity = 1;             // times that of the world, downwards; in [-10, 10]
  double drag_per_s = 0;          // in [0, 1000]
  double lifetime_s[2] = {1, 1};  // in (0, 1000]
  ParticleMeets meets = ParticleMeets::solid;
  ParticleHit on_hit = ParticleHit::die;
  float restitution = 0, friction = 0;  // in [0, 1]
  int spawns = -1;                      // index of a kind
  int spawn_count = 0;                  // 0 .. 16
  double spread_mps = 0;                // in [0, 100]
  int priority = 0;                     // 0 .. 100
  float size_m = 0.05f;                 // in (0, 10]
  world::Ratio3 colour{1, 1, 1};
  float opacity = 1;          // in [0, 1]
  world::Radiance3 radiance;  // that it sends out by itself, W/(m^2 sr), in [0, 1e6]
};

constexpr size_t kMostParticleKinds = 64;

/// Those of particles.toml, sorted by name.
std::span<const ParticleKind> particle_kinds();
/// Errors name file, line and column.
world::Result<std::vector<ParticleKind>> read_particle_kinds(std::string_view text, const std::string& file_name);
/// Its place among the kinds.
std::optional<int> find_particle_kind(std::span<const ParticleKind> kinds, std::string_view name);

}  // namespace sim
