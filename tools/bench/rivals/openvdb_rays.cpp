#include "tools/bench/rivals/openvdb_rays.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/RayIntersector.h>

#include "tools/bench/benchmark.h"
#include "tools/bench/rivals/mask_grid.h"

namespace tools {

namespace {

using Ray = openvdb::math::Ray<double>;
using Intersector = openvdb::tools::VolumeRayIntersector<openvdb::MaskGrid>;
using Accessor = openvdb::tree::ValueAccessor<const openvdb::MaskTree, false>;

/// Rays that start on a face would find themselves in the voxel behind it.
constexpr double kNear = 1e-4;

RayAnswer first_active(Intersector& intersector, Accessor& accessor, const BenchRay& bench_ray) {
  const world::GridRay from = bench_ray.grid();
  const openvdb::Vec3d eye(from.voxel.x + from.fraction.x, from.voxel.y + from.fraction.y,
                           from.voxel.z + from.fraction.z);
  const Ray ray(eye, openvdb::Vec3d(from.direction.x, from.direction.y, from.direction.z), kNear);
  if (!intersector.setIndexRay(ray)) return {};
  for (double t0 = 0, t1 = 0; intersector.march(t0, t1);) {
    openvdb::math::DDA<Ray, 0> voxels(ray, t0, t1);
    do {
      const openvdb::Coord& v = voxels.voxel();
      if (accessor.isValueOn(v)) return {true, {v.x(), v.y(), v.z()}};
    } while (voxels.step());
  }
  return {};
}

}  // namespace

struct OpenVdbRays::State {
  openvdb::MaskGrid::Ptr grid = openvdb::MaskGrid::create();
  std::unique_ptr<Intersector> intersector;
};

OpenVdbRays::OpenVdbRays(const world::MaskVolume& occupied) : state_(new State) {
  fill_mask_grid(occupied, *state_->grid);
  state_->intersector = std::make_unique<Intersector>(*state_->grid);
}
OpenVdbRays::~OpenVdbRays() = default;

double OpenVdbRays::first_hits(std::span<const BenchRay> rays) const {
  return cast_in_parallel(rays.size(), [&](size_t begin, size_t end) {
    Intersector intersector(*state_->intersector);  // a shallow copy with an accessor of its own
    Accessor accessor(state_->grid->tree());
    for (size_t i = begin; i < end; ++i) keep(first_active(intersector, accessor, rays[i]));
  });
}

std::vector<RayAnswer> OpenVdbRays::answers(std::span<const BenchRay> rays) const {
  Intersector intersector(*state_->intersector);
  Accessor accessor(state_->grid->tree());
  std::vector<RayAnswer> answers;
  for (const BenchRay& ray : rays) answers.push_back(first_active(intersector, accessor, ray));
  return answers;
}

}  // namespace tools
