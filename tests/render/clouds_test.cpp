/// Clouds in pictures: the same by both backends from below, within and above, before land, in mirrors and as shadows,
/// and nothing where there are none.
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

/// A closed layer between 60 m and 100 m over the hills, of which nothing comes through.
world::World sealed_hills() {
  world::World w = hills();
  world::Clouds& clouds = w.environment.clouds;
  clouds.cover = 1, clouds.height = 60, clouds.thickness = 40, clouds.size = 80, clouds.extinction = 5;
  return w;
}

TEST_F(CloudPictures, HideTheLandBelowFromAboveAndNoneOfItFromBelow) {
  const world::World w = sealed_hills();
  // The same clouds over land of which all is red; shadows would tell.
  world::World red = sealed_hills();
  world::EditBatch batch;
  batch.fill({{-64, 0, -64}, {63, 31, 63}}, block(red, "brick_red"));
  apply(red, batch);
  RenderKnobs knobs = without_levels(), none = knobs;
  knobs.cloud_shadows = none.cloud_shadows = false;
  knobs.cloud_steps = 32, none.cloud_steps = 0;
  const Camera above = looking({3.5, 140.5, 60.5}, {0, -0.8, -1}), below = looking({3.5, 50.5, 60.5}, {0, -0.8, -1});
  const auto cost = [](const Frame& f) { return std::pair(f.report.rays, f.report.passes.size()); };
  for (Backend* backend : std::initializer_list<Backend*>{raster_.get(), raycast_.get()})
    for (const LightTransport transport : {LightTransport::direct, LightTransport::path}) {
      if (transport == LightTransport::path && backend == raster_.get()) continue;
      knobs.light_transport = none.light_transport = transport;
      const Image seen = draw(*backend, w, above, knobs, 160, 90).image;
      EXPECT_GE(share_within(seen, draw(*backend, red, above, knobs, 160, 90).image, 1), 1) << "no land is seen";
      EXPECT_GT(flip(seen, draw(*backend, w, above, none, 160, 90).image), 0.1);
      if (transport == LightTransport::path) continue;
      const Frame with = draw(*backend, w, below, knobs, 160, 90), without = draw(*backend, w, below, none, 160, 90);
      knobs.transparency = none.transparency = Transparency::opaque;  // water mirrors them
      EXPECT_TRUE(same(draw(*backend, w, below, knobs, 160, 90).image, draw(*backend, w, below, none, 160, 90).image));
      knobs.transparency = none.transparency = RenderKnobs{}.transparency;
      EXPECT_EQ(cost(with), cost(without));
    }
}

TEST_F(CloudPictures, CutAtAPeakGoOnAsTheOnesInTheSkyBesideIt) {
  // A black tower up through the layer, 90 m away; the eye is below, within or above the clouds.
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-8, 0, -100}, {7, 400, -90}}, block(w, "coal_block"));
  apply(w, batch);
  w.environment.clouds.cover = 0.9f, w.environment.clouds.height = 150, w.environment.clouds.thickness = 60;
  w.environment.clouds.size = 120, w.environment.clouds.extinction = 0.03f;
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};
  RenderKnobs knobs = without_levels(), none = knobs;
  none.cloud_steps = 0;
  for (const double y : {60.5, 180.5, 300.5}) {
    const Camera camera = looking({0.5, y, 0.5}, {0.02, (180 - y) / 95, -1});
    const Image a = draw(*raster_, w, camera, knobs, kWidth, kHeight).image,
                b = draw(*raycast_, w, camera, knobs, kWidth, kHeight).image,
                bare = draw(*raycast_, w, camera, none, kWidth, kHeight).image;
    EXPECT_GE(share_within(a, b, 2), 0.999) << y;
    // Pixels of the tower are as bright as the sky's at most, and brighter than without clouds somewhere.
    double before_tower = 0;
    for (int row = 0; row < kHeight; ++row) {
      const double on = std::abs(double{b.at(kWidth / 2 - 6, row).g} - double{bare.at(kWidth / 2 - 6, row).g});
      before_tower = std::max(before_tower, on);
    }
    EXPECT_GT(before_tower, 5) << y;
  }
}

TEST_F(CloudPictures, BeforeLandAreWhatEveryTransportOfLightShows) {
  world::World w = clouded_hills();
  w.environment.clouds.height = 60, w.environment.clouds.thickness = 40, w.environment.clouds.size = 80;
  w.environment.clouds.extinction = 0.05f, w.environment.sky_zenith = w.environment.sky_horizon = {};
  w.environment.sky_ground = {};
  // Black land: all light is that of clouds.
  world::EditBatch batch;
  batch.fill({{-64, 0, -64}, {63, 31, 63}}, block(w, "coal_block"));
  apply(w, batch);
  RenderKnobs knobs = without_levels();
  for (const double y : {130.5, 80.5}) {
    const Camera camera = looking({3.5, y, 90.5}, {0.1, -0.7, -1});
    knobs.light_transport = LightTransport::direct;
    const Image direct = draw(*raycast_, w, camera, knobs, 64, 36).image;
    for (const LightTransport transport :
         {LightTransport::whitted, LightTransport::ambient_occlusion, LightTransport::path, LightTransport::photons}) {
      knobs.light_transport = transport;
      knobs.spp = 1;
      const Image other = draw(*raycast_, w, camera, knobs, 64, 36).image;
      double sum = 0, of_other = 0, off = 0;
      for (size_t i = 0; i < direct.pixels.size(); ++i) {
        sum += double{direct.pixels[i].g}, of_other += double{other.pixels[i].g};
        off += std::abs(double{direct.pixels[i].g} - double{other.pixels[i].g});
      }
      // The last two look through another point of each pixel, where clouds have another grain.
      const bool same_point = transport == LightTransport::whitted || transport == LightTransport::ambient_occlusion;
      EXPECT_LT(off, (same_point ? 0.01 : 0.25) * sum) << y << " " << static_cast<int>(transport);
      EXPECT_NEAR(of_other / sum, 1, 0.02) << y << " " << static_cast<int>(transport);
    }
  }
}

TEST_F(CloudPictures, BehindFogAndBeforeItHaveTheLightThatPathsFind) {
  // Fog that takes light and sends none, from above the clouds to the land, and clouds in it.
  world::World w = sealed_hills();
  w.environment.clouds.extinction = 0.05f;
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};  // paths take it from fog
  world::Medium fog;
  fog.kind = "homogeneous", fog.absorption = {0.004f, 0.008f, 0.016f};
  w.media = {fog};
  RenderKnobs knobs = without_levels();
  for (const double y : {160.5, 80.5}) {
    const Camera camera = looking({3.5, y, 60.5}, {0, -0.8, -1});
    const Image direct = draw(*raycast_, w, camera, knobs, 32, 18).image;
    EXPECT_GE(share_within(draw(*raster_, w, camera, knobs, 32, 18).image, direct, 2), 0.995);
    // Light that the land sends on to land is the paths' alone: only clouds are seen.
    RenderKnobs paths = knobs;
    paths.light_transport = LightTransport::path, paths.spp = 256, paths.max_depth = 1;
    const Image traced = draw(*raycast_, w, camera, paths, 32, 18).image;
    const auto mean = [](const Image& image) {
      Rgb sum{};
      for (const Rgb& pixel : image.pixels) sum = sum + pixel * (1.0f / static_cast<float>(image.pixels.size()));
      return sum;
    };
    const Rgb a = mean(direct), b = mean(traced);
    EXPECT_NEAR(b.r / a.r, 1, 0.03) << y;
    EXPECT_NEAR(b.b / a.b, 1, 0.03) << y;
  }
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
