#include "tools/play/pick.h"

#include <algorithm>
#include <cmath>

namespace tools {

using world::Vec3d;
using world::Vec3f;
using world::VoxelPos;

namespace {

struct PartHit {
  double t = world::kInfinity;
  int face = world::kFacePosY;
};

/// A ray from `origin`, relative to the voxel's corner, against a box; t >= 0, entered from outside.
void meet_box(const Vec3d& origin, const Vec3d& direction, const Vec3f& low, const Vec3f& high, PartHit& nearest) {
  double enter = -world::kInfinity, leave = world::kInfinity;
  int face = -1;
  for (int a = 0; a < 3; ++a) {
    const double l = low[a], h = high[a];
    if (direction[a] == 0) {
      if (origin[a] < l || origin[a] > h) return;
      continue;
    }
    double t0 = (l - origin[a]) / direction[a], t1 = (h - origin[a]) / direction[a];
    if (t0 > t1) std::swap(t0, t1);
    if (t0 > enter) enter = t0, face = world::entered_face(a, direction[a] > 0);
    leave = std::min(leave, t1);
  }
  if (enter > leave || enter < 0 || face < 0 || enter >= nearest.t) return;
  nearest = {enter, face};
}

void meet_quad(const Vec3d& origin, const Vec3d& direction, const world::ProxyQuad& quad,
               const world::Proxy::Frame& frame, PartHit& nearest) {
  const double along = glm::dot(frame.normal, direction);
  if (along == 0) return;
  const Vec3d corner(quad.corner);
  const double t = glm::dot(frame.normal, corner - origin) / along;
  if (!(t >= 0) || t >= nearest.t) return;
  const Vec3d p = origin + t * direction - corner;
  const double u = glm::dot(p, frame.along_u), v = glm::dot(p, frame.along_v);
  if (u < 0 || u > 1 || v < 0 || v > 1) return;
  const Vec3d facing = along < 0 ? frame.normal : -frame.normal;
  int axis = 0;
  for (int a = 1; a < 3; ++a)
    if (std::abs(facing[a]) > std::abs(facing[axis]) + 1e-9) axis = a;
  nearest = {t, axis * 2 + (facing[axis] > 0 ? 1 : 0)};
}

}  // namespace

bool is_replaceable(const world::BlockPalette& palette, const world::BlockShapes& shapes, world::BlockId block) {
  const world::Phase phase = palette[block].phase;
  if (block == world::kAir || phase == world::Phase::gas || phase == world::Phase::liquid) return true;
  const world::Proxy* shape = shapes.shape[block];
  return shape && shape->boxes.empty();
}

Pick pick(const world::World& world, const world::BlockShapes& shapes, const world::WorldPoint& eye,
          const Vec3d& direction, double reach_m, bool fluids) {
  const world::BlockPalette& palette = *world.palette;
  Pick found;
  for (world::FlatWalk walk(world::GridRay(eye, direction, reach_m)); walk.inside(); walk.step()) {
    const VoxelPos v = walk.voxel();
    const world::BlockId block = world.store.get(v);
    const world::Phase phase = palette[block].phase;
    if (block == world::kAir || phase == world::Phase::gas) continue;
    if (phase == world::Phase::liquid && !fluids) continue;
    const world::Proxy* shape = shapes.shape[block];
    found.voxel = v, found.block = block;
    found.replaceable = is_replaceable(palette, shapes, block);
    if (!shape) {
      if (walk.face() == world::kNoFace) continue;  // the eye is in it
      found.hit = true, found.face = walk.face(), found.distance = walk.t();
      return found;
    }
    const uint8_t joins = shapes.joins_at(*shape, v, [&](VoxelPos beside) { return world.store.get(beside); });
    const Vec3d origin = eye - world::WorldPoint{v, Vec3d(0)};
    PartHit nearest;
    for (const world::ProxyBox& box : shape->boxes)
      if (world::Proxy::has_part(box.joins, joins)) meet_box(origin, direction, box.low, box.high, nearest);
    for (size_t q = 0; q < shape->quads.size(); ++q)
      if (world::Proxy::has_part(shape->quads[q].joins, joins))
        meet_quad(origin, direction, shape->quads[q], shape->frames[q], nearest);
    if (nearest.t > reach_m) continue;
    found.hit = true, found.face = nearest.face, found.distance = nearest.t;
    if (!shape->bounds.empty()) found.low = shape->bounds[joins].low, found.high = shape->bounds[joins].high;
    return found;
  }
  return Pick{};
}

std::optional<VoxelPos> room_to_pour(const world::World& world, const world::BlockShapes& shapes, VoxelPos from,
                                     world::BlockId liquid) {
  constexpr int kMostAboveM = 16;
  for (VoxelPos v = from; v.y <= from.y + kMostAboveM && world::inside_world(v); ++v.y) {
    const world::BlockId there = world.store.get(v);
    if (there != liquid) return is_replaceable(*world.palette, shapes, there) ? std::optional(v) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace tools
