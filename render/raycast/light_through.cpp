#include "render/raycast/light_through.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/trace/proxies.h"

namespace render {

using namespace world;
using glsl::vec3;

Rgb light_through(const LightBlockers& blockers, const GridRay& ray, int from, LeafCache& blocks) {
  const MaskWalker& occupied = blockers.occupied;
  const GridAxes axes(ray);
  double t_limit = std::min(ray.t_max, std::numeric_limits<double>::max());
  WalkPlace place{ray.voxel, 0, -1};
  if (!occupied.in_bounds(place.voxel) && !occupied.clip(axes, place, t_limit)) return {1, 1, 1};
  const std::vector<shared::SeeThroughBlock>& kinds = blockers.kinds.blocks();
  const auto absorbed = [&](uint16_t kind, double metres) {
    return shared::absorbed_along(vec3(kinds[kind].absorption), static_cast<float>(metres));
  };
  vec3 through(1);
  uint16_t medium = 0;
  double last = 0;
  for (bool start = place.t == 0;; start = false) {
    const BlockId id = blocks.get(place.voxel);
    const uint16_t kind = blockers.kinds.kind(id);
    if (const Proxy* shape = blockers.shapes && id != kAir ? blockers.shapes->shape[id] : nullptr) {
      const uint8_t joins = blockers.shapes->joins_at(*shape, place.voxel, [&](VoxelPos v) { return blocks.get(v); });
      ProxyHit hit;
      if (intersect_proxy(*shape, joins, ray, place.voxel, t_limit, hit, start ? from : kNoPart) && !hit.inside)
        return {0, 0, 0};
    }
    if (blockers.cubes[id] && !start) return {0, 0, 0};
    if (kind != medium && !start) {
      through *= absorbed(medium, place.t - last);
      last = place.t;
      through *= interface_shares(kinds[std::max(kind, medium)], 1, kinds[medium].absorption.w,
                                  kinds[kind].absorption.w, static_cast<float>(std::abs(ray.direction[place.axis])))
                     .passed;
      if (std::max({through.x, through.y, through.z}) < 1e-4f) return {0, 0, 0};
    }
    medium = kind;
    // On to the next voxel that may differ.
    const bool uniform = medium != 0 && !blocks.leaf(place.voxel).values;
    if (!mask_walk::leave_cube(axes, place, uniform ? 7 : 0, t_limit)) break;
    if (medium == 0 && !occupied.volume().test(place.voxel) && !occupied.find(axes, place, t_limit)) break;
  }
  if (medium != 0) through *= absorbed(medium, 1e30);
  return {through.x, through.y, through.z};
}

}  // namespace render
