#include "world/space/grid_walk.h"

#include <algorithm>

namespace world {

RayInterval intersect_box(const GridRay& ray, const Vec3d& low, const Vec3d& high) {
  // gamma_3 = 3u / (1 - 3u) with u = 2^-53: the error of (bound - origin) * (1 / direction).
  constexpr double kWiden = 1 + 2 * (3 * 0x1p-53 / (1 - 3 * 0x1p-53));
  if (!ray.valid()) return {};
  RayInterval interval{0, ray.t_max};
  for (int a = 0; a < 3; ++a) {
    const double origin = ray.voxel[a] + ray.fraction[a];
    if (std::abs(ray.direction[a]) < kTinyDirection) {
      if (origin < low[a] || origin > high[a]) return {};
      continue;
    }
    const double inverse = 1.0 / ray.direction[a];
    const double t_low = (low[a] - origin) * inverse, t_high = (high[a] - origin) * inverse;
    interval.t0 = std::max(interval.t0, std::min(t_low, t_high));
    interval.t1 = std::min(interval.t1, std::max(t_low, t_high) * kWiden);
  }
  return interval;
}

}  // namespace world
