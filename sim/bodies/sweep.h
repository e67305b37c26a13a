/// The first thing that a moving box meets: exact, because every comparison is one of fractions of integers.
///
/// The box's leading faces walk from plane to plane of the grid in order of time, and the layer of voxels behind each
/// plane is looked at where the box is then. Faces between two solid voxels are never met: a box that slides along a
/// floor touches it and doesn't overlap it. Where planes of two axes are reached at once, x comes before z and z before
/// y: a box that aims exactly at the edge of a step gets onto it.
///
/// What the box overlaps at the start it leaves freely. A box that stops where it met something overlaps nothing that
/// it did not overlap before: on the other axes it has gone the whole part of its way, rounded towards the start.
/// cost  a layer of voxels for each plane; allocates nothing
#pragma once

#include <span>

#include "sim/bodies/terrain.h"

namespace sim {

struct SweepHit {
  int axis = -1;  // -1: nothing is met
  // Time of impact in [0, 1): numerator / denominator of the whole displacement.
  int64_t numerator = 1, denominator = 1;
  int obstacle = -1;        // which of the obstacles; -1: terrain
  world::VoxelPos voxel{};  // of terrain

  bool hit() const { return axis >= 0; }
  double time() const { return static_cast<double>(numerator) / static_cast<double>(denominator); }
  /// How far the box gets of a displacement.
  int64_t part_of(int64_t displacement) const {
    if (!hit()) return displacement;
    const __int128 size = displacement < 0 ? -__int128{displacement} : __int128{displacement};
    const int64_t part = static_cast<int64_t>(size * numerator / denominator);
    return displacement < 0 ? -part : part;
  }
  FixedVec3 part_of(const FixedVec3& d) const { return {part_of(d.x), part_of(d.y), part_of(d.z)}; }
};

/// Each coordinate of the displacement is below 2^48 (65536 voxels) in size. Obstacles are boxes that stand still.
SweepHit sweep(const BodyBox& box, const FixedVec3& displacement, const BodyTerrain& terrain,
               std::span<const BodyBox> obstacles = {});

}  // namespace sim
