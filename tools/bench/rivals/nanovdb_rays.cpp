/// What nanovdb::firstActive (NanoVDB 32.4.2) gets wrong, and first_active() below does not:
///   - after a step it looks at ray(time + 1.0001), a whole voxel further on: thin things and corners are skipped. Here
///     the node that the step leads into is HDDA::voxel(), exact on the axis of the step, and the rounded position is
///     held within it;
///   - getDim() of a leaf may say 8 (a leaf can be flagged to be skipped) although voxels of it are active. Here
///     probeLeaf() decides whether voxels are walked one by one;
///   - HDDA::update() takes its voxel from the rounded position of the plane just crossed, which may be the near side.
///     Here the voxel is taken before update(); the one step too many that follows leads into the same voxel.
/// What remains is float: where two planes are crossed at nearly the same time, the order may be wrong.
#include "tools/bench/rivals/nanovdb_rays.h"

#include <algorithm>

#include <nanovdb/util/GridHandle.h>
#include <nanovdb/util/HDDA.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/Ray.h>

#include "tools/bench/benchmark.h"
#include "tools/bench/rivals/mask_grid.h"

namespace tools {

namespace {

using Grid = nanovdb::NanoGrid<nanovdb::ValueMask>;
using Ray = nanovdb::Ray<float>;
using Accessor = nanovdb::DefaultReadAccessor<nanovdb::ValueMask>;
using nanovdb::Coord;

/// Rays that start on a face would find themselves in the voxel behind it.
constexpr float kNear = 1e-4f;

Ray nano_ray(const BenchRay& ray) {
  nanovdb::Vec3f eye, direction;
  for (int a = 0; a < 3; ++a)
    eye[a] = static_cast<float>(ray.voxel[a]) + ray.fraction[a], direction[a] = ray.direction[a];
  return Ray(eye, direction, kNear, 1e9f);
}

RayAnswer first_active(const Accessor& accessor, const BenchRay& bench_ray) {
  Ray ray = nano_ray(bench_ray);
  if (!ray.clip(accessor.root().bbox())) return {};
  Coord at = nanovdb::RoundDown<Coord>(ray(ray.t0()));
  nanovdb::HDDA<Ray, Coord> walk(ray, accessor.probeLeaf(at) ? 1 : static_cast<int>(accessor.getDim(at, ray)));
  for (;;) {
    if (const auto* leaf = accessor.probeLeaf(at)) {
      walk.update(ray, 1);
      const Coord origin = at & ~7;
      do {
        if (leaf->isActive(at)) return {true, {at[0], at[1], at[2]}};
        if (!walk.step()) return {};
        at = walk.voxel();
      } while ((at & ~7) == origin);
      continue;
    }
    if (accessor.isActive(at)) return {true, {at[0], at[1], at[2]}};
    walk.update(ray, static_cast<int>(accessor.getDim(at, ray)));
    if (!walk.step()) return {};
    const Coord node = walk.voxel(), rounded = nanovdb::RoundDown<Coord>(ray(walk.time()));
    for (int a = 0; a < 3; ++a) at[a] = std::clamp(rounded[a], node[a], node[a] + walk.dim() - 1);
  }
}

RayAnswer stock_first_active(const Accessor& accessor, const BenchRay& bench_ray) {
  Ray ray = nano_ray(bench_ray);
  Coord at;
  float t = 0;
  if (!nanovdb::firstActive(ray, accessor, at, t)) return {};
  return {true, {at[0], at[1], at[2]}};
}

}  // namespace

struct NanoVdbRays::State {
  nanovdb::GridHandle<> handle;
  const Grid* grid = nullptr;

  template <class First>
  double cast(std::span<const BenchRay> rays, First first) const {
    return cast_in_parallel(rays.size(), [&](size_t begin, size_t end) {
      const Accessor accessor = grid->getAccessor();
      for (size_t i = begin; i < end; ++i) keep(first(accessor, rays[i]));
    });
  }
  template <class First>
  std::vector<RayAnswer> answers(std::span<const BenchRay> rays, First first) const {
    const Accessor accessor = grid->getAccessor();
    std::vector<RayAnswer> answers;
    for (const BenchRay& ray : rays) answers.push_back(first(accessor, ray));
    return answers;
  }
};

NanoVdbRays::NanoVdbRays(const world::MaskVolume& occupied) : state_(new State) {
  openvdb::MaskGrid grid;
  fill_mask_grid(occupied, grid);
  state_->handle = nanovdb::openToNanoVDB(grid, nanovdb::StatsMode::BBox, nanovdb::ChecksumMode::Disable);
  state_->grid = state_->handle.grid<nanovdb::ValueMask>();
  CHECK(state_->grid);
}
NanoVdbRays::~NanoVdbRays() = default;

double NanoVdbRays::first_hits(std::span<const BenchRay> rays) const { return state_->cast(rays, first_active); }
double NanoVdbRays::stock_first_hits(std::span<const BenchRay> rays) const {
  return state_->cast(rays, stock_first_active);
}
std::vector<RayAnswer> NanoVdbRays::answers(std::span<const BenchRay> rays) const {
  return state_->answers(rays, first_active);
}
std::vector<RayAnswer> NanoVdbRays::stock_answers(std::span<const BenchRay> rays) const {
  return state_->answers(rays, stock_first_active);
}
size_t NanoVdbRays::bytes() const { return state_->handle.size(); }

}  // namespace tools
