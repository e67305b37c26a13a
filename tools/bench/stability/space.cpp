/// Rays on the grid, worlds far from the origin and pictures of them: T and R of the catalogue.
#include <cmath>
#include <memory>

#include "tools/bench/stability.h"
#include "tools/picture.h"
#include "world/base/random.h"
#include "world/gen/generator.h"
#include "world/space/grid_walk_variants.h"

namespace tools {

namespace {

/// Rays of a thousand steps that visit a voxel that the exact walk doesn't, in a thousand.
template <class Walk>
double wrong_rays() {
  constexpr int kRays = 400, kSteps = 1000;
  int wrong = 0;
  for (int i = 0; i < kRays; ++i) {
    world::FixedRay ray;
    for (int a = 0; a < 3; ++a) {
      const auto draw = [&](uint64_t stream, double range) {
        return (2 * world::uniform01_double(world::random_bits(3, i, a, 0, 0, stream)) - 1) * range;
      };
      ray.origin[a] = static_cast<int64_t>(static_cast<double>(static_cast<float>(draw(0, 1000))) * 0x1p32);
      ray.direction[a] = static_cast<int32_t>(draw(1, 0x1p24));
    }
    world::ExactWalk exact(ray);
    Walk walk(ray);
    bool off = false;
    for (int s = 0; s < kSteps; ++s) {
      exact.step();
      walk.step();
      for (int a = 0; a < 3; ++a) off |= walk.cell(a) != exact.cell(a);
    }
    wrong += off;
  }
  return 1000.0 * wrong / kRays;
}

/// Pixels that differ between a hill at the origin and the same hill near the world's border.
Result<double> pixels_that_move(const char* backend_name) {
  constexpr int32_t kFar = 1 << 29;
  render::Image pictures[2];
  for (int far = 0; far < 2; ++far) {
    const world::VoxelPos offset{far * kFar, 0, -far * kFar};
    world::World w(world::standard_blocks());
    const auto fill = [&](world::VoxelPos low, world::VoxelPos high, const char* name) {
      world::EditBatch batch;
      batch.fill({low + offset, high + offset}, w.palette->find(name).value());
      return w.store.apply(batch);
    };
    for (int i = 0; i < 12; ++i) TRY_STATUS(fill({2 * i, 0, 2 * i}, {63 - 2 * i, i, 63 - i}, "granite"));
    render::Camera camera;
    camera.position = world::WorldPoint::from(88.3, 40.7, 92.1);
    camera.position.voxel = camera.position.voxel + offset;
    camera.forward = glm::normalize(world::Vec3d(-58, -30, -62));
    TRY(const auto backend, make_backend(backend_name));
    const world::WorldView view(w);
    TRY(const render::Frame frame, backend->render(view, camera, {}, 192, 108));
    pictures[far] = frame.image;
  }
  double different = 0;
  for (size_t i = 0; i < pictures[0].pixels.size(); ++i) different += !(pictures[0].pixels[i] == pictures[1].pixels[i]);
  return different;
}

/// Where a float puts a point a third of a metre from an integer, and where voxel and fraction do.
double misplaced(bool as_float) {
  double worst = 0;
  for (double x = 1e3; x < 1e9; x *= 10) {
    const double exact = std::floor(x) + 1.0 / 3;
    if (as_float) {
      worst = std::max(worst, std::abs(double{static_cast<float>(exact)} - exact));
    } else {
      const world::WorldPoint p = world::WorldPoint::from(exact, 0, 0);
      worst = std::max(worst, std::abs(p.fraction.x - (exact - std::floor(exact))));
    }
  }
  return worst;
}

}  // namespace

void add_stability_space(std::vector<StabilityCase>& cases) {
  cases.push_back({"T1", "rays of 1000 steps visit the voxels of exact arithmetic", "rays in 1000", 0,
                   "128-bit integers", [](BenchContext&) -> Result<double> { return wrong_rays<world::DoubleWalk>(); },
                   [] { return wrong_rays<world::AccumulateWalk<float>>(); }});
  cases.push_back({"T15", "the ray caster's picture at 2^29 m is the one at the origin", "pixels", 0, "bit equality",
                   [](BenchContext&) { return pixels_that_move("raycast"); }});
  cases.push_back({"R2", "the rasterizer's picture at 2^29 m is the one at the origin", "pixels", 0, "bit equality",
                   [](BenchContext&) { return pixels_that_move("raster"); }});
  cases.push_back({"R1", "a point a billion metres out keeps its place in its voxel", "m", 1e-6, "the catalogue",
                   [](BenchContext&) -> Result<double> { return misplaced(false); }, [] { return misplaced(true); }});
}

}  // namespace tools
