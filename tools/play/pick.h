/// What the player points at: the voxel, and through which face, exactly, of cubes and of shapes inside their voxels.
#pragma once

#include <optional>

#include "world/proxies/proxy.h"
#include "world/space/grid_walk.h"
#include "world/world.h"

namespace tools {

struct Pick {
  bool hit = false;
  world::VoxelPos voxel;
  world::BlockId block = world::kAir;
  int face = world::kFacePosY;   // a world::Face that looks at the viewer
  double distance = 0;           // m
  world::Vec3f low{0}, high{1};  // what is outlined, in the voxel
  bool replaceable = false;      // a plant, or a fluid: what is placed goes in its place
  /// Where a block is placed.
  world::VoxelPos beside() const { return replaceable ? voxel : voxel + world::face_step(face); }
};

/// `direction` is of unit length. Fluids are seen where `fluids` says so; gases never. A voxel that the eye is inside
/// of isn't seen, but for shapes that leave room.
Pick pick(const world::World& world, const world::BlockShapes& shapes, const world::WorldPoint& eye,
          const world::Vec3d& direction, double reach_m, bool fluids = false);

/// Whether a block goes where this one is, in its place: air, gases, liquids, and plants that are flat.
bool is_replaceable(const world::BlockPalette& palette, const world::BlockShapes& shapes, world::BlockId block);

/// Where a cubic metre more of a liquid goes that is poured into `from`: there, or above what holds some of it already,
/// from where it falls. None where that has no room, or is more than 16 m up.
std::optional<world::VoxelPos> room_to_pour(const world::World& world, const world::BlockShapes& shapes,
                                            world::VoxelPos from, world::BlockId liquid);

}  // namespace tools
