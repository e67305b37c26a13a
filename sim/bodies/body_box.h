/// Places and lengths of bodies: whole numbers of 2^-32 voxel (0.23 nm), 64 bits a coordinate. So a body behaves bit
/// for bit the same at the world's border as at its origin, a box that lies on a face lies on it exactly, and what is
/// saved comes back.
///
/// A voxel is a metre here; worlds with others scale gravity and speeds.
#pragma once

#include <cstdint>

#include "world/space/world_point.h"

namespace sim {

constexpr int kFixedLog2 = 32;
constexpr int64_t kFixedOne = int64_t{1} << kFixedLog2;

/// x * 2^32 rounded to the nearest, halves away from 0; x is finite and below 2^30 in size.
constexpr int64_t fixed_from(double x) {
  const double scaled = x * 0x1p32;
  return static_cast<int64_t>(scaled + (scaled < 0 ? -0.5 : 0.5));
}
/// Exact up to 53 bits.
constexpr double from_fixed(int64_t x) { return static_cast<double>(x) * 0x1p-32; }

/// A point, a displacement (voxels) or a velocity (voxels/s), each times 2^32.
struct FixedVec3 {
  int64_t x = 0, y = 0, z = 0;
  constexpr int64_t operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr int64_t& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  friend constexpr FixedVec3 operator+(FixedVec3 a, FixedVec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr FixedVec3 operator-(FixedVec3 a, FixedVec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr bool operator==(const FixedVec3&, const FixedVec3&) = default;
};
constexpr FixedVec3 fixed_from(world::Vec3d v) { return {fixed_from(v.x), fixed_from(v.y), fixed_from(v.z)}; }
inline world::Vec3d from_fixed(FixedVec3 v) { return {from_fixed(v.x), from_fixed(v.y), from_fixed(v.z)}; }

inline FixedVec3 fixed_from(const world::WorldPoint& p) {
  FixedVec3 v;
  for (int a = 0; a < 3; ++a) v[a] = int64_t{p.voxel[a]} * kFixedOne + fixed_from(p.fraction[a]);
  return v;
}
inline world::WorldPoint world_point(FixedVec3 v) {
  world::WorldPoint p;
  for (int a = 0; a < 3; ++a) {
    p.voxel[a] = static_cast<int32_t>(v[a] >> kFixedLog2);
    p.fraction[a] = from_fixed(v[a] & (kFixedOne - 1));
  }
  return p;
}

/// An axis-aligned box: its lowest corner and its size (> 0). What it touches it doesn't overlap.
struct BodyBox {
  FixedVec3 min, size;
  constexpr int64_t max(int axis) const { return min[axis] + size[axis]; }
  /// Voxels that it overlaps.
  constexpr world::VoxelBox voxels() const {
    world::VoxelBox box;
    for (int a = 0; a < 3; ++a) {
      box.min[a] = static_cast<int32_t>(min[a] >> kFixedLog2);
      box.max[a] = static_cast<int32_t>((max(a) - 1) >> kFixedLog2);
    }
    return box;
  }
  friend constexpr bool operator==(const BodyBox&, const BodyBox&) = default;
};

constexpr bool overlap(const BodyBox& a, const BodyBox& b) {
  for (int i = 0; i < 3; ++i)
    if (a.max(i) <= b.min[i] || b.max(i) <= a.min[i]) return false;
  return true;
}

/// The smallest box that holds both.
constexpr BodyBox hull(const BodyBox& a, const BodyBox& b) {
  BodyBox all;
  for (int i = 0; i < 3; ++i) {
    all.min[i] = a.min[i] < b.min[i] ? a.min[i] : b.min[i];
    all.size[i] = (a.max(i) > b.max(i) ? a.max(i) : b.max(i)) - all.min[i];
  }
  return all;
}
/// Wider by `margin` on every side.
constexpr BodyBox grown(BodyBox box, int64_t margin) {
  for (int i = 0; i < 3; ++i) box.min[i] -= margin, box.size[i] += 2 * margin;
  return box;
}
constexpr BodyBox moved(BodyBox box, FixedVec3 by) { return {box.min + by, box.size}; }

}  // namespace sim
