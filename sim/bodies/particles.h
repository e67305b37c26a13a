/// Particles: rain, snow, sparks, smoke and splashes as point masses in the air, up to millions at once, which collide
/// with voxels (of the mask of solid or of occupied ones). They change nothing in the world.
///
/// A step is two passes: all blocks of particles on all threads, each by itself; then, in order, what the dead leave
/// behind, and blocks that have become half empty joined. So the result depends on no thread count.
///
///   limit      where there is no room the oldest block of the kind of least priority loses its first particle; a
///              newcomer of less priority than all that are there is dropped itself. Both are counted.
///   speed      at most a voxel a part of a tick along an axis (60 m/s at 1/60 s): faster ones are held back, and none
///              passes a voxel unseen
///   terrain    a voxel that becomes solid around particles lets them out. What isn't loaded is air
///   far away   what is more than 32000 voxels from the origin's voxel dies
///   not finite a velocity that isn't a number is none
///
/// bytes  28 a particle of a full block, room for twice the limit's blocks; taken at the start, touched when used, and
///        nothing later
/// cost   see `loam bench run matter`
/// knobs  particle_integrator, body_substeps, particle_limit
/// source William T. Reeves. Particle Systems - A Technique for Modeling a Class of Fuzzy Objects. 1983
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim/bodies/particle_block.h"
#include "sim/clock.h"
#include "sim/knobs.h"
#include "world/space/world_point.h"
#include "world/store/store.h"

namespace sim {

struct ParticleSettings {
  Integrator integrator = SimKnobs{}.particle_integrator;
  int substeps = 1;  // 1 .. kMostSubsteps; raised for a kind whose drag asks for it
  TickLength tick;
  double gravity = 9.81;  // m/s^2, downwards
  world::Vec3d wind{0};   // m/s
  bool plain = false;     // one particle after the other: for tests and benchmarks

  static ParticleSettings from(const SimKnobs& knobs) {
    ParticleSettings settings;
    settings.integrator = knobs.particle_integrator, settings.substeps = knobs.body_substeps;
    return settings;
  }
};

struct ParticleReport {
  uint64_t moved = 0;                 // particles at the start of the step
  uint64_t ended = 0, born = 0;       // by age or a hit; from hits
  uint64_t dropped = 0, refused = 0;  // since the last step, at the limit: old ones, newcomers
  uint64_t deaths_forgotten = 0;      // hits that spawned nothing: more than 256 of a block's 2048 in one tick
};

class Particles {
 public:
  /// Of the kinds given, which must outlive it as the store must; 1 <= limit <= 2^26. Follows the store's edits.
  Particles(const world::Store& store, std::span<const ParticleKind> kinds, size_t limit, uint64_t seed);
  ~Particles();
  Particles(const Particles&) = delete;
  Particles& operator=(const Particles&) = delete;

  /// False where it is dropped at the limit, or lies too far from the origin.
  bool spawn(int kind, const world::WorldPoint& at, world::Vec3d velocity, const ParticleSettings& settings);
  /// `count` of them evenly in the box, each with up to `spread` m/s of its own in any direction.
  void spawn_in(int kind, const world::VoxelBox& box, int count, world::Vec3d velocity, double spread,
                const ParticleSettings& settings);
  void clear();

  /// Particles are kept by their distance from here: a viewer, moved now and then.
  void set_origin(world::VoxelPos origin);
  world::VoxelPos origin() const { return origin_; }
  int subscriber() const { return subscriber_; }  // of the store

  ParticleReport step(const ParticleSettings& settings);

  size_t size() const { return size_; }
  size_t size(int kind) const;
  size_t limit() const { return limit_; }
  std::span<const ParticleKind> kinds() const { return kinds_; }
  /// The blocks of a kind, oldest first: for pictures. Valid until something spawns or the next step.
  std::span<const uint32_t> blocks(int kind) const { return lists_[static_cast<size_t>(kind)]; }
  const ParticleBlock& block(uint32_t index) const { return blocks_[index]; }
  uint64_t content_hash() const;
  size_t bytes() const;  // taken

 private:
  struct Air;  // bricks of one mask kind
  bool add(int kind, const int32_t at[3], world::Vec3d velocity, const ParticleSettings& settings);
  bool make_room(int kind);
  ParticleBlock& block_with_room(int kind);
  void remove_at(ParticleBlock& block, int i);
  void find_motions(const ParticleSettings& settings);
  void follow_terrain();
  void step_block(uint32_t index, int kind, const ParticleSettings& settings);
  void leave_behind(const ParticleSettings& settings);
  void join_blocks(std::vector<uint32_t>& list);

  const world::Store& store_;
  int subscriber_;
  std::span<const ParticleKind> kinds_;
  size_t limit_, size_ = 0;
  uint64_t seed_, tick_ = 0, serial_ = 0;
  world::VoxelPos origin_;
  size_t block_count_;
  std::unique_ptr<ParticleBlock[]> blocks_;
  std::vector<uint32_t> free_;
  std::vector<std::vector<uint32_t>> lists_;  // by kind

  struct Motion {
    ParticleMotion motion;
    int parts = 1;
  };
  std::vector<Motion> motions_;  // by kind
  std::unique_ptr<Air> air_[2];  // by ParticleMeets
  struct Job {
    uint32_t block;
    int kind;
  };
  std::vector<Job> jobs_;
  ParticleReport report_;
};

}  // namespace sim
