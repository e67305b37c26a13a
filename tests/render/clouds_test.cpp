/// Clouds in pictures: the same by both backends from below, within and above, in mirrors and as shadows, and nothing
/// where there are none.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/image/flip.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

class CloudPictures : public BothBackends {};

constexpr int kWidth = 320, kHeight = 180;

world::World clouded_hills(world::VoxelPos offset = {}) {
  world::World w = hills(offset);
  w.environment.clouds.cover = 0.45f;
  w.environment.clouds.height = 300, w.environment.clouds.thickness = 120, w.environment.clouds.size = 300;
  return w;
}

Camera looking(world::Vec3d position, world::Vec3d forward) {
  Camera camera;
  camera.position = world::WorldPoint::from(position.x, position.y, position.z);
  camera.forward = glm::normalize(forward);
  return camera;
}

/// Levels of detail are the rasterizer's alone.
RenderKnobs without_levels() {
  RenderKnobs knobs;
  knobs.lod_error_px = 0;
  return knobs;
}

/// As a picture of so many more stops, which only a display knows of.
Image exposed(Image image, float stops) {
  for (Rgb& pixel : image.pixels) pixel = pixel * std::exp2(stops);
  return image;
}

double flip(const Image& a, const Image& b) { return flip_map(display_image(a, 0), display_image(b, 0)).mean; }

TEST_F(CloudPictures, AgreeFromBelowWithinAndAboveAtAnyHour) {
  const world::World w = clouded_hills();
  struct Eye {
    const char* where;
    Camera camera;
  };
  const Eye eyes[] = {{"below", looking({3.5, 40.5, 90.5}, {0.1, 0.25, -1})},
                      {"within", looking({3.5, 350.5, 90.5}, {0.1, 0.02, -1})},
                      {"above", looking({3.5, 700.5, 90.5}, {0.1, -0.4, -1})}};
  for (const float hour : {-1.0f, 5.2f, 12.0f, 20.0f, 0.0f})
    for (const Eye& eye : eyes) {
      RenderKnobs knobs = without_levels();
      knobs.time_of_day = hour;
      const float stops = hour == 0 ? 16.0f : hour == 20 ? 5.0f : 0.0f;
      const Image a = exposed(draw(*raster_, w, eye.camera, knobs, kWidth, kHeight).image, stops),
                  b = exposed(draw(*raycast_, w, eye.camera, knobs, kWidth, kHeight).image, stops);
      const double within = share_within(a, b, 2), seen = flip(a, b);
      std::printf("%s, hour %g: %.4f %% within 2/255, FLIP %.5f\n", eye.where, double{hour}, 100 * within, seen);
      EXPECT_GE(within, 0.999) << eye.where << " " << hour;
      EXPECT_LT(seen, 0.01) << eye.where << " " << hour;
      RenderKnobs none = knobs;
      none.cloud_steps = 0;
      EXPECT_GT(flip(b, exposed(draw(*raycast_, w, eye.camera, none, kWidth, kHeight).image, stops)), 0.05)
          << "clouds are seen";
    }
}

TEST_F(CloudPictures, OfOneStepAndOfManyAgree) {
  const world::World w = clouded_hills();
  const Camera camera = looking({3.5, 40.5, 90.5}, {0.1, 0.25, -1});
  for (const auto& [steps, light_steps] : {std::pair{1, 1}, {1, 0}, {2, 0}, {24, 4}}) {
    RenderKnobs knobs = without_levels();
    knobs.cloud_steps = steps, knobs.cloud_light_steps = light_steps;
    const Image a = draw(*raster_, w, camera, knobs, kWidth, kHeight).image,
                b = draw(*raycast_, w, camera, knobs, kWidth, kHeight).image;
    EXPECT_GE(share_within(a, b, 2), 0.999) << steps << " " << light_steps;
  }
}

TEST_F(CloudPictures, AreTheSameAMillionMetresAway) {
  const world::VoxelPos far{1'000'000, 0, -1'000'000};
  const world::World near = clouded_hills();
  world::World away = clouded_hills(far);
  away.environment.clouds.drifted = {1e6, 0, -1e6};
  const Camera camera = looking({3.5, 40.5, 90.5}, {0.1, 0.9, -1});
  Camera there = camera;
  there.position.voxel = there.position.voxel + far;
  const RenderKnobs knobs = without_levels();
  for (Backend* backend : std::initializer_list<Backend*>{raster_.get(), raycast_.get()}) {
    const Image a = draw(*backend, near, camera, knobs, kWidth, kHeight).image,
                b = draw(*backend, away, there, knobs, kWidth, kHeight).image;
    EXPECT_GE(share_within(a, b, 1), 0.999);
  }
}

TEST_F(CloudPictures, ThrowTheSameShadowsAndNoneWhereTheyAreNotAskedFor) {
  world::World w = clouded_hills();
  // So small and low that their shadows lie on the hills.
  w.environment.clouds.size = 60, w.environment.clouds.height = 120, w.environment.clouds.thickness = 30;
  w.environment.clouds.extinction = 0.3f;
  const Camera camera = looking({3.5, 100.5, 90.5}, {0, -1, -0.9});
  RenderKnobs knobs = without_levels(), off = knobs;
  off.cloud_shadows = false;
  const world::World clear = hills();
  for (const SunShadow kind : {SunShadow::none, SunShadow::map, SunShadow::ray}) {
    knobs.sun_shadow = off.sun_shadow = kind;
    const Image a = draw(*raster_, w, camera, knobs, kWidth, kHeight).image,
                b = draw(*raycast_, w, camera, knobs, kWidth, kHeight).image;
    EXPECT_GE(share_within(a, b, 2), 0.995) << "as without clouds: edges of maps";
    EXPECT_GT(differing(b, draw(*raycast_, clear, camera, knobs, kWidth, kHeight).image), 0.15);
  }
  // Straight down there is no sky: without shadows nothing tells of clouds, but in water.
  const Camera down = looking({40.5, 60.5, -50.5}, {0.02, -1, 0.01});
  off.transparency = Transparency::opaque;
  EXPECT_TRUE(same(draw(*raster_, w, down, off, kWidth, kHeight).image,
                   draw(*raster_, clear, down, off, kWidth, kHeight).image));
  EXPECT_TRUE(same(draw(*raycast_, w, down, off, kWidth, kHeight).image,
                   draw(*raycast_, clear, down, off, kWidth, kHeight).image));
}

TEST_F(CloudPictures, AreMirroredByWater) {
  world::World w(world::standard_blocks()), clear(world::standard_blocks());
  for (world::World* lake : {&w, &clear}) {
    world::EditBatch batch;
    batch.fill({{-64, 0, -200}, {63, 1, 20}}, block(*lake, "stone"));
    batch.fill({{-64, 2, -200}, {63, 4, 20}}, block(*lake, "water"));
    apply(*lake, batch);
  }
  w.environment.clouds.cover = 0.8f;
  const Camera camera = looking({0.5, 16.5, 12.5}, {0, -0.3, -1});
  RenderKnobs knobs = without_levels();
  knobs.cloud_shadows = false;
  for (const Reflection reflection : {Reflection::none, Reflection::traced}) {
    knobs.reflection = reflection;
    const Image a = draw(*raster_, w, camera, knobs, kWidth, kHeight).image,
                without = draw(*raster_, clear, camera, knobs, kWidth, kHeight).image;
    size_t changed = 0;
    for (int y = kHeight / 2; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) changed += std::abs(a.at(x, y).g - without.at(x, y).g) > 0.5f;
    EXPECT_GT(changed, 200u) << "below the horizon";
    if (reflection == Reflection::none) {
      EXPECT_GE(share_within(a, draw(*raycast_, w, camera, knobs, kWidth, kHeight).image, 2), 0.998);
    }
  }
}

TEST_F(CloudPictures, GoOverIntoTheHorizonWithoutALine) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.set({0, -500, 0}, block(w, "stone"));
  apply(w, batch);
  w.environment.clouds.cover = 0.5f;
  const Camera camera = looking({0.5, 60.5, 0.5}, {0, 0, -1});
  RenderKnobs clear = without_levels();
  clear.cloud_steps = 0;
  const Image with = draw(*raycast_, w, camera, without_levels(), kWidth, 720).image,
              without = draw(*raycast_, w, camera, clear, kWidth, 720).image;
  // Rows of 0.08 degrees: near the horizon clouds fade; how much of them is left grows smoothly with height.
  const auto left = [&](int row) {
    double sum = 0;
    for (int x = 0; x < kWidth; ++x) sum += std::abs(double{with.at(x, row).g} - double{without.at(x, row).g});
    return sum / kWidth;
  };
  for (int row = 361; row < 720; ++row) EXPECT_EQ(left(row), 0) << "below the horizon";
  for (int row = 340; row < 360; ++row) EXPECT_LT(std::abs(left(row) - left(row + 1)), 2) << row << ", of some 100";
  EXPECT_LT(left(354), 1);
  EXPECT_GT(left(200), 5);
}

TEST_F(CloudPictures, CostNothingWhereThereAreNone) {
  const world::World w = hills();
  const Camera camera = looking({3.5, 40.5, 90.5}, {0.1, -0.1, -1});
  RenderKnobs knobs = without_levels(), many = knobs;
  many.cloud_steps = 64, many.cloud_light_steps = 16, knobs.cloud_steps = 0, knobs.cloud_shadows = false;
  for (Backend* backend : std::initializer_list<Backend*>{raster_.get(), raycast_.get()}) {
    const Frame a = draw(*backend, w, camera, knobs, kWidth, kHeight),
                b = draw(*backend, w, camera, many, kWidth, kHeight);
    EXPECT_TRUE(same(a.image, b.image));
    EXPECT_EQ(a.report.rays, b.report.rays);
    EXPECT_EQ(a.report.passes.size(), b.report.passes.size());
  }
}

TEST_F(CloudPictures, AreWhatEveryTransportOfLightShows) {
  const world::World w = clouded_hills();
  const Camera camera = looking({3.5, 40.5, 90.5}, {0.1, 0.8, -1});
  RenderKnobs knobs = without_levels();
  const Image direct = draw(*raycast_, w, camera, knobs, 64, 36).image;
  for (const LightTransport transport : {LightTransport::whitted, LightTransport::ambient_occlusion}) {
    knobs.light_transport = transport;
    EXPECT_GE(share_within(direct, draw(*raycast_, w, camera, knobs, 64, 36).image, 1), 0.999);
  }
}

}  // namespace
}  // namespace render
