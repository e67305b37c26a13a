#include "render/light/spot_map.h"

#include <cmath>

#include "world/base/jobs.h"

namespace render {

bool has_spot_map(const world::Luminaire& l) {
  return (l.kind == "spot" || l.kind == "gobo") && l.shadows && l.half_angle < 1.5f &&
         std::tan(l.half_angle) <= shared::kWidestSpotMap;
}

std::vector<float> spot_map(const world::Luminaire& l, const world::RayStream& opaque, int texels) {
  const world::shared::Emitter e = world::emitter_from(l);
  const auto size = static_cast<size_t>(texels);
  const float edge = static_cast<float>(texels);
  const float half = shared::spot_map_half(static_cast<float>(e.tan_half_angle), edge);
  std::vector<float> depths(size * size);
  world::parallel_ranges(size, 8, [&](size_t begin, size_t end) {
    std::vector<world::GridRay> rays(size);
    std::vector<world::GridHit> hits(size);
    for (size_t y = begin; y < end; ++y) {
      for (size_t x = 0; x < size; ++x) {
        const glm::vec2 texel(static_cast<float>(x), static_cast<float>(y));
        const glm::vec3 along =
            shared::spot_map_ray(glm::vec3(e.axis), glm::vec3(e.right), glm::vec3(e.up), half, edge, texel);
        rays[x] = world::GridRay(l.position, glm::normalize(world::Vec3d(along)));
      }
      opaque.first_set_coherent(rays, hits);
      for (size_t x = 0; x < size; ++x) depths[y * size + x] = hits[x].hit() ? static_cast<float>(hits[x].t) : 1e30f;
    }
  });
  return depths;
}

}  // namespace render
