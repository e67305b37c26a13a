/// The surfaces of a box of the world as flux meets them: which faces of clear voxels end at opaque ones, numbered, and
/// which voxels hold a medium. Derived from the store's masks, leaf by leaf.
///
/// A surface belongs to the clear voxel before it: (voxel, face), the wall lies across the face.
#pragma once

#include <memory>
#include <vector>

#include "world/blocks/block.h"
#include "world/scenes/environment.h"
#include "world/store/leaf_mask.h"
#include "world/store/store.h"

namespace sim {

struct Surface {
  world::VoxelPos voxel;               // clear
  int face = 0;                        // towards the wall
  world::BlockId block = world::kAir;  // the wall's
};

/// What a clear voxel that isn't air does to light that crosses it.
struct FluxMedium {
  float absorption[3];  // per voxel length, >= 0
  float emission[3];    // W, of the voxel, in all directions alike
};

struct FluxLeaf {
  world::LeafMask clear;    // light passes
  world::LeafMask busy;     // clear, and beside a wall or filled with a medium
  world::LeafMask wall[6];  // clear, and the neighbour across the face is opaque
  uint32_t first[6][8];     // number of the first surface of wall[face].word[x]
  uint32_t media;           // 1 + place in media of this leaf; 0: none
  bool solid, open;         // nothing is clear; everything is, and nothing is busy
};

/// 1 + index into FluxGrid::kinds of each voxel, 0 for air.
using LeafMedia = std::array<uint16_t, world::kLeafVoxels>;

struct FluxGrid {
  world::LeafPos low{0, 0, 0};   // corner
  int size[3] = {0, 0, 0};       // leaves along each axis
  std::vector<FluxLeaf> leaves;  // by (x * size[1] + y) * size[2] + z
  std::vector<LeafMedia> media;
  std::vector<FluxMedium> kinds;
  std::vector<Surface> surfaces;   // by number: leaf, face, voxel
  uint64_t open_faces[6] = {};     // of clear voxels at the box's sides that light passes
  double medium_emission[3] = {};  // W, of all voxels

  size_t place(world::LeafPos from_corner) const {
    return (static_cast<size_t>(from_corner.x) * size[1] + from_corner.y) * size[2] + from_corner.z;
  }
  /// Number of the surface, or UINT32_MAX where there is none.
  uint32_t surface(world::VoxelPos voxel, int face) const;
  size_t bytes() const;
};

/// All leaves that `box` touches. Beyond them the store's opaque voxels are walls and the rest is open sky.
FluxGrid make_flux_grid(const world::Store& store, const world::VoxelBox& box);

}  // namespace sim
