/// Where particles are kept, and what moves them. Internal to sim/bodies.
///
///   a list of blocks for each kind, the oldest first -> 2048 particles, an array a field: 26 bytes each
///
/// A position is a whole number of 2^-16 voxel from the origin's voxel: moving the origin by whole voxels changes
/// nothing, and no step knows where in the world it happens. Velocities are floats: a sum and a product at a time, in
/// one order, so that plain C++ and every SIMD level give the same bits.
#pragma once

#include <cstdint>

#include "sim/bodies/particle_kinds.h"
#include "world/store/brick_volume.h"
#include "world/store/mask_volume.h"

namespace sim {

constexpr int kParticleFixedLog2 = 16;
/// Particles die that are further than this from the origin's voxel, along an axis.
constexpr int32_t kParticleDomain = 32000;

/// Where one died by a hit.
struct ParticleDeath {
  int32_t at[3];
};

struct ParticleBlock {
  static constexpr int kSize = 2048, kMostDeaths = 256;
  alignas(64) int32_t at[3][kSize];
  alignas(64) float velocity[3][kSize];  // m/s
  alignas(64) uint16_t ticks_left[kSize];
  int count = 0;
  int deaths = 0;                 // of this tick, at most kMostDeaths
  uint32_t deaths_forgotten = 0;  // beyond that: they spawn nothing
  ParticleDeath death[kMostDeaths];
};

/// One part of a tick for one kind: linear, because drag is, so that each integrator is four numbers an axis:
///   way = way_by_velocity * v + way;  v = kept * v + gained
struct ParticleMotion {
  float way_by_velocity = 0, kept = 1;  // way in 2^-16 voxel
  float way[3] = {}, gained[3] = {};
  ParticleHit on_hit = ParticleHit::die;
  float restitution = 0, friction = 0;
};

/// The solid voxels as particles see them, from their origin's voxel: one of the two is there.
struct ParticleTerrain {
  const world::MaskVolume* mask = nullptr;
  const world::BrickVolume* bricks = nullptr;  // null: the mask itself is asked
  world::VoxelPos origin;
};

/// At most a voxel a part of a tick along an axis, so that a particle passes no voxel unseen.
constexpr float kMostParticleWay = 65535;

/// Moves the particles of a block through a part of a tick. Both give the same bits.
void move_particles(ParticleBlock& block, const ParticleMotion& motion, const ParticleTerrain& terrain);
void move_particles_plain(ParticleBlock& block, const ParticleMotion& motion, const ParticleTerrain& terrain);
/// Takes a tick off each one's life; true where any has ended.
bool age_particles(ParticleBlock& block);

}  // namespace sim
