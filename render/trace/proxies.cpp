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
  double t0, t1;
  int axis0, axis1;
  int planes0, planes1;  // crossed at exactly t0, t1: 2 at an edge, 3 at a corner
};

bool intersect_box(const BoxRay& ray, const ProxyBox& box, BoxSpan& span) {
  span = {-world::kInfinity, world::kInfinity, 0, 0, 0, 0};
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

/// Whether the ray comes through the bounds at t >= 0. Their planes lie no further in than any part's, and t is
/// monotone in the plane, so no part is lost.
bool meets(const BoxRay& ray, const Proxy::Bounds& bounds, double t_max) {
  double t0 = 0, t1 = t_max;
  for (int a = 0; a < 3; ++a) {
    const double low = ray.distance(a, bounds.low[a]), high = ray.distance(a, bounds.high[a]);
    if (ray.direction[a] == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const double t_low = low * ray.inverse[a], t_high = high * ray.inverse[a];
    t0 = std::max(t0, std::min(t_low, t_high)), t1 = std::min(t1, std::max(t_low, t_high));
  }
  return t0 <= t1;
}

void set_box_hit(const BoxRay& ray, const ProxyBox& box, const BoxSpan& span, int part, bool inside, ProxyHit& hit) {
  const int axis = inside ? span.axis1 : span.axis0;
  const double t = inside ? span.t1 : std::max(span.t0, 0.0);
  const bool high = (ray.direction[axis] > 0) == inside;  // which of the two faces
  hit = {.t = t, .part = part, .inside = inside};
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

/// From within: to the far end of whatever boxes overlap or touch.
void leave_boxes(const BoxRay& ray, const Proxy& proxy, uint8_t joins, ProxyHit& hit) {
  BoxSpan span, last{0, 0, 0, 0, 0, 4};
  int part = kNoPart;
  for (bool grown = true; grown;) {
    grown = false;
    for (size_t i = 0; i < proxy.boxes.size(); ++i) {
      if (!Proxy::has_part(proxy.boxes[i].joins, joins) || !intersect_box(ray, proxy.boxes[i], span)) continue;
      if (span.t0 > last.t1 || span.t1 < last.t1) continue;
      if (span.t1 == last.t1 && span.planes1 >= last.planes1) continue;
      last = span, part = static_cast<int>(i), grown = true;
    }
  }
  set_box_hit(ray, proxy.boxes[static_cast<size_t>(part)], last, part, true, hit);
}

/// The first border of the union of the boxes at or after the start. A ray is inside where it starts within a box, on
/// the box `from` and enters it, or between two that touch. Of boxes with a border at the same t it takes one that has
/// it in the fewest planes: others are met at an edge, and may name a face within the union.
bool intersect_boxes(const BoxRay& ray, const Proxy& proxy, uint8_t joins, int from, double t_max, ProxyHit& hit) {
  BoxSpan span, first{world::kInfinity, 0, 0, 0, 0, 0};
  int part = kNoPart;
  bool inside = false, ends_here = false;
  for (size_t i = 0; i < proxy.boxes.size(); ++i) {
    if (!Proxy::has_part(proxy.boxes[i].joins, joins) || !intersect_box(ray, proxy.boxes[i], span)) continue;
    if (span.t1 == 0) {
      ends_here |= span.t0 < 0 && from == kNoPart;  // the ray would have come through it
      continue;
    }
    inside |= span.t0 < 0 || (span.t0 == 0 && static_cast<int>(i) == from);
    if (span.t0 < first.t0 || (span.t0 == first.t0 && span.planes0 < first.planes0))
      first = span, part = static_cast<int>(i);
  }
  if (part == kNoPart) return false;
  inside |= ends_here && first.t0 == 0;
  if (inside)
    leave_boxes(ray, proxy, joins, hit);
  else
    set_box_hit(ray, proxy.boxes[static_cast<size_t>(part)], first, part, false, hit);
  return hit.t <= t_max;
}

/// The quad as two triangles, watertight with its neighbours; most misses are seen beforehand from its plane.
bool intersect_quad(const Vec3d& origin, const Vec3d& direction, const ProxyQuad& quad, const Proxy::Frame& frame,
                    double t_max, ProxyHit& hit) {
  const Vec3d a(quad.corner), from_corner = origin - a;
  const double slope = dot(frame.normal, direction), size = dot(abs(frame.normal), abs(direction));
  if (std::abs(slope) > 1e-3 * size) {
    // Far less exact than kMargin only beyond 10^9 voxels, which rays between neighbouring voxels never are.
    constexpr double kMargin = 1e-3;
    const Vec3d p = from_corner - dot(frame.normal, from_corner) / slope * direction;
    const double u = dot(p, frame.along_u), v = dot(p, frame.along_v);
    if (u < -kMargin || u > 1 + kMargin || v < -kMargin || v > 1 + kMargin) return false;
  }
  const Vec3d b(quad.corner + quad.u), c(quad.corner + quad.u + quad.v), d(quad.corner + quad.v);
  auto met = world::intersect_triangle<double>(origin, direction, a, b, c, t_max);
  if (!met) met = world::intersect_triangle<double>(origin, direction, a, c, d, t_max);
  if (!met) return false;
  hit = {.t = met->t, .point = met->on_surface.point, .error = met->on_surface.error};
  hit.normal = Vec3f(world::safe_normalize(frame.normal));
  return true;
}

}  // namespace

bool intersect_proxy(const Proxy& proxy, uint8_t joins, const GridRay& ray, world::VoxelPos voxel, double t_max,
                     ProxyHit& hit, int from) {
  const BoxRay box_ray(ray, voxel);
  if (!meets(box_ray, proxy.bounds[joins], t_max)) return false;
  bool found = intersect_boxes(box_ray, proxy, joins, from, t_max, hit);
  if (found) t_max = hit.t;
  if (proxy.quads.empty()) return found;
  const Vec3d origin(box_ray.fraction[0] - box_ray.offset[0], box_ray.fraction[1] - box_ray.offset[1],
                     box_ray.fraction[2] - box_ray.offset[2]);
  for (size_t i = 0; i < proxy.quads.size(); ++i) {
    const int part = static_cast<int>(proxy.boxes.size() + i);
    if (part == from || !Proxy::has_part(proxy.quads[i].joins, joins)) continue;
    ProxyHit met;
    if (!intersect_quad(origin, ray.direction, proxy.quads[i], proxy.frames[i], t_max, met)) continue;
    if (found && !(met.t < hit.t)) continue;
    found = true;
    hit = met, hit.part = part;
    t_max = hit.t;
  }
  return found;
}

}  // namespace render
