#include "sim/light/sun.h"

#include "world/base/jobs.h"
#include "world/store/parallel_rays.h"
#include "world/store/ray_stream.h"

namespace sim {

std::vector<world::Irradiance3> sun_on_surfaces(const world::Store& store, const FluxGrid& grid,
                                                const world::Environment& environment) {
  if (!(environment.sun_irradiance.max() > 0)) return {};
  std::vector<world::Irradiance3> lit(grid.surfaces.size());
  world::StoreRays rays;
  const world::ParallelRays& to_sun = rays.parallel(store, world::MaskKind::opaque, environment.sun_direction);
  constexpr size_t kAtOnce = 1024;
  world::parallel_ranges(lit.size(), kAtOnce, [&](size_t begin, size_t end) {
    std::vector<world::GridRay> starts;
    std::vector<uint32_t> numbers;
    std::vector<uint8_t> blocked;
    for (size_t i = begin; i < end; ++i) {
      const Surface& s = grid.surfaces[i];
      const int axis = world::face_axis(s.face);
      if (!(-world::face_sign(s.face) * environment.sun_direction[axis] > 0)) continue;
      world::GridRay ray;
      ray.voxel = s.voxel;
      ray.fraction = world::Vec3d(0.5);
      ray.fraction[axis] = world::face_sign(s.face) > 0 ? 1.0 : 0.0;
      ray.direction = environment.sun_direction;
      starts.push_back(ray);
      numbers.push_back(static_cast<uint32_t>(i));
    }
    blocked.resize(starts.size());
    to_sun.any_set(starts, blocked);
    for (size_t k = 0; k < starts.size(); ++k) {
      if (blocked[k]) continue;
      const int axis = world::face_axis(grid.surfaces[numbers[k]].face);
      lit[numbers[k]] = environment.sun_irradiance * static_cast<float>(std::abs(environment.sun_direction[axis]));
    }
  });
  return lit;
}

}  // namespace sim
