#include "render/raycast/raycast.h"

#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "render/shading.h"
#include "world/base/jobs.h"
#include "world/space/grid_walk.h"

namespace render {
namespace {

using namespace world;

BlockId id_of(const World& world, const char* name) { return world.palette->find(name).value(); }

/// Rolling ground with blocks in the air, glass and water, a cave; all within 96 x 64 x 96 voxels from `at`.
World small_world(VoxelPos at = {0, 0, 0}) {
  World world(standard_blocks());
  EditBatch batch;
  const BlockId stone = id_of(world, "granite"), glass = id_of(world, "glass"), water = id_of(world, "water"),
                red = id_of(world, "glass_red");
  for (int x = 0; x < 96; ++x)
    for (int z = 0; z < 96; ++z) {
      const int height = 10 + static_cast<int>(6 * std::sin(x * 0.21) * std::cos(z * 0.17));
      batch.fill({at + VoxelPos{x, 0, z}, at + VoxelPos{x, height, z}}, stone);
      if (height < 9) batch.fill({at + VoxelPos{x, height + 1, z}, at + VoxelPos{x, 9, z}}, water);
    }
  for (int i = 0; i < 300; ++i) {
    const uint64_t b = random_bits(3, i, 0, 0);
    const VoxelPos v =
        at + VoxelPos{static_cast<int>(b % 96), static_cast<int>(12 + (b >> 8) % 40), static_cast<int>((b >> 16) % 96)};
    batch.fill(
        {v, v + VoxelPos{static_cast<int>(b >> 24 & 3), static_cast<int>(b >> 26 & 3), static_cast<int>(b >> 28 & 3)}},
        i % 3 == 0   ? glass
        : i % 3 == 1 ? red
                     : stone);
  }
  batch.fill({at + VoxelPos{40, 2, 40}, at + VoxelPos{46, 5, 46}}, kAir);
  EXPECT_TRUE(world.store.apply(batch).ok());
  return world;
}

Camera camera_at(VoxelPos at, double x, double y, double z, Vec3d forward) {
  Camera camera;
  camera.position = WorldPoint::from(x, y, z);
  camera.position.voxel = camera.position.voxel + at;
  camera.forward = glm::normalize(forward);
  return camera;
}

Frame picture(const World& world, const Camera& camera, const RenderKnobs& knobs, int width, int height) {
  const WorldView view(world);
  Result<std::unique_ptr<Backend>> backend = make_raycast_backend();
  EXPECT_TRUE(backend.ok());
  Result<Frame> frame = (*backend)->render(view, camera, knobs, width, height);
  EXPECT_TRUE(frame.ok());
  return std::move(*frame);
}

bool same_bits(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb)) == 0;
}

/// The picture by the definition: a flat walk for each pixel, reading blocks one by one.
Image brute_force(const World& world, const Camera& camera, const RenderKnobs& knobs, int width, int height) {
  Image image(width, height);
  const PixelRays rays(camera, width, height);
  const Shading shading(world.environment, *world.palette);
  StoreReader reader(world.store);
  const auto opaque = [&](BlockId id) { return (*world.palette)[id].opaque && id != kAir; };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Vec3d direction = rays.direction(x + 0.5, y + 0.5);
      const double t_max = std::min<double>(knobs.view_distance, 400) / glm::length(direction);
      Rgb colour = sky_radiance(world.environment, direction.y / glm::length(direction));
      const GridRay ray(camera.position, direction, t_max);
      BlockId before = reader.get(camera.position.voxel);
      FlatWalk walk(ray);
      for (walk.step(); walk.inside(); walk.step()) {
        const BlockId id = reader.get(walk.voxel());
        if (id != kAir && !opaque(before) && (opaque(id) || before == kAir || id > before)) {
          bool sun_visible = shading.sun_faces[walk.face()];
          if (sun_visible && knobs.sun_shadow == SunShadow::ray) {
            GridRay sun = ray_from_surface(ray, {WalkEnd::hit, walk.voxel(), walk.face(), walk.t()},
                                           world.environment.sun_direction);
            sun.t_max = 300;
            sun_visible = !first_hit_flat(sun, [&](VoxelPos v) { return opaque(reader.get(v)); }).hit();
          }
          colour = shading.face_radiance(id, walk.face(), sun_visible);
          break;
        }
        before = id;
      }
      image.at(x, y) = colour;
    }
  return image;
}

/// Colours of faces are told by equality.
RenderKnobs untextured() {
  RenderKnobs knobs;
  knobs.textures = TextureFilter::off;
  knobs.transparency = Transparency::opaque;
  return knobs;
}
const RenderKnobs kUsual = untextured();

TEST(Raycast, EqualsTheFlatWalkPixelByPixel) {
  const World world = small_world();
  const Camera cameras[] = {
      camera_at({}, 5.3, 40.7, 4.1, Vec3d(1, -0.5, 0.9)),      // over the land
      camera_at({}, 60.5, 17.5, 50.5, Vec3d(-1, 0.02, -0.3)),  // along the ground
      camera_at({}, 48, 60, 48, Vec3d(0, -1, 0)),              // straight down from a corner of voxels
      camera_at({}, 43.5, 3.5, 43.5, Vec3d(0.3, 0.9, 0.1)),    // in the cave
      camera_at({}, -80.25, 90, 150, Vec3d(120, -75, -100)),   // from far outside
      camera_at({}, 48, 30, 48, Vec3d(0, 1, 0)),               // up into the sky
  };
  std::vector<Camera> views(std::begin(cameras), std::end(cameras));
  // Narrow fields of view, whose tiles are thinner than a voxel: beams go on to the last cubes before the surface.
  for (const Camera& camera : cameras)
    for (const double fov : {0.2, 0.02}) {
      views.push_back(camera);
      views.back().vertical_fov = fov;
    }
  for (const Camera& camera : views)
    for (const SunShadow shadow : {SunShadow::none, SunShadow::ray}) {
      RenderKnobs knobs = untextured();
      knobs.sun_shadow = shadow;
      knobs.view_distance = 1e9f;
      const Image expected = brute_force(world, camera, knobs, 83, 61);
      EXPECT_TRUE(same_bits(picture(world, camera, knobs, 83, 61).image, expected)) << camera.position.voxel.x;
    }
}

TEST(Raycast, FromInsideABlockShowsTheFirstFrontFace) {
  const World world = small_world();
  const auto expect_equal = [&](const Camera& camera, bool sees_something) {
    const Image image = picture(world, camera, kUsual, 64, 48).image;
    EXPECT_TRUE(same_bits(image, brute_force(world, camera, kUsual, 64, 48)));
    // Rays that leave the rock upwards see sky or what floats above it.
    int blocks = 0;
    for (const Rgb& p : image.pixels) blocks += p.r != p.g;
    EXPECT_TRUE(!sees_something || blocks > 0);
  };
  expect_equal(camera_at({}, 20.5, 1.5, 20.5, Vec3d(0.5, 0.3, 0.6)), true);  // in rock
  // In water, from the first column that holds any.
  for (int x = 0; x < 96; ++x)
    for (int z = 0; z < 96; ++z)
      if ((*world.palette)[world.store.get({x, 9, z})].name == "water") {
        expect_equal(camera_at({}, x + 0.5, 9.5, z + 0.5, Vec3d(0.5, -0.1, 0.6)), true);
        expect_equal(camera_at({}, x + 0.5, 9.5, z + 0.5, Vec3d(-0.5, 0.4, 0.1)), false);
        return;
      }
  FAIL() << "no water";
}

TEST(Raycast, IsTheSameForAnyNumberOfThreads) {
  const World world = small_world();
  const Camera camera = camera_at({}, 5.3, 40.7, 4.1, Vec3d(1, -0.5, 0.9));
  const Image all = picture(world, camera, kUsual, 320, 200).image;
  for (const int threads : {1, 2, 3}) {
    const ThreadLimit limit(threads);
    EXPECT_TRUE(same_bits(picture(world, camera, kUsual, 320, 200).image, all)) << threads;
  }
}

TEST(Raycast, IsTheSameAtAnyDistanceFromTheOrigin) {
  const Vec3d forward(1, -0.5, 0.9);
  const World near = small_world();
  const Image expected = picture(near, camera_at({}, 5.3, 40.7, 4.1, forward), kUsual, 160, 120).image;
  for (const VoxelPos at :
       {VoxelPos{10000000, 0, -10000000}, VoxelPos{10000003, 10000001, 9999999}, VoxelPos{-1000000001, 3, 999999937}}) {
    const World far = small_world(at);
    // The fraction is what the camera at the origin has.
    EXPECT_TRUE(same_bits(picture(far, camera_at(at, 5.3, 40.7, 4.1, forward), kUsual, 160, 120).image, expected))
        << at.x;
  }
}

TEST(Raycast, ViewDistanceIsEuclideanAndBeyondItIsSky) {
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{-60, 0, -20}, {60, 0, 100}}, id_of(world, "granite"));
  ASSERT_TRUE(world.store.apply(batch).ok());
  RenderKnobs knobs;
  knobs.view_distance = 20;
  const Camera camera = camera_at({}, 0.5, 9.5, 0.5, Vec3d(0, -0.4, 1));
  const Image image = picture(world, camera, knobs, 120, 90).image;
  const PixelRays rays(camera, 120, 90);
  int near = 0, far = 0;
  for (int y = 0; y < 90; ++y)
    for (int x = 0; x < 120; ++x) {
      const Vec3d d = glm::normalize(rays.direction(x + 0.5, y + 0.5));
      const double distance = d.y < 0 ? -8.5 / d.y : 1e9;  // to the floor's top, y = 1
      if (std::abs(distance - 20) < 1e-9) continue;
      const bool sky = image.at(x, y) ==
                       sky_radiance(world.environment,
                                    rays.direction(x + 0.5, y + 0.5).y / glm::length(rays.direction(x + 0.5, y + 0.5)));
      EXPECT_EQ(sky, distance > 20) << x << ' ' << y;
      (sky ? far : near)++;
    }
  EXPECT_GT(near, 1000);
  EXPECT_GT(far, 1000);
}

TEST(Raycast, FarAndNearCamerasSeeTheSameWallFromAfar) {
  // From 3 km: rays cross empty regions, the beam jumps to the bounds.
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {0, 99, 99}}, id_of(world, "granite"));
  ASSERT_TRUE(world.store.apply(batch).ok());
  Camera camera = camera_at({}, -3000.5, 50.25, 50.75, Vec3d(1, 0, 0));
  camera.vertical_fov = 2 * std::atan(100.0 / 3000);  // 200 m at the wall, 2 m a pixel
  RenderKnobs knobs;
  knobs.view_distance = 1e9f;
  knobs.sun_shadow = SunShadow::none;
  const Image image = picture(world, camera, knobs, 100, 100).image;
  const PixelRays rays(camera, 100, 100);
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 100; ++x) {
      const Vec3d d = rays.direction(x + 0.5, y + 0.5);
      const double t = 3000.5 / d.x, wall_y = 50.25 + t * d.y, wall_z = 50.75 + t * d.z;
      const bool wall = wall_y > 0 && wall_y < 100 && wall_z > 0 && wall_z < 100;
      EXPECT_EQ(image.at(x, y) != sky_radiance(world.environment, d.y / glm::length(d)), wall) << x << ' ' << y;
    }
}

TEST(Raycast, AnEmptyWorldIsSky) {
  const World world(standard_blocks());
  const Camera camera = camera_at({}, 0.5, 0.5, 0.5, Vec3d(1, 0.2, 0));
  const Frame frame = picture(world, camera, kUsual, 32, 24);
  const PixelRays rays(camera, 32, 24);
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 32; ++x) {
      const Vec3d d = rays.direction(x + 0.5, y + 0.5);
      EXPECT_EQ(frame.image.at(x, y), sky_radiance(world.environment, d.y / glm::length(d)));
    }
  EXPECT_EQ(frame.report.rays, 32u * 24);
}

TEST(Raycast, RefusesPicturesAndCamerasOutOfRange) {
  const World world(standard_blocks());
  const WorldView view(world);
  const std::unique_ptr<Backend> backend = std::move(*make_raycast_backend());
  const auto refused = [&](const Camera& camera, int width, int height) {
    const Result<Frame> frame = backend->render(view, camera, kUsual, width, height);
    ASSERT_FALSE(frame.ok());
    EXPECT_EQ(frame.error().kind, ErrorKind::usage);
  };
  const Camera good = camera_at({}, 0.5, 0.5, 0.5, Vec3d(1, 0, 0));
  refused(good, 0, 10);
  refused(good, 10, 100000);
  Camera bad = good;
  bad.forward.y = std::nan("");
  refused(bad, 10, 10);
  bad = good;
  bad.vertical_fov = 4;
  refused(bad, 10, 10);
  bad = good;
  bad.position.voxel.x = INT32_MAX;
  refused(bad, 10, 10);
}

}  // namespace
}  // namespace render
