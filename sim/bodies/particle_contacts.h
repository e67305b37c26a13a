// What one particle does that comes into another voxel, an axis at a time. Internal to sim/bodies.
#pragma once

#include <bit>

#include "sim/bodies/particle_block.h"

namespace sim {

/// The nearest whole number, halves to even, for |way| <= kMostParticleWay: the same in every SIMD level.
constexpr float kRoundingMagic = 12582912.0f;  // 1.5 * 2^23
inline int32_t rounded_way(float way) {
  way = way < -kMostParticleWay ? -kMostParticleWay : way;
  way = way > kMostParticleWay ? kMostParticleWay : way;
  return std::bit_cast<int32_t>(way + kRoundingMagic) - std::bit_cast<int32_t>(kRoundingMagic);
}

/// Asks the bricks or, where there are none, the mask.
class ParticleProbe {
 public:
  explicit ParticleProbe(const ParticleTerrain& terrain) : terrain_(terrain) {}
  bool solid(world::VoxelPos from_origin) {
    const world::VoxelPos v = from_origin + terrain_.origin;
    if (terrain_.bricks) return terrain_.bricks->test(v);
    const world::LeafPos l = world::leaf_from_voxel(v);
    if (!leaf_ || l != at_) at_ = l, leaf_ = &terrain_.mask->leaf(l);
    return leaf_->test(v);
  }

 private:
  const ParticleTerrain& terrain_;
  world::LeafPos at_;
  const world::LeafMask* leaf_ = nullptr;
};

inline void end_by_hit(ParticleBlock& block, int i) {
  block.ticks_left[i] = 0;
  if (block.deaths == ParticleBlock::kMostDeaths) {
    ++block.deaths_forgotten;
    return;
  }
  block.death[block.deaths++] = {{block.at[0][i], block.at[1][i], block.at[2][i]}};
}

/// Goes its way along x, then z, then y, as bodies do: it slips between no two voxels that share an edge. Where a
/// voxel is solid it stays just before it.
inline void go_by_axes(ParticleBlock& block, int i, const int32_t way[3], const ParticleMotion& motion,
                       ParticleProbe& probe) {
  if (block.ticks_left[i] == 0) return;  // it ended in an earlier part of this tick
  for (const int a : {0, 2, 1}) {
    const int32_t from = block.at[a][i], to = from + way[a];
    world::VoxelPos voxel{block.at[0][i] >> kParticleFixedLog2, block.at[1][i] >> kParticleFixedLog2,
                          block.at[2][i] >> kParticleFixedLog2};
    const int32_t before = voxel[a];
    voxel[a] = to >> kParticleFixedLog2;
    if (voxel[a] > kParticleDomain || voxel[a] < -kParticleDomain) {
      block.ticks_left[i] = 0;
      return;
    }
    if (voxel[a] == before || !probe.solid(voxel)) {
      block.at[a][i] = to;
      continue;
    }
    block.at[a][i] = way[a] > 0 ? ((before + 1) << kParticleFixedLog2) - 1 : before << kParticleFixedLog2;
    if (motion.on_hit == ParticleHit::die) return end_by_hit(block, i);
    float& across = block.velocity[a][i];
    across = motion.on_hit == ParticleHit::bounce ? -motion.restitution * across : 0.0f;
    const float along = 1 - motion.friction;
    block.velocity[(a + 1) % 3][i] *= along, block.velocity[(a + 2) % 3][i] *= along;
  }
}

}  // namespace sim
