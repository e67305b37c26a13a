/// See-through blocks in the rasterizer: that a world without such a block pays nothing, and hard cases A11 to A13 and
/// X1 to X4 of it. Each picture with the validation layer on. That they look as the ray caster has them is claimed in
/// tests/tools/agreement/rows.cpp.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <set>

#include <gtest/gtest.h>

#include "render/gpu/device.h"
#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/see_through_worlds.h"
#include "world/scenes/scene.h"

namespace render {
namespace {

constexpr int kWidth = 320, kHeight = 180;

class TransparencyTest : public BothBackends {
 protected:
  void SetUp() override {
    BothBackends::SetUp();
    knobs_.transparency = Transparency::lists;
    knobs_.reflection = Reflection::none;
    knobs_.refraction = Refraction::none;
    knobs_.lod_error_px = 0;
  }
  Frame draw(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs,
             int width = kWidth, int height = kHeight) {
    const world::WorldView view(w);
    auto drawn = backend.render(view, camera, knobs, width, height);
    EXPECT_TRUE(drawn.ok()) << (drawn.ok() ? "" : drawn.error().message);
    return drawn.ok() ? std::move(*drawn) : Frame{Image(width, height), {}};
  }
  Image raster(const world::World& w, const Camera& camera, int width = kWidth, int height = kHeight) {
    return draw(*raster_, w, camera, knobs_, width, height).image;
  }

  RenderKnobs knobs_;
};

std::set<std::string> pass_names(const FrameReport& report) {
  std::set<std::string> names;
  for (const PassReport& pass : report.passes) names.insert(pass.name);
  return names;
}

bool equal_bits(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb)) == 0;
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i)
    sum += std::abs(a.pixels[i].r - b.pixels[i].r) + std::abs(a.pixels[i].g - b.pixels[i].g) +
           std::abs(a.pixels[i].b - b.pixels[i].b);
  return sum / (3 * static_cast<double>(a.pixels.size()));
}

world::World glasshouse() {
  auto scene = world::load_scene("glasshouse");
  CHECK(scene.ok());
  world::ImportReport report;
  auto built = world::build_world(*scene, report);
  CHECK(built.ok());
  return std::move(*built);
}

TEST_F(TransparencyTest, HardCaseA11_AHundredPanesAreDrawnInOrderAndOutgrowTheirRoomOnce) {
  // 200 interfaces a pixel: the lists start with room for one and a quarter.
  const world::World w = panes(100, {"glass_white", "glass_pink", "ice"});
  const Camera camera = camera_at({}, {0.5, 0.5, 0.5}, {0.01, 0.02, -1}, 30);
  raster(w, camera, 96, 54);
  const Frame again = draw(*raster_, w, camera, knobs_, 96, 54);
  EXPECT_FALSE(pass_names(again.report).contains("transparency_dropped"));
  for (const Rgb& p : again.image.pixels) EXPECT_GT(p.r + p.g + p.b, 0);
}

TEST_F(TransparencyTest, HardCaseA13_TiesAreSettledTheSameWayEachTime) {
  // Glass stands on water and in it: faces of both in one plane, and edges where planes of several axes meet.
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-16, -4, -30}, {15, -1, -3}}, block(w, "water"));
  for (int x = -14; x < 14; x += 3) batch.fill({{x, -3, -20}, {x + 1, 2 + (x & 3), -10}}, block(w, "glass_yellow"));
  apply(w, batch);
  const Camera camera = camera_at({}, {0, 3, 2}, {0, -0.3, -1});
  for (const Transparency order : {Transparency::lists, Transparency::sorted, Transparency::weighted}) {
    knobs_.transparency = order;
    const Image first = raster(w, camera, 160, 90);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(equal_bits(first, raster(w, camera, 160, 90))) << static_cast<int>(order);
  }
}

TEST_F(TransparencyTest, EachPictureFindsTheListsEmpty) {
  const world::World w = panes(3, {"glass_red", "glass", "ice"});
  const Camera towards = camera_at({}, {3.2, 2.3, 4.5}, {-0.2, -0.1, -1}),
               away = camera_at({}, {3.2, 2.3, 4.5}, {-0.2, -0.1, 1});
  // By tiles that have a layer, and over all of the picture; tiles are cut at its border.
  for (const Reflection reflection : {Reflection::none, Reflection::screen}) {
    knobs_.reflection = reflection;
    const Image first = raster(w, towards, 163, 91);
    EXPECT_TRUE(equal_bits(first, raster(w, towards, 163, 91)));
    const Image sky = raster(w, away, 163, 91);
    EXPECT_TRUE(equal_bits(first, raster(w, towards, 163, 91)));
    knobs_.transparency = Transparency::opaque;
    EXPECT_TRUE(equal_bits(sky, raster(w, away, 163, 91)));
    knobs_.transparency = Transparency::lists;
  }
}

TEST_F(TransparencyTest, WhereNoLayerIsInViewNoPixelIsResolved) {
  const world::World w = panes(3, {"glass_red", "glass", "ice"});
  for (const double z : {-1.0, 1.0}) {
    const Frame frame = draw(*raster_, w, camera_at({}, {3.2, 2.3, 4.5}, {-0.2, -0.1, z}), knobs_, 160, 90);
    EXPECT_EQ(pass_names(frame.report).contains("transparency_resolve"), z < 0);
  }
}

TEST_F(TransparencyTest, UnitFacesSortedByTheirDistanceAreInExactOrder) {
  knobs_.merge_faces = false;
  const world::World worlds[] = {glasshouse(), panes(6, {"glass_red", "glass_blue", "glass"})};
  const Camera cameras[] = {Camera::from(worlds[0].cameras[0]), camera_at({}, {3.2, 2.3, 4.5}, {-0.2, -0.1, -1})};
  for (size_t i = 0; i < 2; ++i) {
    knobs_.transparency = Transparency::lists;
    const Image lists = raster(worlds[i], cameras[i]);
    knobs_.transparency = Transparency::sorted;
    const Image sorted = raster(worlds[i], cameras[i]);
    EXPECT_LT(mean_difference(lists, sorted), 0.02) << i;  // of radiances of some 50
    knobs_.transparency = Transparency::weighted;
    EXPECT_GT(mean_difference(lists, raster(worlds[i], cameras[i])), 0.02) << i;
  }
}

TEST_F(TransparencyTest, HardCaseA12_WeightsStayFiniteAndWhatPassesIsExact) {
  // Under a black sky layers show nothing, and only what they let through of the lamps is left: no weight has a part.
  world::World w = panes(3, {"glass_red", "glass_pink", "glass_white"});
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};
  for (const double distance : {0.5, 30.0, 3000.0}) {
    const Camera camera = camera_at({}, {0.5, 0.5, distance}, {0.01, 0.02, -1}, distance > 100 ? 0.6 : 50);
    knobs_.transparency = Transparency::lists;
    const Image lists = raster(w, camera);
    knobs_.transparency = Transparency::weighted;
    const Image weighted = raster(w, camera);
    for (size_t i = 0; i < lists.pixels.size(); ++i) {
      ASSERT_TRUE(std::isfinite(weighted.pixels[i].r));
      ASSERT_NEAR(weighted.pixels[i].r, lists.pixels[i].r, 2e-3 * (1 + lists.pixels[i].r)) << distance;
      ASSERT_NEAR(weighted.pixels[i].b, lists.pixels[i].b, 2e-3 * (1 + lists.pixels[i].b)) << distance;
    }
  }
}

TEST_F(TransparencyTest, HardCaseX2_AWorldWithoutSeeThroughBlocksHasNoSuchPass) {
  const world::World w = room();
  const Camera camera = camera_at({}, {6.5, 2.5, 1.5}, {0.2, -0.1, 1});
  RenderKnobs opaque = knobs_;
  opaque.transparency = Transparency::opaque;
  const Frame without = draw(*raster_, w, camera, opaque);
  const uint64_t bytes = raster_->rasterizer().device().memory().bytes_used();
  for (const Transparency order : {Transparency::sorted, Transparency::weighted, Transparency::lists}) {
    knobs_.transparency = order;
    knobs_.reflection = Reflection::traced;
    const Frame frame = draw(*raster_, w, camera, knobs_);
    EXPECT_EQ(pass_names(frame.report), pass_names(without.report));
    EXPECT_EQ(raster_->rasterizer().device().memory().bytes_used(), bytes);
    EXPECT_TRUE(equal_bits(frame.image, without.image));
  }
}

TEST_F(TransparencyTest, HardCaseX3_TheFirstPanePlacedIsAsIfItHadStoodThere) {
  const Camera camera = camera_at({}, {6.5, 2.5, 1.5}, {0.2, -0.1, 1});
  const auto with_pane = [](world::World& w) {
    world::EditBatch batch;
    batch.fill({{2, 0, 6}, {9, 3, 6}}, block(w, "glass_green"));
    apply(w, batch);
  };
  world::World edited = room(), from_start = room();
  knobs_.reflection = Reflection::screen;
  raster(edited, camera);
  with_pane(edited), with_pane(from_start);
  const Image later = raster(edited, camera);
  auto fresh = make_raster({.validation = true});
  ASSERT_TRUE(fresh.ok());
  EXPECT_TRUE(equal_bits(later, draw(**fresh, from_start, camera, knobs_).image));
}

TEST_F(TransparencyTest, HardCaseX4_WithTheLastPaneAllThatItNeededGoes) {
  world::World w = room();
  const Camera camera = camera_at({}, {6.5, 2.5, 1.5}, {0.2, -0.1, 1});
  const Frame before = draw(*raster_, w, camera, knobs_, 64, 36);
  const uint64_t bytes = raster_->rasterizer().device().memory().bytes_used();
  for (const Transparency order : {Transparency::lists, Transparency::sorted, Transparency::weighted})
    for (int cycle = 0; cycle < 3; ++cycle) {
      knobs_.transparency = order;
      knobs_.reflection = order == Transparency::lists ? Reflection::screen : Reflection::none;
      for (const char* name : {"glass", "air"}) {
        world::EditBatch batch;
        batch.set({4, 2, 7}, std::string_view(name) == "air" ? world::kAir : block(w, name));
        apply(w, batch);
        const Frame frame = draw(*raster_, w, camera, knobs_, 64, 36);
        const bool there = std::string_view(name) == "glass";
        EXPECT_EQ(pass_names(frame.report).contains("transparency"), there);
        if (!there) {
          EXPECT_EQ(pass_names(frame.report), pass_names(before.report));
          EXPECT_EQ(raster_->rasterizer().device().memory().bytes_used(), bytes);
          EXPECT_TRUE(equal_bits(frame.image, before.image));
        }
      }
    }
}

TEST_F(TransparencyTest, TracedRaysFollowEdits) {
  world::World w = glasshouse();
  knobs_.reflection = Reflection::traced;
  knobs_.refraction = Refraction::traced;
  const Camera camera = Camera::from(w.cameras[0]);
  raster(w, camera, 96, 54);
  for (uint64_t step = 0; step < 2; ++step) {
    world::EditBatch batch;
    for (uint64_t i = 0; i < 40; ++i) {
      const uint64_t h = world::mix64(step * 64 + i);
      const char* names[] = {"wool_red", "glass_blue", "water", "oak_leaves"};
      batch.set(
          {static_cast<int>(h % 60) - 30, static_cast<int>((h >> 8) % 14) - 4, static_cast<int>((h >> 16) % 60) - 30},
          i % 5 == 4 ? world::kAir : block(w, names[i % 4]));
    }
    apply(w, batch);
    const Image followed = raster(w, camera, 96, 54);
    auto fresh = make_raster({.validation = true});
    ASSERT_TRUE(fresh.ok());
    EXPECT_TRUE(equal_bits(followed, draw(**fresh, w, camera, knobs_, 96, 54).image)) << step;
  }
}

TEST_F(TransparencyTest, BentAndMirroredRaysComeNearerToTheRayCasterThatFollowsThem) {
  // Under the sky alone: no straight ray towards the sun passes water in that ray caster, while in this it is no
  // shadow.
  world::World w = glasshouse();
  w.environment.sun_irradiance = {};
  RenderKnobs whitted;
  whitted.light_transport = LightTransport::whitted;
  whitted.light_samples = 1;
  const Camera camera = Camera::from(w.cameras[0]);
  const Image right = draw(*raycast_, w, camera, whitted, 96, 54).image;
  const auto error = [&](Refraction refraction, Reflection reflection) {
    knobs_.refraction = refraction, knobs_.reflection = reflection;
    const double e = mean_difference(draw(*raster_, w, camera, knobs_, 96, 54).image, right);
    std::printf("refraction %d reflection %d: %.3f\n", static_cast<int>(refraction), static_cast<int>(reflection), e);
    return e;
  };
  const double none = error(Refraction::none, Reflection::none);
  EXPECT_LT(error(Refraction::none, Reflection::screen), none);
  EXPECT_LT(error(Refraction::none, Reflection::planar), none);
  EXPECT_LT(error(Refraction::none, Reflection::traced), none);
  EXPECT_LT(error(Refraction::traced, Reflection::traced), 0.6 * none);
}

}  // namespace
}  // namespace render
