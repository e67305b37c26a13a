/// The ray caster: primary rays and shadow rays through the valley, from all of its cameras.
#include <cmath>

#include <fmt/format.h>

#include "render/raycast/raycast.h"
#include "tools/bench/benchmark.h"
#include "world/scenes/scene.h"
#include "world/store/mask_walk.h"

namespace tools {

namespace {

using render::Camera;
using world::MaskKind;
using world::VoxelPos;
using world::World;

struct Input {
  const World* world = nullptr;
  std::vector<Camera> cameras;
  std::unique_ptr<render::Backend> backend;
  int width = 1280, height = 720;

  /// Draws all cameras; returns the rays cast, NaN where a picture failed.
  double draw(render::SunShadow shadow) {
    render::RenderKnobs knobs;
    knobs.sun_shadow = shadow;
    const world::WorldView view(*world);
    double rays = 0;
    for (const Camera& camera : cameras) {
      const Result<render::Frame> frame = backend->render(view, camera, knobs, width, height);
      if (!frame.ok()) return std::nan("");
      rays += static_cast<double>(frame.value().report.rays);
    }
    return rays;
  }
};

Result<std::shared_ptr<Input>> make_input(BenchContext& context) {
  auto input = std::make_shared<Input>();
  TRY(input->world, context.world("valley"));
  TRY(const world::Scene scene, world::load_scene("valley"));
  for (const world::CameraPlacement& placement : scene.cameras) input->cameras.push_back(Camera::from(placement));
  TRY(input->backend, render::make_raycast_backend());
  if (context.quick()) input->width = 320, input->height = 180;
  return input;
}

/// Casts a ray through every 8th pixel of every 8th row.
template <class FirstHit>
double cast_sparse(const Input& input, FirstHit first_hit) {
  double rays = 0;
  for (const Camera& camera : input.cameras) {
    const render::PixelRays pixels(camera, input.width, input.height);
    for (int y = 4; y < input.height; y += 8)
      for (int x = 4; x < input.width; x += 8) {
        first_hit(world::GridRay(camera.position, pixels.direction(x + 0.5, y + 0.5), 4000));
        ++rays;
      }
  }
  return rays;
}

Status check_hits(const Input& input) {
  const world::MaskVolume& occupied = input.world->store.masks(MaskKind::occupied);
  const world::MaskWalker walker(occupied);
  Status status;
  cast_sparse(input, [&](const world::GridRay& ray) {
    const world::GridHit skipped = walker.first_set(ray);
    const world::GridHit flat = world::first_hit_flat(ray, [&](VoxelPos v) { return occupied.test(v); });
    const bool same =
        skipped.hit() == flat.hit() &&
        (!flat.hit() || (skipped.voxel == flat.voxel && skipped.face == flat.face && skipped.t == flat.t));
    if (!same && status.ok())
      status = world::Error{world::ErrorKind::comparison, "a ray's first hit differs from the voxel by voxel walk's"};
  });
  return status;
}

Result<Prepared> prepare(BenchContext& context, render::SunShadow shadow) {
  TRY(const std::shared_ptr<Input> input, make_input(context));
  Prepared prepared;
  prepared.ours = {"loam", [input, shadow] { return input->draw(shadow); }};
  prepared.rivals.push_back({"flat walk, a voxel a step", [input] {
                               const world::MaskVolume& occupied = input->world->store.masks(MaskKind::occupied);
                               return cast_sparse(*input, [&](const world::GridRay& ray) {
                                 keep(world::first_hit_flat(ray, [&](VoxelPos v) { return occupied.test(v); }).t);
                               });
                             }});
  prepared.counters = [input, shadow] { return std::map<std::string, double>{{"rays", input->draw(shadow)}}; };
  prepared.check = [input] { return check_hits(*input); };
  return prepared;
}

}  // namespace

void add_suite_rays(Registry& registry) {
  const char* const cameras = "1280x720 from each of the valley's cameras";
  registry.add({.name = "primary",
                .what = fmt::format("pictures without shadows, {}", cameras),
                .unit = "M rays/s",
                .scale = 1e6,
                .threads = 2,
                .reach = Reach{4, "issue 2: primary rays on the 1024x256x1024 valley, 2 threads, scalar"},
                .prepare = [](BenchContext& context) { return prepare(context, render::SunShadow::none); }});
  registry.add({.name = "primary_core",
                .what = fmt::format("the same on one thread, {}", cameras),
                .unit = "M rays/s",
                .scale = 1e6,
                .threads = 1,
                .prepare = [](BenchContext& context) { return prepare(context, render::SunShadow::none); }});
  registry.add({.name = "primary_and_sun",
                .what = fmt::format("pictures with the sun's shadow, all rays counted, {}", cameras),
                .unit = "M rays/s",
                .scale = 1e6,
                .threads = 2,
                .prepare = [](BenchContext& context) { return prepare(context, render::SunShadow::ray); }});
}

}  // namespace tools
