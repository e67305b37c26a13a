#include "world/store/mask_walk.h"

#include <algorithm>

namespace world {

namespace mask_walk {

int32_t settle_cell(const GridAxes& axes, int axis, double t, int exit_axis, int32_t current) {
  const double position = axes.fraction[axis] + t * axes.direction[axis];
  const int32_t plane = axes.origin[axis] + static_cast<int32_t>(std::lround(position));
  const double t_plane = axes.t_at(axis, plane);
  const bool crossed = t_plane < t || (t_plane == t && axis < exit_axis);
  return axes.upwards[axis] ? std::max(current, crossed ? plane : plane - 1)
                            : std::min(current, crossed ? plane - 1 : plane);
}

}  // namespace mask_walk

namespace {

/// How a walk without a hit ends: at t_max, or past the border before it.
GridHit missed(const GridAxes& axes, double t_max) {
  double t_exit = kInfinity;
  for (int a = 0; a < 3; ++a)
    if (axes.direction[a] != 0) t_exit = std::min(t_exit, axes.t_at(a, axes.upwards[a] ? kWorldBorder : -kWorldBorder));
  return {t_exit <= t_max && t_exit < kInfinity ? WalkEnd::left_world : WalkEnd::t_max,
          {},
          kNoFace,
          std::min(t_exit, t_max)};
}

GridHit hit_at(const GridAxes& axes, const WalkPlace& place) {
  const int face = place.axis < 0 ? kNoFace : entered_face(place.axis, axes.upwards[place.axis] != 0);
  return {WalkEnd::hit, place.voxel, face, place.t};
}

}  // namespace

MaskWalker::MaskWalker(const MaskVolume& volume) : volume_(&volume) {
  const VoxelPos low = voxel_from_region(volume.min_region());
  const VoxelPos high = voxel_from_region(volume.max_region() + RegionPos{1, 1, 1});
  for (int a = 0; a < 3; ++a) {
    low_[a] = std::max(low[a], -kWorldBorder);
    high_[a] = volume.empty() ? low_[a] : std::min(high[a], kWorldBorder);
  }
}

bool MaskWalker::clip(const GridAxes& axes, WalkPlace& place, double& t_limit) const {
  if (volume_->empty()) return false;
  // The last entry plane in order of (t, axis), and the first exit plane.
  double t_in = 0, t_out = kInfinity;
  int axis_in = -1, axis_out = 3;
  for (int a = 0; a < 3; ++a) {
    const int32_t cell = axes.origin[a];
    const bool up = axes.upwards[a] != 0;
    const bool before = up ? cell < low_[a] : cell >= high_[a];
    if (up ? cell >= high_[a] : cell < low_[a]) return false;
    if (before) {
      const double t = axes.t_at(a, up ? low_[a] : high_[a]);
      if (t >= t_in) t_in = t, axis_in = a;  // ties: the later axis is crossed last
    }
    const double t = axes.t_at(a, up ? high_[a] : low_[a]);
    if (t < t_out) t_out = t, axis_out = a;
  }
  t_limit = std::min({t_limit, t_out, std::numeric_limits<double>::max()});  // finite: no step has t = infinity
  if (axis_in < 0) return true;
  if (!(t_in <= t_limit) || t_in == kInfinity) return false;
  if (t_in == t_out && axis_out < axis_in) return false;
  mask_walk::cross(axes, place, axis_in, t_in, axes.upwards[axis_in] ? low_[axis_in] : high_[axis_in]);
  return true;
}

GridHit MaskWalker::first_set(const GridRay& ray) const {
  if (!ray.valid()) return {};
  const GridAxes axes(ray);
  WalkPlace place{ray.voxel, 0, -1};
  double t_limit = ray.t_max;
  if (clip(axes, place, t_limit) && find(axes, place, t_limit)) return hit_at(axes, place);
  return missed(axes, ray.t_max);
}

GridHit MaskWalker::first_entered(const GridRay& ray) const {
  if (!ray.valid()) return {};
  const GridAxes axes(ray);
  WalkPlace place{ray.voxel, 0, -1};
  double t_limit = ray.t_max;
  if (!clip(axes, place, t_limit)) return missed(axes, ray.t_max);
  // Leave the set voxels around the start, full leaves in one step.
  for (bool inside = place.axis < 0; inside;) {
    const MaskRegion* region = volume_->region(region_from_voxel(place.voxel));
    const LeafPos leaf = leaf_from_voxel(place.voxel);
    inside = region && region->leaf(leaf).test(place.voxel);
    if (inside && !mask_walk::leave_cube(axes, place, region->leaf_full(leaf) ? 7 : 0, t_limit))
      return missed(axes, ray.t_max);
  }
  return find(axes, place, t_limit) ? hit_at(axes, place) : missed(axes, ray.t_max);
}

}  // namespace world
