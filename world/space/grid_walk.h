/// Walking a ray through the voxels of the integer grid, one face at a time; the same at any distance from the origin.
///
/// A ray starts at a voxel plus a fraction of it; all arithmetic is on offsets from that voxel. The voxel list is the
/// merge of three sequences of plane crossings: the ray crosses plane k of an axis at
///   t(k) = (k - fraction) * inverse_direction     in double, from the integer k each time, never by adding up,
/// and crossings are taken in order of (t, axis), so an exact edge or corner is passed in face steps: x, then y, then
/// z. error  the voxel list is exact except where two crossings differ by a few ulp of t (measured against ExactWalk in
///        tests/world/space/grid_walk_test.cpp)
/// source John Amanatides, Andrew Woo. A Fast Voxel Traversal Algorithm for Ray Tracing. 1987, without its sums
///
/// Rules at the edges of the definition:
///   start on a boundary  the start is the ray's own voxel, whatever the direction; going down from fraction 0 (or up
///                        from fraction 1) it is left at t = 0, so the walk from x = 3 along -x is 3 (length 0), 2, 1,
///                        ...
///   zero component       never stepped; so is one below kTinyDirection, whose inverse would overflow
///   t_max                a crossing at t = t_max still counts, one beyond it does not
///   world border         the step that leaves [-kWorldBorder, kWorldBorder) ends the walk as left_world
///   no direction         visits the start and ends
///   NaN, infinity, a fraction outside [0, 1], a start outside the world: rejected; nothing is visited
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "world/space/world_point.h"

namespace world {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kTinyDirection = 0x1p-1000, kHugeDirection = 0x1p1000;

struct GridRay {
  VoxelPos voxel;            // start, within the world's border
  Vec3d fraction{0.0};       // 0 <= fraction <= 1 of that voxel
  Vec3d direction{0.0};      // any length; t counts in it
  double t_max = kInfinity;  // >= 0

  GridRay() = default;
  GridRay(const WorldPoint& start, const Vec3d& along, double limit = kInfinity)
      : voxel(start.voxel), fraction(start.fraction), direction(along), t_max(limit) {}

  bool valid() const {
    for (int a = 0; a < 3; ++a)
      if (!(fraction[a] >= 0 && fraction[a] <= 1) || !(std::abs(direction[a]) <= kHugeDirection)) return false;
    return t_max >= 0 && inside_world(voxel);
  }
  bool degenerate() const {
    for (int a = 0; a < 3; ++a)
      if (std::abs(direction[a]) >= kTinyDirection) return false;
    return true;
  }
};

constexpr int kNoFace = -1;
/// The face of the voxel entered by a step along the axis.
constexpr int entered_face(int axis, bool upwards) { return axis * 2 + (upwards ? 0 : 1); }

/// A ray made ready: per axis, t(k) = (k - fraction) * inverse. An axis that is never stepped has direction 0 and
/// inverse +infinity and counts as upwards: its next plane lies above the fraction, so its t is +infinity, never NaN.
struct GridAxes {
  double fraction[3], direction[3], inverse[3];
  int32_t origin[3];
  int32_t upwards[3];  // -1 (all bits) or 0

  explicit GridAxes(const GridRay& ray) {
    for (int a = 0; a < 3; ++a) {
      const bool steps = std::abs(ray.direction[a]) >= kTinyDirection;
      fraction[a] = ray.fraction[a];
      direction[a] = steps ? ray.direction[a] : 0.0;
      inverse[a] = steps ? 1.0 / ray.direction[a] : kInfinity;
      origin[a] = ray.voxel[a];
      upwards[a] = direction[a] >= 0 ? -1 : 0;
    }
    settle_fractions();
  }
  /// A fraction of exactly 1 on an axis that never steps would make 0 * infinity.
  void settle_fractions() {
    for (int a = 0; a < 3; ++a)
      if (direction[a] == 0 && fraction[a] == 1.0) fraction[a] = 0.5;
  }
  /// Where the ray crosses the plane between the voxels plane - 1 and plane.
  double t_at(int axis, int32_t plane) const {
    return (static_cast<double>(plane - origin[axis]) - fraction[axis]) * inverse[axis];
  }
};

enum class WalkEnd : int { hit, t_max, left_world, rejected };

struct GridHit {
  WalkEnd end = WalkEnd::rejected;
  VoxelPos voxel;      // where end is hit
  int face = kNoFace;  // through which it was entered; kNoFace where the ray started in it
  double t = 0;
  bool hit() const { return end == WalkEnd::hit; }
};

/// A ray from the surface that `hit` found along `ray` (hit.face is a face): it starts in the voxel in front of that
/// face, on the face exactly. No offset is needed, and the hit voxel itself can't be met again unless the ray turns
/// back.
inline GridRay ray_from_surface(const GridRay& ray, const GridHit& hit, const Vec3d& direction) {
  GridRay next;
  const int axis = face_axis(hit.face);
  next.voxel = hit.voxel + face_step(hit.face);
  next.direction = direction;
  for (int a = 0; a < 3; ++a) {
    const double offset = ray.fraction[a] + hit.t * ray.direction[a] - (double(hit.voxel[a]) - ray.voxel[a]);
    next.fraction[a] = a == axis ? (face_sign(hit.face) > 0 ? 0.0 : 1.0) : std::min(std::max(offset, 0.0), 1.0);
  }
  return next;
}

/// One voxel at a time.
///   for (FlatWalk walk(ray); walk.inside(); walk.step()) visit(walk.voxel(), walk.t(), walk.face());
class FlatWalk {
 public:
  explicit FlatWalk(const GridRay& ray)
      : axes_(ray), voxel_(ray.voxel), t_max_(ray.t_max), inside_(ray.valid()), end_(WalkEnd::rejected) {
    if (!inside_) return;
    for (int a = 0; a < 3; ++a)
      t_next_[a] = axes_.direction[a] == 0 ? kInfinity : axes_.t_at(a, voxel_[a] + (axes_.upwards[a] ? 1 : 0));
  }
  /// From the voxel of `from` to the voxel of `to` (floors of their coordinates), both included: exactly as many steps
  /// as the sum of the differences of their coordinates, whatever the rounding of t. t runs from 0 to 1.
  static FlatWalk segment(const WorldPoint& from, const WorldPoint& to) {
    FlatWalk walk{GridRay(from, to - from)};
    for (int a = 0; a < 3; ++a) {
      const int64_t steps = (int64_t{to.voxel[a]} - from.voxel[a]) * (walk.axes_.upwards[a] ? 1 : -1);
      walk.left_[a] = steps > 0 ? steps : 0;
      if (walk.left_[a] == 0) walk.t_next_[a] = kInfinity;
    }
    return walk;
  }

  bool inside() const { return inside_; }
  VoxelPos voxel() const { return voxel_; }
  double t() const { return t_; }     // where the voxel was entered
  int face() const { return face_; }  // through which it was entered
  uint64_t steps() const { return steps_; }
  /// Why the walk is over, once inside() is false.
  WalkEnd end() const { return end_; }

  void step() {
    const int axis = t_next_[0] <= t_next_[1] ? (t_next_[0] <= t_next_[2] ? 0 : 2) : (t_next_[1] <= t_next_[2] ? 1 : 2);
    const double t = t_next_[axis];
    if (!(t <= t_max_) || t == kInfinity) return finish(WalkEnd::t_max);
    const bool up = axes_.upwards[axis] != 0;
    voxel_[axis] += up ? 1 : -1;
    ++steps_;
    t_ = t;
    face_ = entered_face(axis, up);
    if (voxel_[axis] == (up ? kWorldBorder : -kWorldBorder - 1)) return finish(WalkEnd::left_world);
    t_next_[axis] = --left_[axis] == 0 ? kInfinity : axes_.t_at(axis, voxel_[axis] + (up ? 1 : 0));
  }

 private:
  void finish(WalkEnd end) {
    inside_ = false;
    end_ = end;
  }

  GridAxes axes_;
  VoxelPos voxel_;
  double t_ = 0, t_max_;
  double t_next_[3] = {kInfinity, kInfinity, kInfinity};
  int64_t left_[3] = {-1, -1, -1};  // steps before the axis stops; negative: never
  uint64_t steps_ = 0;
  int face_ = kNoFace;
  bool inside_;
  WalkEnd end_;
};

/// The first voxel for which solid(voxel) holds, by the flat walk: the definition that faster walks must equal.
template <class Solid>
GridHit first_hit_flat(const GridRay& ray, Solid solid) {
  FlatWalk walk(ray);
  for (; walk.inside(); walk.step())
    if (solid(walk.voxel())) return {WalkEnd::hit, walk.voxel(), walk.face(), walk.t()};
  return {walk.end(), walk.voxel(), kNoFace, walk.t()};
}

/// Where the ray lies inside the box of corners [low, high], in voxels from the world's origin; t0 > t1: misses.
struct RayInterval {
  double t0 = 1, t1 = 0;
  bool empty() const { return !(t0 <= t1); }
};
/// The slab test, conservative: no ray that touches the closed box is missed (the far bound is widened by 2 gamma_3).
/// A ray that runs in a slab's own plane counts as inside that slab.
/// source Thiago Ize. Robust BVH Ray Traversal. 2013
RayInterval intersect_box(const GridRay& ray, const Vec3d& low, const Vec3d& high);

}  // namespace world
