#include "render/trace/proxies.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "world/space/ray_shapes.h"

namespace render {

using world::GridRay;
using world::Proxy;
using world::ProxyBox;
using world::ProxyQuad;

namespace {

/// A ray as boxes see it. On an axis that it doesn't move along, direction is 0.
struct BoxRay {
  double fraction[3], inverse[3], direction[3];
  double offset[3];  // of the proxy's voxel from the ray's; exact

  BoxRay(const GridRay& ray, world::VoxelPos voxel) {
    for (int a = 0; a < 3; ++a) {
      fraction[a] = ray.fraction[a];
      direction[a] = std::abs(ray.direction[a]) >= world::kTinyDirection ? ray.direction[a] : 0.0;
      inverse[a] = 1.0 / direction[a];
      offset[a] = static_cast<double>(voxel[a]) - ray.voxel[a];
    }
  }
  /// From the ray's start to a plane of the voxel, along an axis.
  double distance(int axis, double plane) const { return (offset[axis] + plane) - fraction[axis]; }
};

/// Where a ray is inside a box. Ties go to the later axis, which is crossed last on the way in, and to the first on the
/// way out, as in the grid walk.
struct BoxSpan {
  double t0 = -world::kInfinity, t1 = world::kInfinity;
  int axis0 = 0, axis1 = 0;
  int planes0 = 0, planes1 = 0;  // crossed at exactly t0, t1: 2 at an edge, 3 at a corner
  int part = 0;
};

bool intersect_box(const BoxRay& ray, const ProxyBox& box, BoxSpan& span) {
  for (int a = 0; a < 3; ++a) {
    const double low = ray.distance(a, box.low[a]), high = ray.distance(a, box.high[a]);
    if (ray.direction[a] == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const bool up = ray.direction[a] > 0;
    const double enter = (up ? low : high) * ray.inverse[a], leave = (up ? high : low) * ray.inverse[a];
    if (enter >= span.t0) {
      span.planes0 = enter > span.t0 ? 1 : span.planes0 + 1;
      span.t0 = enter, span.axis0 = a;
    }
    if (leave <= span.t1) {
      span.planes1 = leave < span.t1 ? 1 : span.planes1 + 1;
      if (leave < span.t1) span.t1 = leave, span.axis1 = a;
    }
  }
  return span.t0 <= span.t1 && span.t1 >= 0 && span.t1 < world::kInfinity;
}

/// The first border of the union of the spans at or after the start; false: there is none. A ray is inside where it
/// starts within a box, on the box `from` and enters it, or between two that touch. Of boxes with a border at the same
/// t it takes one that has it in the fewest planes: others are met at an edge, and may name a face within the union.
bool first_border(std::span<const BoxSpan> spans, int from, double& t, const BoxSpan*& box, bool& inside) {
  box = nullptr;
  bool ends_here = false;  // a box that the ray would have come through
  inside = false;
  for (const BoxSpan& span : spans) {
    if (span.t1 == 0) {
      ends_here |= span.t0 < 0 && from == kNoPart;
      continue;
    }
    inside |= span.t0 < 0 || (span.t0 == 0 && span.part == from);
    if (!box || span.t0 < box->t0 || (span.t0 == box->t0 && span.planes0 < box->planes0)) box = &span;
  }
  if (!box) return false;
  inside |= ends_here && box->t0 == 0;
  t = box->t0;
  if (!inside) return true;
  // On to the far end of whatever overlaps or touches.
  t = 0;
  for (bool grown = true; grown;) {
    grown = false;
    for (const BoxSpan& span : spans)
      if (span.t0 <= t && (span.t1 > t || (span.t1 == t && span.planes1 < box->planes1)))
        t = span.t1, box = &span, grown = true;
  }
  return true;
}

void set_box_hit(const BoxRay& ray, const ProxyBox& box, const BoxSpan& span, double t, bool inside, ProxyHit& hit) {
  const int axis = inside ? span.axis1 : span.axis0;
  const bool high = (ray.direction[axis] > 0) == inside;  // which of the two faces
  hit = {.t = std::max(t, 0.0), .part = span.part, .inside = inside};
  hit.normal[axis] = high ? 1.0f : -1.0f;
  for (int a = 0; a < 3; ++a) {
    if (a == axis) {
      hit.point[a] = high ? box.high[a] : box.low[a];
      continue;
    }
    const double along = t * ray.direction[a];
    hit.point[a] = std::clamp((ray.fraction[a] - ray.offset[a]) + along, double{box.low[a]}, double{box.high[a]});
    // t errs by three roundings of the distance along its axis, and is multiplied, and added.
    hit.error[a] =
        world::rounding_bound<double>(6) * (std::abs(along) + std::abs(ray.offset[a]) + std::abs(ray.fraction[a]));
  }
}

bool intersect_quad(const GridRay& ray, const BoxRay& from_voxel, const ProxyQuad& quad, double t_max, ProxyHit& hit) {
  const Vec3d origin(from_voxel.fraction[0] - from_voxel.offset[0], from_voxel.fraction[1] - from_voxel.offset[1],
                     from_voxel.fraction[2] - from_voxel.offset[2]);
  const Vec3d a(quad.corner), b(quad.corner + quad.u), c(quad.corner + quad.u + quad.v), d(quad.corner + quad.v);
  auto met = world::intersect_triangle<double>(origin, ray.direction, a, b, c, t_max);
  if (!met) met = world::intersect_triangle<double>(origin, ray.direction, a, c, d, t_max);
  if (!met) return false;
  hit = {.t = met->t, .point = met->on_surface.point, .error = met->on_surface.error};
  hit.normal = Vec3f(world::safe_normalize(cross(Vec3d(quad.u), Vec3d(quad.v))));
  return true;
}

}  // namespace

bool intersect_proxy(const Proxy& proxy, uint8_t joins, const GridRay& ray, world::VoxelPos voxel, double t_max,
                     ProxyHit& hit, int from) {
  const BoxRay box_ray(ray, voxel);
  std::array<BoxSpan, world::kMostProxyParts> spans;
  size_t count = 0;
  for (size_t i = 0; i < proxy.boxes.size(); ++i) {
    if (!proxy.has_part(proxy.boxes[i].joins, joins)) continue;
    BoxSpan span;
    if (!intersect_box(box_ray, proxy.boxes[i], span)) continue;
    span.part = static_cast<int>(i);
    spans[count++] = span;
  }
  bool found = false;
  double t = 0;
  const BoxSpan* box = nullptr;
  bool inside = false;
  if (first_border({spans.data(), count}, from, t, box, inside) && t <= t_max) {
    found = true;
    set_box_hit(box_ray, proxy.boxes[static_cast<size_t>(box->part)], *box, t, inside, hit);
    t_max = hit.t;
  }
  for (size_t i = 0; i < proxy.quads.size(); ++i) {
    const int part = static_cast<int>(proxy.boxes.size() + i);
    if (part == from || !proxy.has_part(proxy.quads[i].joins, joins)) continue;
    ProxyHit met;
    if (!intersect_quad(ray, box_ray, proxy.quads[i], t_max, met) || (found && !(met.t < hit.t))) continue;
    found = true;
    hit = met, hit.part = part;
    t_max = hit.t;
  }
  return found;
}

}  // namespace render
