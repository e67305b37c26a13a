/// A world with a level set, for tests of smooth surfaces.
#pragma once

#include <algorithm>
#include <cmath>

#include "tests/render/raster/small_worlds.h"

namespace render {

/// A torus of radii 18 and 6 m, with a ball of 5 m over it that throws its shadow on it: as a level set with its
/// blocks, of one kind or two. `scale` times as many voxels a side show the same in finer steps.
inline double distance_at(const Vec3d& p) {
  const Vec3d axis = glm::normalize(Vec3d(0.4, 1, 0.57));
  const double height = glm::dot(p, axis);
  const Vec3d flat = p - height * axis, out = p - 18.0 * flat / std::max(glm::length(flat), 1e-9);
  return std::min(glm::length(out) - 6, glm::length(p - Vec3d(14, 18, 6)) - 5);
}
inline world::World rings(bool two_kinds = true, world::VoxelPos offset = {}, int scale = 1) {
  world::World w(world::standard_blocks());
  world::FloatLayer& distance = w.store.make_layer(world::Layer::distance);
  const world::BlockId stone = block(w, "granite"), red = block(w, "brick_red");
  world::EditBatch batch;
  const int half = 32 * scale;
  for (int x = -half; x < half; ++x)
    for (int y = -half; y < half; ++y)
      for (int z = -half; z < half; ++z) {
        const double d = scale * distance_at((Vec3d(x, y, z) + 0.5) / double(scale));
        if (std::abs(d) < 3) distance.set(offset + world::VoxelPos{x, y, z}, static_cast<float>(d));
        if (d <= 0) batch.set(offset + world::VoxelPos{x, y, z}, two_kinds && y > 10 ? red : stone);
      }
  apply(w, batch);
  return w;
}
inline Camera at_rings(world::VoxelPos offset = {}, int scale = 1) {
  return camera_at(offset, double(scale) * Vec3d(33.2, 30.1, 34.7), {-1, -0.75, -1.05}, 55);
}

}  // namespace render
