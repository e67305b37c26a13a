/// Points and directions in the world, in metres, exact at any distance from the origin.
#pragma once

#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "world/space/coords.h"

namespace world {

using Vec3d = glm::dvec3;
using Vec3f = glm::vec3;

/// A voxel plus a fraction in [0, 1) of it on each axis: as fine at 10^9 m as at the origin.
struct WorldPoint {
  VoxelPos voxel;
  Vec3d fraction{0.0};

  /// floor and fraction of each coordinate; the coordinates must be finite and within the world's border.
  static WorldPoint from(double x, double y, double z) {
    const double fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
    return {{static_cast<int32_t>(fx), static_cast<int32_t>(fy), static_cast<int32_t>(fz)},
            {fraction_of(x - fx), fraction_of(y - fy), fraction_of(z - fz)}};
  }

 private:
  /// Just below an integer the difference rounds to 1: -1e-20 is in voxel -1, at its very end.
  static double fraction_of(double difference) { return difference < 1 ? difference : 0x1.fffffffffffffp-1; }
};

/// b - a in metres; exact in the integer part while the points are within 2^31 voxels of each other.
inline Vec3d operator-(const WorldPoint& b, const WorldPoint& a) {
  return Vec3d(double(b.voxel.x) - a.voxel.x, double(b.voxel.y) - a.voxel.y, double(b.voxel.z) - a.voxel.z) +
         (b.fraction - a.fraction);
}

inline WorldPoint operator+(const WorldPoint& p, const Vec3d& offset) {
  WorldPoint moved = WorldPoint::from(p.fraction.x + offset.x, p.fraction.y + offset.y, p.fraction.z + offset.z);
  moved.voxel = moved.voxel + p.voxel;
  return moved;
}

}  // namespace world
