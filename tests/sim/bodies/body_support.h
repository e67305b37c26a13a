/// Worlds and bodies for tests.
#pragma once

#include <gtest/gtest.h>

#include "sim/bodies/bodies.h"
#include "world/world.h"

namespace sim {

inline void fill(world::World& w, world::VoxelPos min, world::VoxelPos max, const char* block) {
  world::EditBatch batch;
  batch.fill({min, max}, *w.palette->find(block));
  ASSERT_TRUE(w.store.apply(batch).ok());
}

/// A body without friction, drag or bounce, unless asked for.
inline BodyDescription smooth_box(double x, double y, double z, world::Vec3d size = {1, 1, 1}) {
  BodyDescription d;
  d.foot = world::WorldPoint::from(x, y, z);
  d.size = size;
  d.friction = 0, d.drag_coefficient = 0;
  return d;
}

inline world::Vec3d low_corner(const Body& body, world::VoxelPos origin = {0, 0, 0}) {
  return world_point(body.box.min) - world::WorldPoint{origin, world::Vec3d(0)};
}

/// A floor of stone with its top at y = 0, 64 m around.
inline void add_floor(world::World& w, world::VoxelPos origin = {0, 0, 0}) {
  fill(w, origin + world::VoxelPos{-64, -3, -64}, origin + world::VoxelPos{63, -1, 63}, "stone");
}

}  // namespace sim
