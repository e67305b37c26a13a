/// The ray caster: primary rays and shadow rays through the valley, from four cameras of different kinds.
#include <cmath>

#include <fmt/format.h>

#include "render/raycast/raycast.h"
#include "tools/bench/benchmark.h"
#include "world/store/mask_walk.h"

namespace tools {

namespace {

using render::Camera;
using world::MaskKind;
using world::Vec3d;
using world::VoxelPos;
using world::World;
using world::WorldPoint;

/// The highest occupied voxel of a column.
int32_t top_of(const world::MaskVolume& occupied, const world::VoxelBox& bounds, int32_t x, int32_t z) {
  int32_t y = bounds.max.y;
  while (y > bounds.min.y && !occupied.test({x, y, z})) --y;
  return y;
}

/// Air with a roof of 8 m or more and 3 m of room around it, the nearest below the middle; or the middle's surface.
VoxelPos find_cave(const world::MaskVolume& occupied, const world::VoxelBox& bounds) {
  const int32_t x0 = (bounds.min.x + bounds.max.x) / 2, z0 = (bounds.min.z + bounds.max.z) / 2;
  for (int32_t ring = 0; ring < 400; ring += 8)
    for (int32_t x = x0 - ring; x <= x0 + ring; x += 8)
      for (int32_t z = z0 - ring; z <= z0 + ring; z += 8) {
        if (std::max(std::abs(x - x0), std::abs(z - z0)) != ring) continue;
        for (int32_t y = top_of(occupied, bounds, x, z) - 12; y > bounds.min.y + 4; --y) {
          bool room = true, roof = true;
          for (int32_t d = -3; d <= 3 && room; ++d)
            room = !occupied.test({x + d, y, z}) && !occupied.test({x, y, z + d}) && !occupied.test({x, y + d / 2, z});
          for (int32_t d = 5; d <= 12 && room && roof; ++d) roof = occupied.test({x, y + d, z});
          if (room && roof) return {x, y, z};
        }
      }
  return {x0, top_of(occupied, bounds, x0, z0) + 2, z0};
}

/// Oblique from above, along the ground, far and grazing, and in a cave.
std::vector<Camera> cameras_of(const World& world) {
  const world::MaskVolume& occupied = world.store.masks(MaskKind::occupied);
  const world::VoxelBox bounds = world.store.bounds();
  const auto at = [](VoxelPos v, Vec3d forward) {
    Camera camera;
    camera.position = {v, Vec3d(0.5, 0.5, 0.5)};
    camera.forward = glm::normalize(forward);
    return camera;
  };
  const auto above = [&](int percent_x, int percent_z, int32_t metres) {
    const int32_t x = bounds.min.x + (bounds.max.x - bounds.min.x) * percent_x / 100;
    const int32_t z = bounds.min.z + (bounds.max.z - bounds.min.z) * percent_z / 100;
    return VoxelPos{x, top_of(occupied, bounds, x, z) + metres, z};
  };
  return {at(above(10, 10, 90), Vec3d(0.7, -0.45, 0.7)), at(above(50, 40, 3), Vec3d(0.8, -0.02, 0.6)),
          at(above(4, 94, 40), Vec3d(0.75, -0.12, -0.66)), at(find_cave(occupied, bounds), Vec3d(0.6, 0.1, -0.7))};
}

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
  input->cameras = cameras_of(*input->world);
  TRY(input->backend, render::make_raycast_backend());
  if (context.quick()) input->width = 320, input->height = 180;
  return input;
}

/// Walks every 8th pixel of every 8th row; with `skip` through the empty cubes, else voxel by voxel.
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
  const char* const cameras = "1280x720 from 4 cameras (oblique, ground, far grazing, cave) of the valley";
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
