/// See-through blocks in the rasterizer: that it draws what the ray caster does, that a world without such a block pays
/// nothing, and hard cases A11 to A13, R6 and X1 to X4 of it. Each picture with the validation layer on.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <set>

#include <gtest/gtest.h>

#include "render/gpu/device.h"
#include "render/image/display.h"
#include "render/image/flip.h"
#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/small_worlds.h"
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

  /// Within 2/255 on 99.9 % of the pixels, and FLIP below 0.01.
  void expect_agreement(const world::World& w, const Camera& camera, const std::string& what, int width = kWidth,
                        int height = kHeight) {
    const Image drawn = raster(w, camera, width, height);
    const Image cast = draw(*raycast_, w, camera, knobs_, width, height).image;
    const Image8 a = display_image(drawn, 0), b = display_image(cast, 0);
    size_t within = 0;
    int worst = 0;
    for (size_t i = 0; i < a.pixels.size(); i += 3) {
      int off = 0;
      for (size_t c = 0; c < 3; ++c) off = std::max(off, std::abs(a.pixels[i + c] - b.pixels[i + c]));
      within += off <= 2;
      worst = std::max(worst, off);
    }
    const double share = static_cast<double>(within) / static_cast<double>(a.pixels.size() / 3);
    EXPECT_GE(share, 0.999) << what;
    const double flip = flip_map(a, b).mean;
    EXPECT_LT(flip, 0.01) << what;
    std::printf("%-28s %.3f %% within 2/255, worst %d, FLIP %.5f\n", what.c_str(), 100 * share, worst, flip);
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

/// Panes of glass, one voxel thick and one apart, before a wall of stone.
world::World panes(int count, std::initializer_list<const char*> kinds) {
  world::World w(world::standard_blocks());
  world::Block lace;
  lace.name = "lace", lace.bsdf = "coverage", lace.coverage = 0.4f;
  lace.albedo = {0.7f, 0.3f, 0.5f}, lace.opaque = false;
  CHECK(w.palette->add(lace).ok());
  world::EditBatch batch;
  for (int i = 0; i < count; ++i)
    batch.fill({{-12, -12, -4 - 2 * i}, {12, 12, -4 - 2 * i}},
               block(w, kinds.begin()[static_cast<size_t>(i) % kinds.size()]));
  batch.fill({{-64, -64, -8 - 2 * count}, {64, 64, -6 - 2 * count}}, block(w, "plaster"));
  apply(w, batch);
  return w;
}

world::World glasshouse() {
  auto scene = world::load_scene("glasshouse");
  CHECK(scene.ok());
  world::ImportReport report;
  auto built = world::build_world(*scene, report);
  CHECK(built.ok());
  return std::move(*built);
}

TEST_F(TransparencyTest, AGlasshouseAndItsPondAreWhatTheRayCasterShows) {
  const world::World w = glasshouse();
  for (const world::CameraPlacement& placed : w.cameras)
    expect_agreement(w, Camera::from(placed), "glasshouse, " + placed.name);
}

TEST_F(TransparencyTest, CoverageBySamplesIsTheSameInBothBackends) {
  const world::World w = glasshouse();
  for (const CoveragePattern pattern : {CoveragePattern::hashed, CoveragePattern::correlated}) {
    knobs_.coverage_pattern = pattern;
    expect_agreement(w, Camera::from(w.cameras[0]), pattern == CoveragePattern::hashed ? "hashed" : "correlated");
  }
}

TEST_F(TransparencyTest, HillsWithWaterAndGlassAgreeNearAndFar) {
  constexpr world::VoxelPos kFar{10'000'000, 0, -10'000'000};
  for (const NamedCamera& view : hill_cameras()) expect_agreement(hills(), view.camera, "hills, " + view.name);
  expect_agreement(hills(kFar), hill_cameras(kFar)[0].camera, "hills far out");
}

world::Luminaire lamp_at(world::WorldPoint position, float power_w) {
  world::Luminaire lamp;
  lamp.name = lamp.kind = "omni";
  lamp.position = position;
  lamp.power = {power_w, 0.9f * power_w, 0.6f * power_w};
  return lamp;
}

world::Medium fog_box(world::Vec3f half_extent) {
  world::Medium fog;
  fog.name = fog.kind = "box_fog";
  fog.absorption = {0.04f, 0.06f, 0.09f};
  fog.emission = {20, 25, 35};
  fog.position = world::WorldPoint::from(0, 0, -6);
  fog.half_extent = half_extent;
  return fog;
}

TEST_F(TransparencyTest, LuminairesLightWhatIsThereOfLayersAndWhatLiesBehindThem) {
  // One of each BSDF that is seen through. Shadows are of opaque blocks alone in the rasterizer, and of all blocks, as
  // far as they hold light back, in the ray caster: not of any here.
  knobs_.luminaire_shadow = LuminaireShadow::none, knobs_.sun_shadow = SunShadow::none;
  world::World w = panes(6, {"lace", "glass", "glass_red"});
  w.luminaires = {lamp_at(world::WorldPoint::from(1.5, 3.5, -1.2), 9000),
                  lamp_at(world::WorldPoint::from(-3, 2, -15.5), 20000)};
  const Camera camera = camera_at({}, {3.2, 2.3, 4.5}, {-0.2, -0.1, -1});
  for (const Transparency order : {Transparency::lists, Transparency::sorted}) {
    knobs_.transparency = order;
    expect_agreement(w, camera, "panes by lamps");
  }
  const Image lit = raster(w, camera);
  w.luminaires.clear();
  EXPECT_GT(mean_difference(lit, raster(w, camera)), 0.1);
}

TEST_F(TransparencyTest, FogLiesBeforeBetweenAndBehindLayers) {
  knobs_.sun_shadow = SunShadow::none;
  // About the first panes, so that an order in which fog comes before or after all layers would be wrong.
  for (const world::Vec3f half_extent : {world::Vec3f(30, 30, 30), world::Vec3f(30, 30, 3), world::Vec3f(2, 1.5f, 6)}) {
    world::World w = panes(4, {"glass_red", "glass", "lace"});
    w.media = {fog_box(half_extent)};
    const Camera camera = camera_at({}, {3.2, 2.3, 4.5}, {-0.2, -0.1, -1});
    for (const Transparency order : {Transparency::lists, Transparency::sorted}) {
      knobs_.transparency = order;
      expect_agreement(w, camera, "panes in fog");
    }
  }
}

TEST_F(TransparencyTest, HardCaseR6_AnEyeInWaterOrGlassSeesNoHoleAtTheNearPlane) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-32, -8, -32}, {31, -1, 31}}, block(w, "sand"));
  batch.fill({{-30, -6, -30}, {29, -1, 29}}, block(w, "water"));
  batch.fill({{4, -4, 4}, {6, 4, 6}}, block(w, "glass"));
  apply(w, batch);
  for (const double gap : {0.3, 1e-3, 1e-7, 0.0}) {
    // Below the surface looking up, at the surface looking along it, beside glass, within glass.
    expect_agreement(w, camera_at({}, {0.5, -gap, 0.5}, {1, 0.3, 0.2}, 90), "just below the surface");
    expect_agreement(w, camera_at({}, {0.5, gap, 0.5}, {1, -0.3, 0.2}, 90), "just above it");
    expect_agreement(w, camera_at({}, {4 - gap, -2.5, 5.5}, {1, 0.1, 0.2}, 90), "against glass in water");
    expect_agreement(w, camera_at({}, {4 + gap, 2.5, 5.5}, {-1, 0.1, 0.2}, 90), "within glass");
  }
}

TEST_F(TransparencyTest, HardCaseA11_AHundredPanesAreDrawnInOrderAndOutgrowTheirRoomOnce) {
  // 200 interfaces a pixel: the lists start with room for one and a quarter.
  const world::World w = panes(100, {"glass_white", "glass_pink", "ice"});
  const Camera camera = camera_at({}, {0.5, 0.5, 0.5}, {0.01, 0.02, -1}, 30);
  expect_agreement(w, camera, "a hundred panes", 96, 54);
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
  knobs_.transparency = Transparency::lists;
  expect_agreement(w, camera, "glass in water");
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
