#include "render/raycast/tile_beam.h"

#include <algorithm>
#include <cmath>

namespace render {

using world::MaskRegion;
using world::MaskVolume;
using world::VoxelPos;

namespace {

/// A slab of more cells than this is not looked at: rays do better one by one.
constexpr int64_t kMostCells = 64;

/// Slopes of the pyramid against its axis: the extent at distance D along it is fraction + D * [low, high].
struct Pyramid {
  int axis, other[2];
  bool upwards;
  double low[2], high[2];
};

/// Inclusive voxels of one cross axis that the pyramid touches between two distances, padded for rounding.
void extent(const world::WorldPoint& camera, const Pyramid& p, int k, double near, double far, int64_t& from,
            int64_t& to) {
  constexpr double kPad = 0x1p-8;
  const double f = camera.fraction[p.other[k]];
  const double low = f + std::min(near * p.low[k], far * p.low[k]) - kPad;
  const double high = f + std::max(near * p.high[k], far * p.high[k]) + kPad;
  constexpr double kFar = 0x1p40;
  from = camera.voxel[p.other[k]] + static_cast<int64_t>(std::floor(std::max(low, -kFar)));
  to = camera.voxel[p.other[k]] + static_cast<int64_t>(std::floor(std::min(high, kFar)));
}

bool cell_clear(const MaskVolume& volume, int log2, VoxelPos v) {
  const MaskRegion* region = volume.region(world::region_from_voxel(v));
  if (!region) return true;
  if (log2 == 7) return false;
  const world::LeafPos leaf = world::leaf_from_voxel(v);
  if (log2 == 5) return !(region->any_groups >> world::leaf_group(leaf) & 1);
  if (log2 == 3 || !region->leaf_any(leaf)) return !region->leaf_any(leaf);
  if (region->leaf_full(leaf)) return false;
  // 2^3 or 4^3 voxels of a mixed leaf.
  const world::LeafMask& mask = region->leaf(leaf);
  if (log2 == 0) return !mask.test(v);
  const int x = v.x & 7, shift = (v.y & 7) * 8 + (v.z & 7);
  const uint64_t pair = mask.word[x] | mask.word[x + 1];
  if (log2 == 1) return (pair >> shift & 0x0303) == 0;
  return ((pair | mask.word[x + 2] | mask.word[x + 3]) >> shift & 0x0f0f0f0f) == 0;
}

}  // namespace

TileBeam tile_beam(const world::MaskWalker& walker, const world::WorldPoint& camera, const PixelRays& rays, double x0,
                   double y0, double x1, double y1, const TileBeam& parent) {
  const Vec3d corner[4] = {rays.direction(x0, y0), rays.direction(x1, y0), rays.direction(x0, y1),
                           rays.direction(x1, y1)};
  const Vec3d middle = rays.direction((x0 + x1) / 2, (y0 + y1) / 2);
  Pyramid p;
  p.axis = parent.axis;
  if (p.axis < 0) {
    p.axis = std::abs(middle.x) >= std::abs(middle.y) ? 0 : 1;
    if (std::abs(middle.z) > std::abs(middle[p.axis])) p.axis = 2;
  }
  p.upwards = middle[p.axis] > 0;
  for (const Vec3d& d : corner)
    if (!((p.upwards ? d[p.axis] : -d[p.axis]) > 0.01 * glm::length(d))) return {};
  for (int k = 0; k < 2; ++k) {
    p.other[k] = k == 0 ? (p.axis == 0 ? 1 : 0) : (p.axis == 2 ? 1 : 2);
    p.low[k] = world::kInfinity, p.high[k] = -world::kInfinity;
    for (const Vec3d& d : corner) {
      const double slope = d[p.other[k]] / std::abs(d[p.axis]);
      p.low[k] = std::min(p.low[k], slope), p.high[k] = std::max(p.high[k], slope);
    }
  }

  const MaskVolume& volume = walker.volume();
  const int32_t* low = walker.low();
  const int32_t* high = walker.high();
  const int32_t start = camera.voxel[p.axis];
  // `at`: all cells before this plane are clear. The camera's own voxel is, so it begins behind or before it.
  int32_t at = parent.axis >= 0 ? parent.plane : p.upwards ? start : start + 1;
  const auto distance = [&](int64_t plane) {
    const double d = static_cast<double>(plane - start) - camera.fraction[p.axis];
    return std::max(0.0, p.upwards ? d : -d);
  };
  TileBeam beam;
  for (;;) {
    // Outside the bounds along the axis: jump to them, or be done.
    if (p.upwards ? at >= high[p.axis] : at <= low[p.axis]) return {p.axis, at, true};
    if (p.upwards ? at < low[p.axis] : at > high[p.axis]) {
      at = p.upwards ? low[p.axis] : high[p.axis];
      beam = {p.axis, at, false};
    }
    bool passed = false;
    for (const int log2 : {7, 5, 3, 2, 1, 0}) {
      const int32_t size = 1 << log2, cell = (p.upwards ? at : at - 1) & ~(size - 1);
      // Larger slabs only from their own near plane on, or from the start.
      const int32_t next = p.upwards ? cell + size : cell;
      const double near = distance(at), far = distance(next);
      int64_t from[2], to[2];
      bool outside = false;
      for (int k = 0; k < 2; ++k) {
        extent(camera, p, k, near, far, from[k], to[k]);
        const int b = p.other[k];
        // Past the bounds and widening away from them: nothing will ever be met.
        if ((from[k] >= high[b] && p.low[k] >= 0) || (to[k] < low[b] && p.high[k] <= 0)) outside = true;
        from[k] = std::max<int64_t>(from[k], low[b]), to[k] = std::min<int64_t>(to[k], high[b] - 1);
      }
      if (outside) return {p.axis, at, true};
      const int64_t wide = from[0] <= to[0] ? (to[0] >> log2) - (from[0] >> log2) + 1 : 0;
      const int64_t tall = from[1] <= to[1] ? (to[1] >> log2) - (from[1] >> log2) + 1 : 0;
      if (wide * tall > kMostCells) continue;
      bool clear = true;
      VoxelPos v;
      v[p.axis] = cell;
      for (int64_t b = from[0] >> log2; clear && wide * tall > 0 && b <= to[0] >> log2; ++b)
        for (int64_t c = from[1] >> log2; clear && c <= to[1] >> log2; ++c) {
          v[p.other[0]] = static_cast<int32_t>(b << log2), v[p.other[1]] = static_cast<int32_t>(c << log2);
          clear = cell_clear(volume, log2, v);
        }
      if (clear) {
        at = next;
        passed = true;
        beam = {p.axis, at, false};
        break;
      }
    }
    if (!passed) return beam.axis < 0 ? parent : beam;
  }
}

FreePlane free_plane(const world::MaskWalker& walker, const world::VoxelBox& box, const Vec3d& direction) {
  constexpr double kPad = 0x1p-8;
  int axis = std::abs(direction.x) >= std::abs(direction.y) ? 0 : 1;
  if (std::abs(direction.z) > std::abs(direction[axis])) axis = 2;
  const int other[2] = {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2};
  const bool upwards = direction[axis] > 0;
  const int32_t* low = walker.low();
  const int32_t* high = walker.high();
  const int32_t start = upwards ? box.min[axis] : box.max[axis] + 1;  // no ray starts before this plane
  const int32_t last = upwards ? box.max[axis] + 1 : box.min[axis];   // nor behind this one

  // All beyond `at` is clear for these rays.
  int32_t at = upwards ? high[axis] : low[axis];
  while (upwards ? at > start : at < start) {
    bool passed = false;
    for (const int log2 : {7, 5, 3}) {
      const int32_t size = 1 << log2, cell = (upwards ? at - 1 : at) & ~(size - 1), next = upwards ? cell : cell + size;
      // How far along the axis a ray may have come within the slab: from the last start, and from the first.
      const double least = std::max(0.0, upwards ? double(next) - last : double(last) - next);
      const double most = std::max(0.0, upwards ? double(at) - start : double(start) - at);
      int64_t from[2], to[2];
      bool empty = false;
      for (int k = 0; k < 2; ++k) {
        const int b = other[k];
        const double slope = direction[b] / std::abs(direction[axis]);
        const double nearest = box.min[b] + std::min(least * slope, most * slope) - kPad;
        const double farthest = box.max[b] + 1 + std::max(least * slope, most * slope) + kPad;
        from[k] = std::max(static_cast<int64_t>(std::floor(nearest)), int64_t{low[b]}) >> log2;
        to[k] = std::min(static_cast<int64_t>(std::floor(farthest)), int64_t{high[b]} - 1) >> log2;
        empty |= from[k] > to[k];
      }
      if (!empty && (to[0] - from[0] + 1) * (to[1] - from[1] + 1) > kMostCells) continue;
      bool clear = true;
      VoxelPos v;
      v[axis] = cell;
      for (int64_t b = from[0]; clear && !empty && b <= to[0]; ++b)
        for (int64_t c = from[1]; clear && c <= to[1]; ++c) {
          v[other[0]] = static_cast<int32_t>(b << log2), v[other[1]] = static_cast<int32_t>(c << log2);
          clear = cell_clear(walker.volume(), log2, v);
        }
      if (clear) {
        at = next;
        passed = true;
        break;
      }
    }
    if (!passed) break;
  }
  return {axis, at};
}

}  // namespace render
