/// The rays that ray casters are held against: the same for ours and for every rival, a function of the world, the
/// cameras, the size and the seed alone.
///
///   primary  one through each pixel centre, camera after camera, in tiles of 8x8 pixels, each tile in Morton order: so
///            any 4, 8, 16 or 64 rays in a row are a block of pixels, which is what packets want
///   diffuse  one from each primary hit, distributed by the cosine about the face's normal (no two alike: incoherent)
///   shadow   one towards the sun from each primary hit whose face is turned to it
/// Hits are those of the occupied voxels. Rays from a surface start in the voxel in front of the face, on it exactly.
#pragma once

#include <span>
#include <vector>

#include "render/camera.h"
#include "world/base/jobs.h"
#include "world/space/grid_walk.h"
#include "world/store/mask_volume.h"
#include "world/store/ray_stream.h"

namespace tools {

/// Floats, since that is what the rivals take; the start is a voxel and a fraction, exact on the axis of a face.
struct BenchRay {
  world::VoxelPos voxel;
  world::Vec3f fraction;   // 0..1, both included
  world::Vec3f direction;  // unit length, to float

  /// The same ray for our own casters, to infinity.
  world::StreamRay stream() const { return {voxel, fraction, direction}; }
  world::GridRay grid() const { return world::GridRay({voxel, world::Vec3d(fraction)}, world::Vec3d(direction)); }
};
static_assert(sizeof(BenchRay) == 36);

struct RaySets {
  std::vector<BenchRay> primary, diffuse, shadow;
};

RaySets make_ray_sets(const world::MaskVolume& occupied, std::span<const render::Camera> cameras, int width, int height,
                      const world::Vec3d& sun, uint64_t seed);

/// Every `every`-th block of 64 rays: the same mixture for casters that are too slow for all.
std::vector<BenchRay> sample_blocks(std::span<const BenchRay> rays, size_t every);

/// What any caster says of a ray, for comparing them.
struct RayAnswer {
  bool hit = false;
  world::VoxelPos voxel;  // where hit
  friend bool operator==(const RayAnswer& a, const RayAnswer& b) {
    return a.hit == b.hit && (!a.hit || a.voxel == b.voxel);
  }
};

constexpr size_t kRaysAtOnce = 4096;  // by one task, into a buffer that stays in its cache

/// Runs cast(begin, end) over all rays on the threads that the row allows. Returns their number, the work done.
template <class Cast>
double cast_in_parallel(size_t rays, Cast cast) {
  world::parallel_ranges((rays + kRaysAtOnce - 1) / kRaysAtOnce, 1, [&](size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) cast(i * kRaysAtOnce, std::min(rays, (i + 1) * kRaysAtOnce));
  });
  return static_cast<double>(rays);
}

}  // namespace tools
