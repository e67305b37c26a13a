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
int32_t settle_cell(const GridAxes& axes, int axis, double t, int exit_axis, int32_t current);

/// The position along an axis at t, relative to the start's voxel and offset by 2^31, as a fixed point number with 20
/// bits of fraction (and the bits of a double's exponent above).
inline uint64_t fixed_position(const GridAxes& axes, int axis, double t) {
  constexpr double kFixedPoint = 0x1.8p32;  // its ulp is 2^-20
  return std::bit_cast<uint64_t>(axes.fraction[axis] + t * axes.direction[axis] + kFixedPoint);
}
/// Within 2^-16 of a plane rounding may decide; position and plane t err by less than 2^-18 voxel within the world.
inline bool near_a_plane(uint64_t fixed) { return ((static_cast<uint32_t>(fixed) + 16) & 0xfffe0) == 0; }
inline int32_t cell_of(const GridAxes& axes, int axis, uint64_t fixed) {
  return static_cast<int32_t>(static_cast<uint32_t>(fixed >> 20) + 0x80000000u +
                              static_cast<uint32_t>(axes.origin[axis]));
}

inline int32_t cell_after(const GridAxes& axes, int axis, double t, int exit_axis, int32_t current) {
  const uint64_t fixed = fixed_position(axes, axis, t);
  if (near_a_plane(fixed)) [[unlikely]]
    return settle_cell(axes, axis, t, exit_axis, current);
  return cell_of(axes, axis, fixed);
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
/// Without branches on the axis: which one it is can't be predicted, and three cells cost less than a wrong guess.
[[gnu::always_inline]] inline bool leave_cube(const GridAxes& axes, WalkPlace& place, int32_t size_mask,
                                              double t_limit) {
  const int32_t size = size_mask + 1;
  const int32_t px = (place.voxel.x & ~size_mask) + (size & axes.upwards[0]);
  const int32_t py = (place.voxel.y & ~size_mask) + (size & axes.upwards[1]);
  const int32_t pz = (place.voxel.z & ~size_mask) + (size & axes.upwards[2]);
  const double tx = axes.t_at(0, px), ty = axes.t_at(1, py), tz = axes.t_at(2, pz);
  const double t_yz = tz < ty ? tz : ty, t = t_yz < tx ? t_yz : tx;
  if (!(t <= t_limit)) return false;
  // All bits where the axis is the one crossed: x, else y, else z.
  const int32_t on_x = -(tx <= t_yz), on_y = ~on_x & -(ty <= tz), on_z = ~(on_x | on_y);
  const uint64_t fx = fixed_position(axes, 0, t), fy = fixed_position(axes, 1, t), fz = fixed_position(axes, 2, t);
  const auto near_on_other_axis = [](uint64_t fixed, int32_t crossed) {
    return ((static_cast<uint32_t>((static_cast<uint32_t>(fixed) + 16) & 0xfffe0)) | static_cast<uint32_t>(crossed)) ==
           0;
  };
  if (near_on_other_axis(fx, on_x) | near_on_other_axis(fy, on_y) | near_on_other_axis(fz, on_z)) [[unlikely]] {
    const int axis = (on_y & 1) + (on_z & 2);
    cross(axes, place, axis, t, axis == 0 ? px : axis == 1 ? py : pz);
    return true;
  }
  const auto select = [](int32_t mask, int32_t a, int32_t b) { return (a & mask) | (b & ~mask); };
  place.voxel.x = select(on_x, px - 1 - axes.upwards[0], cell_of(axes, 0, fx));
  place.voxel.y = select(on_y, py - 1 - axes.upwards[1], cell_of(axes, 1, fy));
  place.voxel.z = select(on_z, pz - 1 - axes.upwards[2], cell_of(axes, 2, fz));
  place.t = t;
  place.axis = (on_y & 1) + (on_z & 2);
  return true;
}

/// Of an empty 2^3 or larger cube of bits in a 4^3 word: 1 where the aligned 2^3 around `bit` is empty too.
inline bool pair_empty(uint64_t word, int bit) { return (word >> (bit & 42) & 0x00330033) == 0; }

/// Size - 1 of the largest known empty aligned cube around the voxel; -1 where the voxel itself is set.
[[gnu::always_inline]] inline int32_t empty_cube_in_leaf(const LeafMask& mask, VoxelPos v) {
  const int x = v.x & 7, y = v.y & 7, z = v.z & 7;
  if (mask.word[x] >> (y * 8 + z) & 1) return -1;
  const uint64_t pair = mask.word[x & 6] | mask.word[x | 1];
  const uint64_t four = pair | mask.word[(x & 6) ^ 2] | mask.word[(x | 1) ^ 2];
  const int two_empty = (pair >> ((y & 6) * 8 + (z & 6)) & 0x0303) == 0;
  const int four_empty = (four >> ((y & 4) * 8 + (z & 4)) & 0x0f0f0f0f) == 0;  // then two_empty too
  return two_empty + 2 * four_empty;
}

/// The same from the region down. In a mixed leaf it only sets `leaf` and returns 0.
[[gnu::always_inline]] inline int32_t empty_cube_mask(const MaskRegion* region, VoxelPos v, const LeafMask*& leaf) {
  if (!region) return 127;
  const int group = (v.x >> 5 & 3) << 4 | (v.y >> 5 & 3) << 2 | (v.z >> 5 & 3);
  if (!(region->any_groups >> group & 1)) return pair_empty(region->any_groups, group) ? 63 : 31;
  const int bit = (v.x >> 3 & 3) << 4 | (v.y >> 3 & 3) << 2 | (v.z >> 3 & 3);
  const uint64_t any = region->any[group];
  if (!(any >> bit & 1)) return pair_empty(any, bit) ? 15 : 7;
  if (region->full[group] >> bit & 1) return -1;
  leaf = &region->masks[region->slot[index_in_region(leaf_from_voxel(v))]];
  return 0;
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

  /// From `place` to the first set voxel (its own included) up to t_limit, which is finite; false: none. A place
  /// outside the bounds must be one from which the ray does not enter them, see clip().
  bool find(const GridAxes& ray, WalkPlace& start, double t_limit) const {
    const GridAxes axes = ray;  // copies of one's own stay in registers
    WalkPlace place = start;
    RegionPos at = region_from_voxel(place.voxel);
    const MaskRegion* region = volume_->region(at);
    const LeafMask* leaf = nullptr;
    VoxelPos in_leaf;  // a voxel of `leaf`
    for (;;) {
      int32_t size_mask = 0;
      if (!leaf) {
        size_mask = mask_walk::empty_cube_mask(region, place.voxel, leaf);
        if (!region && !in_bounds(place.voxel)) return false;
        in_leaf = place.voxel;
      }
      if (leaf) size_mask = mask_walk::empty_cube_in_leaf(*leaf, place.voxel);
      if (size_mask < 0) {
        start = place;
        return true;
      }
      if (!mask_walk::leave_cube(axes, place, size_mask, t_limit)) return false;
      // As long as the walk stays in a mixed leaf no level above is asked.
      const VoxelPos v = place.voxel;
      if (leaf && (((v.x ^ in_leaf.x) | (v.y ^ in_leaf.y) | (v.z ^ in_leaf.z)) & ~7) == 0) continue;
      leaf = nullptr;
      const RegionPos next = region_from_voxel(v);
      if (next != at) at = next, region = volume_->region(at);
    }
  }
  /// Brings a place at the start of the ray to where it enters the bounds, and t_limit down to where it leaves them.
  /// False: it misses them.
  bool clip(const GridAxes& axes, WalkPlace& place, double& t_limit) const;

  bool in_bounds(VoxelPos v) const {
    return v.x >= low_[0] && v.x < high_[0] && v.y >= low_[1] && v.y < high_[1] && v.z >= low_[2] && v.z < high_[2];
  }

  const MaskVolume& volume() const { return *volume_; }
  /// The planes that bound the regions that hold anything, by axis; equal where there are none.
  const int32_t* low() const { return low_; }
  const int32_t* high() const { return high_; }

 private:
  const MaskVolume* volume_;
  int32_t low_[3], high_[3];
};

}  // namespace world
