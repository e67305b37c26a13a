/// The first set voxel along a ray, through a MaskVolume: cubes of 128, 64, 32, 16, 8, 4 and 2 voxels that hold
/// nothing are crossed in one step. The voxel, the face and the bits of t are those of first_hit_flat.
///
/// Why they are the same: a step leaves an empty cube by the first of its three far planes in the order of (t, axis),
/// with t from the integer plane as in FlatWalk; the flat walk has by then crossed, on each other axis, exactly the
/// planes that come before it in that order. Their number is floor(position) except within 2^-16 of a plane, where the
/// plane's own t decides.
/// cost  one step a cube, 15 to 25 ns; nothing is allocated
#pragma once

#include <bit>

#include "world/space/grid_walk.h"
#include "world/store/mask_volume.h"

namespace world {

/// A place in a walk: the voxel entered, at which t, by a step along which axis (-1: the start).
struct WalkPlace {
  VoxelPos voxel;
  double t = 0;
  int axis = -1;
};

namespace mask_walk {

/// The voxel along `axis` (not exit_axis) once the ray has made the crossing (t, exit_axis). Never behind `current`.
int32_t settle_cell(const GridAxes& axes, int axis, double position, double t, int exit_axis, int32_t current);

inline int32_t cell_after(const GridAxes& axes, int axis, double t, int exit_axis, int32_t current) {
  // 1.5 * 2^32 makes the low 52 bits of the sum a fixed point number with 20 bits of fraction, offset by 2^31.
  constexpr double kFixedPoint = 0x1.8p32;
  const double position = axes.fraction[axis] + t * axes.direction[axis];
  const uint64_t fixed = std::bit_cast<uint64_t>(position + kFixedPoint);
  // Within 2^-16 of a plane rounding may decide; position and plane t err by less than 2^-18 voxel within the world.
  if (((fixed + 16) & 0xfffff) < 32) [[unlikely]]
    return settle_cell(axes, axis, position, t, exit_axis, current);
  return static_cast<int32_t>(static_cast<uint32_t>(fixed >> 20) + 0x80000000u +
                              static_cast<uint32_t>(axes.origin[axis]));
}

/// Makes the crossing of `plane` along `axis` at t.
template <int axis>
inline void cross(const GridAxes& axes, WalkPlace& place, double t, int32_t plane) {
  constexpr int b = axis == 0 ? 1 : 0, c = axis == 2 ? 1 : 2;
  place.voxel[b] = cell_after(axes, b, t, axis, place.voxel[b]);
  place.voxel[c] = cell_after(axes, c, t, axis, place.voxel[c]);
  place.voxel[axis] = plane + (axes.upwards[axis] ? 0 : -1);
  place.t = t;
  place.axis = axis;
}
inline void cross(const GridAxes& axes, WalkPlace& place, int axis, double t, int32_t plane) {
  if (axis == 0)
    cross<0>(axes, place, t, plane);
  else if (axis == 1)
    cross<1>(axes, place, t, plane);
  else
    cross<2>(axes, place, t, plane);
}

/// Leaves the aligned cube of size_mask + 1 voxels around the place. False: at t beyond t_limit.
inline bool leave_cube(const GridAxes& axes, WalkPlace& place, int32_t size_mask, double t_limit) {
  const int32_t size = size_mask + 1;
  const int32_t px = (place.voxel.x & ~size_mask) + (size & axes.upwards[0]);
  const int32_t py = (place.voxel.y & ~size_mask) + (size & axes.upwards[1]);
  const int32_t pz = (place.voxel.z & ~size_mask) + (size & axes.upwards[2]);
  const double tx = axes.t_at(0, px), ty = axes.t_at(1, py), tz = axes.t_at(2, pz);
  if (tx <= ty && tx <= tz) {
    if (!(tx <= t_limit)) return false;
    cross<0>(axes, place, tx, px);
  } else if (ty <= tz) {
    if (!(ty <= t_limit)) return false;
    cross<1>(axes, place, ty, py);
  } else {
    if (!(tz <= t_limit)) return false;
    cross<2>(axes, place, tz, pz);
  }
  return true;
}

/// Of an empty 2^3 or larger cube of bits in a 4^3 word: 1 where the aligned 2^3 around `bit` is empty too.
inline bool pair_empty(uint64_t word, int bit) { return (word >> (bit & 42) & 0x00330033) == 0; }

/// Size - 1 of the largest known empty aligned cube around the voxel; -1 where the voxel itself is set.
inline int32_t empty_cube_mask(const MaskRegion* region, VoxelPos v) {
  if (!region) return 127;
  const int group = (v.x >> 5 & 3) << 4 | (v.y >> 5 & 3) << 2 | (v.z >> 5 & 3);
  if (!(region->any_groups >> group & 1)) return pair_empty(region->any_groups, group) ? 63 : 31;
  const int leaf = (v.x >> 3 & 3) << 4 | (v.y >> 3 & 3) << 2 | (v.z >> 3 & 3);
  const uint64_t any = region->any[group];
  if (!(any >> leaf & 1)) return pair_empty(any, leaf) ? 15 : 7;
  if (region->full[group] >> leaf & 1) return -1;
  const LeafMask& mask = region->masks[region->slot[index_in_region(leaf_from_voxel(v))]];
  const int x = v.x & 7, y = v.y & 7, z = v.z & 7;
  if (mask.word[x] >> (y * 8 + z) & 1) return -1;
  const uint64_t pair = mask.word[x & 6] | mask.word[x | 1];
  if (pair >> ((y & 6) * 8 + (z & 6)) & 0x0303) return 0;
  const uint64_t four = pair | mask.word[(x & 6) ^ 2] | mask.word[(x | 1) ^ 2];
  return four >> ((y & 4) * 8 + (z & 4)) & 0x0f0f0f0f ? 1 : 3;
}

}  // namespace mask_walk

/// Walks rays through one volume. Made once a picture; may be used by all threads.
class MaskWalker {
 public:
  explicit MaskWalker(const MaskVolume& volume);

  /// The first set voxel from the start on, the start's own included. A ray that leaves the volume's bounds without a
  /// hit ends as t_max or left_world, as the flat walk would.
  GridHit first_set(const GridRay& ray) const;
  /// The first set voxel that is entered from a clear one: where the ray starts in set voxels it leaves them first.
  GridHit first_entered(const GridRay& ray) const;
  bool any_set(const GridRay& ray) const { return first_set(ray).hit(); }

  /// From `place` to the first set voxel (its own included) before t_limit; false: none. The ray must not leave the
  /// bounds before t_limit.
  bool find(const GridAxes& axes, WalkPlace& place, double t_limit) const {
    RegionPos at = region_from_voxel(place.voxel);
    const MaskRegion* region = volume_->region(at);
    for (;;) {
      const int32_t size_mask = mask_walk::empty_cube_mask(region, place.voxel);
      if (size_mask < 0) return true;
      if (!mask_walk::leave_cube(axes, place, size_mask, t_limit)) return false;
      const RegionPos next = region_from_voxel(place.voxel);
      if (next != at) at = next, region = volume_->region(at);
    }
  }
  /// Brings a place at the start of the ray to where it enters the bounds, and t_limit down to where it leaves them.
  /// False: it misses them.
  bool clip(const GridAxes& axes, WalkPlace& place, double& t_limit) const;

  const MaskVolume& volume() const { return *volume_; }
  /// The planes that bound the regions that hold anything, by axis; equal where there are none.
  const int32_t* low() const { return low_; }
  const int32_t* high() const { return high_; }

 private:
  const MaskVolume* volume_;
  int32_t low_[3], high_[3];
};

}  // namespace world
