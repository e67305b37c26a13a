/// What the tests of liquids share.
#pragma once

#include <vector>

#include "tests/sim/matter/matter_support.h"

namespace sim {

/// Of each column of the box the amount of liquid.
inline std::vector<int> levels(const Matter& matter, const world::VoxelBox& box) {
  std::vector<int> all;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int z = box.min.z; z <= box.max.z; ++z) {
      int level = 0;
      for (int y = box.min.y; y <= box.max.y; ++y) level += matter.amount_at({x, y, z});
      all.push_back(level);
    }
  return all;
}

/// Two shafts of 3x3 voxels, joined by a tunnel at the bottom that lies across leaves and regions.
inline world::World u_tube(int length) {
  world::World world(world::standard_blocks());
  fill(world, {{-10, -2, -2}, {length + 10, 40, 8}}, block_named(world, "granite"));
  fill(world, {{0, 0, 1}, {2, 40, 3}}, world::kAir);
  fill(world, {{length, 0, 1}, {length + 2, 40, 3}}, world::kAir);
  fill(world, {{0, 0, 2}, {length, 0, 2}}, world::kAir);
  return world;
}

/// Basins of 8x8 voxels, one with 16 m of water, and a pipe of 2x2 from under the one to under the other.
inline world::World two_basins() {
  world::World world(world::standard_blocks());
  fill(world, {{-1, -4, -1}, {24, 24, 8}}, block_named(world, "granite"));
  for (const int x : {0, 16}) fill(world, {{x, 0, 0}, {x + 7, 24, 7}}, world::kAir);
  const world::BlockId water = block_named(world, "water");
  fill(world, {{6, -2, 3}, {7, -1, 4}}, water);
  fill(world, {{16, -2, 3}, {17, -1, 4}}, water);
  fill(world, {{6, -3, 3}, {17, -2, 4}}, water);
  fill(world, {{0, 0, 0}, {7, 15, 7}}, water);
  return world;
}

inline MatterOptions with_waves(uint64_t seed = 1) {
  MatterOptions options;
  options.seed = seed;
  options.knobs.liquid_model = LiquidModel::waves;
  return options;
}

}  // namespace sim
