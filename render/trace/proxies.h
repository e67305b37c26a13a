/// Rays against the shapes that stand for blocks inside their voxels (world/proxies): a few boxes and quads in the
/// voxel that the grid walk has found. Nothing is built and nothing follows an edit; a ray that misses the shape walks
/// on from that voxel.
///
/// Boxes are solid, and what counts is their union: a ray from outside meets the first face of any, one from within a
/// box leaves the union unseen until its far side (inside = true). Boxes that share a plane share it bit by bit, so no
/// ray slips between them. Quads are seen from both sides.
#pragma once

#include <vector>

#include "world/proxies/proxy.h"
#include "world/space/grid_walk.h"

namespace render {

using world::Vec3d;
using world::Vec3f;

constexpr int kNoPart = -1;

struct ProxyHit {
  double t = 0;         // in lengths of the ray's direction
  Vec3f normal{0};      // geometric, unit: out of a box; of a quad u x v, whichever side the ray comes from
  Vec3d point{0};       // from the corner of the voxel; in the plane of a box's face exactly
  Vec3d error{0};       // of point on each axis; 0 across a box's face
  int part = kNoPart;   // boxes first, then quads
  bool inside = false;  // the ray leaves the union of the boxes
};

/// The first meeting with 0 <= t <= t_max of the shape in `voxel`; `joins` (0..63) as of BlockShapes::joins_at.
///
/// A ray from a surface starts at (voxel, hit.point), with `from` the part of that hit. On a box it starts in the
/// face's plane exactly: leaving, it does not meet that face, or another box's in the same plane; entering, it is
/// inside. The quad that it starts on is not met.
/// error  t of a box's plane: three roundings, the same for all boxes that have it, and for a plane between voxels the
///        grid walk's own; of a quad as of intersect_triangle
bool intersect_proxy(const world::Proxy& proxy, uint8_t joins, const world::GridRay& ray, world::VoxelPos voxel,
                     double t_max, ProxyHit& hit, int from = kNoPart);

}  // namespace render
