/// What becomes of a picture on its way to the screen: windows of it, samples a pixel, formats, tiles.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "render/effects/chain.h"
#include "render/image/display.h"
#include "render/inhabitants.h"
#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/crowd.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 160, kHeight = 90;

std::unique_ptr<RasterBackend> checked_raster() {
  auto made = make_raster({.validation = true});
  EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
  return made.ok() ? std::move(*made) : nullptr;
}

/// With every surface where it is: coarser levels lie up to a pixel beside it.
RenderKnobs exact_levels() {
  RenderKnobs knobs;
  // Nor textures, whose filter knows the size of a pixel, and layers.
  knobs.textures = TextureFilter::off, knobs.transparency = Transparency::opaque;
  knobs.lod_error_px = 0;
  return knobs;
}

Frame frame_of(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs = exact_levels(),
               int width = kWidth, int height = kHeight) {
  const world::WorldView view(w);
  auto drawn = backend.render(view, camera, knobs, width, height);
  EXPECT_TRUE(drawn.ok()) << (drawn.ok() ? "" : drawn.error().message);
  return drawn.ok() ? std::move(*drawn) : Frame{Image(width, height), {}};
}

/// Pixels that differ by more than 1e-4 of their size in some band.
size_t differing(const Image& a, const Image& b) {
  size_t count = 0;
  const auto far = [](float x, float y) { return !(std::abs(x - y) <= 1e-4f * std::max(std::abs(x), std::abs(y))); };
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    const Rgb &p = a.pixels[i], &q = b.pixels[i];
    count += far(p.r, q.r) || far(p.g, q.g) || far(p.b, q.b);
  }
  return count;
}

TEST(PictureWindow, TilesOfAPictureMakeUpTheWhole) {
  const world::World w = hills();
  const auto raster = checked_raster();
  auto raycast = make_raycast_backend();
  ASSERT_TRUE(raster && raycast.ok());
  RenderKnobs traced = exact_levels();
  traced.spp = 4;
  struct Case {
    Backend* backend;
    RenderKnobs knobs = exact_levels();
    size_t differ;  // rays of a tile start from other bits, so that a few at edges fall to the other side
  };
  for (const Case& c : {Case{raster.get(), exact_levels(), 8}, Case{raycast->get(), exact_levels(), 2},
                        Case{raycast->get(), traced, 8}})
    for (const NamedCamera& seen : hill_cameras()) {
      if (c.knobs.spp > 1 && seen.name != "eye level") continue;
      const Image whole = frame_of(*c.backend, w, seen.camera, c.knobs).image;
      Image tiled(kWidth, kHeight);
      for (int y = 0; y < kHeight; y += 50)
        for (int x = 0; x < kWidth; x += 64) {
          const int width = std::min(64, kWidth - x), height = std::min(50, kHeight - y);
          Camera camera = seen.camera;
          camera.window = {double(x), double(y), kWidth, kHeight};
          const Image tile = frame_of(*c.backend, w, camera, c.knobs, width, height).image;
          for (int row = 0; row < height; ++row) std::copy_n(&tile.at(0, row), width, &tiled.at(x, y + row));
        }
      EXPECT_LE(differing(whole, tiled), c.differ) << seen.name;
    }
  EXPECT_EQ(raster->messages(), std::vector<std::string>{});
}

TEST(PictureWindow, AShiftByPartsOfAPixelLooksBesideTheMiddles) {
  // At twice the size, pixel (2 x + 1, 2 y + 1) looks where a window shifted by a quarter of a pixel does.
  const world::World w = hills();
  const auto raster = checked_raster();
  ASSERT_TRUE(raster);
  const Camera whole = hill_cameras()[0].camera;
  Camera shifted = whole;
  shifted.window = {0.25, 0.25, kWidth, kHeight};
  const Image twice = frame_of(*raster, w, whole, exact_levels(), 2 * kWidth, 2 * kHeight).image,
              beside = frame_of(*raster, w, shifted).image;
  Image expected(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) expected.at(x, y) = twice.at(2 * x + 1, 2 * y + 1);
  EXPECT_LE(differing(expected, beside), 8u);
  EXPECT_EQ(raster->messages(), std::vector<std::string>{});
}

TEST(AntiAliasing, MoreSamplesComeNearerToABoxFilteredPicture) {
  const world::World w = hills();
  const auto raster = checked_raster();
  auto raycast = make_raycast_backend();
  ASSERT_TRUE(raster && raycast.ok());
  const Camera camera = hill_cameras()[0].camera;
  RenderKnobs reference = exact_levels();
  reference.spp = 256;
  const Image truth = frame_of(**raycast, w, camera, reference).image;
  const auto error = [&](Backend& backend, AntiAliasing anti_aliasing) {
    RenderKnobs knobs = exact_levels();
    knobs.anti_aliasing = anti_aliasing;
    const Image image = frame_of(backend, w, camera, knobs).image;
    double squares = 0, all = 0;
    for (size_t i = 0; i < image.pixels.size(); ++i) {
      const double off = double{image.pixels[i].g} - double{truth.pixels[i].g};
      squares += off * off, all += double{truth.pixels[i].g} * double{truth.pixels[i].g};
    }
    return std::sqrt(squares / all);
  };
  for (Backend* backend : {static_cast<Backend*>(raster.get()), raycast->get()}) {
    double last = 1;
    for (const AntiAliasing a : {AntiAliasing::none, AntiAliasing::x2, AntiAliasing::x4, AntiAliasing::x8}) {
      const double now = error(*backend, a);
      std::printf("anti_aliasing=%s: RMS error %.4f of the picture\n",
                  std::string(knob_choices(a)[static_cast<size_t>(a)]).c_str(), now);
      EXPECT_LT(now, 0.8 * last);
      last = now;
    }
  }
  EXPECT_EQ(raster->messages(), std::vector<std::string>{});
}

TEST(AntiAliasing, TemporalComesToEightSamplesAtRestAndLeavesNoTrailsWhenMoving) {
  const world::World w = hills();
  const auto raster = checked_raster(), fresh = checked_raster();
  ASSERT_TRUE(raster && fresh);
  RenderKnobs temporal = exact_levels(), eight = exact_levels();
  temporal.anti_aliasing = AntiAliasing::temporal, eight.anti_aliasing = AntiAliasing::x8;
  const auto error = [](const Image& a, const Image& b) {
    double squares = 0, all = 0;
    for (size_t i = 0; i < a.pixels.size(); ++i) {
      const double off = double{a.pixels[i].g} - double{b.pixels[i].g};
      squares += off * off, all += double{b.pixels[i].g} * double{b.pixels[i].g};
    }
    return std::sqrt(squares / all);
  };
  Camera camera = hill_cameras()[0].camera;
  const Image known = frame_of(*fresh, w, camera, eight).image, none = frame_of(*fresh, w, camera).image;
  Image last;
  for (int i = 0; i < 8; ++i) last = frame_of(*raster, w, camera, temporal).image;
  std::printf("temporal at rest: %.4f of the picture off eight samples; one sample %.4f\n", error(last, known),
              error(none, known));
  EXPECT_LT(error(last, known), 0.5 * error(none, known));
  // A walk sideways and a turn: still nearer to eight samples than one sample is.
  double moving = 0, single = 0;
  for (int i = 0; i < 12; ++i) {
    camera.position = camera.position + Vec3d(0.05, 0.01, 0.02);
    camera.forward = glm::normalize(camera.forward + Vec3d(0.004, 0, 0.002));
    last = frame_of(*raster, w, camera, temporal).image;
    if (i < 6) continue;
    const Image now = frame_of(*fresh, w, camera, eight).image;
    moving += error(last, now) / 6, single += error(frame_of(*fresh, w, camera).image, now) / 6;
  }
  std::printf("temporal in motion: %.4f; one sample %.4f\n", moving, single);
  EXPECT_LT(moving, 0.9 * single);
  // A cut to another place keeps nothing of the last one.
  const Camera other = hill_cameras()[2].camera;
  const Image cut = frame_of(*raster, w, other, temporal).image, there = frame_of(*fresh, w, other, eight).image;
  EXPECT_LT(error(cut, there), 1.5 * error(frame_of(*fresh, w, other).image, there) + 0.02);
  // Without it the pass goes.
  for (const PassReport& pass : frame_of(*raster, w, camera).report.passes) EXPECT_NE(pass.name, "temporal");
  EXPECT_EQ(raster->messages(), std::vector<std::string>{});
}

TEST(HardCaseX1, EffectsOfBackendsAreThoseOfTheChainAndAbsentOnesMakeNoPass) {
  world::World w = hills();
  w.environment.sun_direction = glm::normalize(Vec3d(0.55, 0.2, -0.75));
  const auto raster = checked_raster();
  auto raycast = make_raycast_backend();
  ASSERT_TRUE(raster && raycast.ok());
  const Camera camera = hill_cameras()[1].camera;
  RenderKnobs knobs = exact_levels();
  knobs.bloom = 0.2f, knobs.vignette = 1, knobs.tone_map = ToneMap::filmic, knobs.grain = 0.02f;
  knobs.exposure_mode = ExposureMode::histogram, knobs.lens_flare = 0.5f, knobs.chromatic_aberration = 0.004f;
  for (Backend* backend : {static_cast<Backend*>(raster.get()), raycast->get()}) {
    const Frame plain = frame_of(*backend, w, camera), with = frame_of(*backend, w, camera, knobs),
                again = frame_of(*backend, w, camera);
    Frame expected = plain;
    const world::WorldView view(w);
    ASSERT_TRUE(finish_picture(view, camera, knobs, expected).ok());
    EXPECT_LE(differing(with.image, expected.image), 4u);  // of 14400; bounds in effects_test.cpp
    EXPECT_NEAR(with.report.metered_ev, expected.report.metered_ev, 1e-4);
    EXPECT_EQ(differing(plain.image, again.image), 0u);
    EXPECT_EQ(plain.report.passes.size(), again.report.passes.size());
    EXPECT_EQ(with.report.passes.size(), plain.report.passes.size() + 3);  // levels, meter, and all others at once
  }
  EXPECT_EQ(raster->messages(), std::vector<std::string>{});
}

TEST(Device, WithoutOptionalFeaturesAPictureIsTheSameAndSaysWhatIsMissing) {
  const world::World w = hills();
  const Camera camera = hill_cameras()[0].camera;
  const auto whole = checked_raster();
  auto poor = make_raster({.validation = true, .without = {"multiDrawIndirect", "drawIndirectCount"}});
  ASSERT_TRUE(whole && poor.ok());
  const Frame a = frame_of(*whole, w, camera), b = frame_of(**poor, w, camera);
  EXPECT_EQ(differing(a.image, b.image), 0u);
  EXPECT_TRUE(a.report.warnings.empty());
  ASSERT_EQ(b.report.warnings.size(), 2u);
  EXPECT_EQ((*poor)->messages(), std::vector<std::string>{});
}

TEST(HardCaseR13, OutOfDeviceMemoryAtAnyPlaceIsOneErrorAndThenThePictureAgain) {
  const world::World w = hills();
  const Camera camera = hill_cameras()[0].camera;
  RenderKnobs knobs = exact_levels();
  knobs.bloom = 0.1f, knobs.anti_aliasing = AntiAliasing::x2;
  const auto raster = checked_raster();
  ASSERT_TRUE(raster);
  const Image whole = frame_of(*raster, w, camera, knobs).image;
  int failed = 0;
  for (uint64_t limit = 1 << 12; limit < uint64_t{1} << 31; limit *= 3) {
    auto poor = make_raster({.validation = true});
    ASSERT_TRUE(poor.ok());
    gpu::MemoryPool& memory = (*poor)->rasterizer().device().memory();
    memory.limit = limit;
    const world::WorldView view(w);
    const auto drawn = (*poor)->render(view, camera, knobs, kWidth, kHeight);
    if (drawn.ok()) {
      EXPECT_EQ(differing(drawn->image, whole), 0u) << limit;
    } else {
      ++failed;
      EXPECT_NE(drawn.error().message.find("VK_ERROR_OUT_OF_DEVICE_MEMORY"), std::string::npos)
          << drawn.error().message;
      EXPECT_EQ(drawn.error().message.find('\n'), std::string::npos);
    }
    // With memory again, the same backend draws the whole picture.
    memory.limit = ~uint64_t{0};
    EXPECT_EQ(differing(frame_of(**poor, w, camera, knobs).image, whole), 0u) << limit;
    EXPECT_EQ((*poor)->messages(), std::vector<std::string>{});
  }
  EXPECT_GE(failed, 2);
}

TEST(HardCaseR11, ALostDeviceGetsItsEffectsBack) {
  int until_loss = 0;
  auto raster = make_raster({.validation = true, .lose_device = [&] { return --until_loss == 0; }});
  ASSERT_TRUE(raster.ok());
  const world::World w = hills();
  RenderKnobs knobs = exact_levels();
  knobs.bloom = 0.2f, knobs.anti_aliasing = AntiAliasing::x4, knobs.exposure_mode = ExposureMode::log_mean;
  const Camera camera = hill_cameras()[0].camera;
  const Image before = frame_of(**raster, w, camera, knobs).image;
  for (const int k : {1, 3, 4}) {  // in the middle of the samples too
    until_loss = k;
    EXPECT_EQ(differing(frame_of(**raster, w, camera, knobs).image, before), 0u) << k;
  }
  EXPECT_EQ((*raster)->messages(), std::vector<std::string>{});
}

TEST(InhabitantsOfAPicture, MakeNoPassWhereThereAreNone) {
  const world::World w = hills();
  const Crowd crowd;
  const auto raster = checked_raster();
  ASSERT_TRUE(raster);
  for (const NamedCamera& seen : hill_cameras()) {
    const Frame without = frame_of(*raster, w, seen.camera);
    raster->inhabitants = crowd.view();
    const Frame with = frame_of(*raster, w, seen.camera);
    raster->inhabitants = {};
    EXPECT_EQ(with.report.passes.size(), without.report.passes.size() + 2);  // bodies, particles
    const Frame after = frame_of(*raster, w, seen.camera);
    EXPECT_EQ(differing(after.image, without.image), 0u);
    EXPECT_EQ(after.report.passes.size(), without.report.passes.size());
  }
  EXPECT_EQ(raster->messages(), std::vector<std::string>{});
}

TEST(InhabitantsOfAPicture, BodiesAreSeenThroughLayersInAnyOrder) {
  const world::World w = pond();
  const auto raster = checked_raster();
  ASSERT_TRUE(raster);
  for (const NamedCamera& seen : pond_cameras())
    for (const Transparency order : {Transparency::lists, Transparency::weighted}) {
      RenderKnobs knobs;
      knobs.transparency = order, knobs.lod_error_px = 0;
      const Image without = frame_of(*raster, w, seen.camera, knobs).image;
      raster->inhabitants = {{}, {}, kBodiesByThePond};
      const Image with = frame_of(*raster, w, seen.camera, knobs).image;
      raster->inhabitants = {};
      size_t changed = 0;
      for (size_t i = 0; i < with.pixels.size(); ++i)
        changed += std::abs(without.pixels[i].g - with.pixels[i].g) > 0.01f * kWhiteRadiance;
      EXPECT_GT(changed, with.pixels.size() / 200) << seen.name;
    }
  EXPECT_EQ(raster->messages(), std::vector<std::string>{});
}

TEST(HardCaseH17, ParticlesFadeSoftlyAtSurfacesAtTheirRimAndAroundTheCamera) {
  const shared::DrawnBall ball{{0, 0, -10, 2}, {1, 1, 1, 3}};
  const glm::vec3 ahead(0, 0, -1);
  const float all = shared::ball_opacity(ball, ahead, 100);
  EXPECT_NEAR(all, 1 - std::exp(-3.0f), 1e-6);
  // A surface that moves through it from behind takes it away without a step; at its middle half of its depth is left.
  float last = all;
  for (float end = 12; end >= 8; end -= 0.05f) {
    const float now = shared::ball_opacity(ball, ahead, end);
    EXPECT_LE(now, last + 1e-6f);
    EXPECT_GT(now, last - 0.06f);
    last = now;
  }
  EXPECT_EQ(shared::ball_opacity(ball, ahead, 8), 0);
  EXPECT_NEAR(shared::ball_opacity(ball, ahead, 10), 1 - std::exp(-1.5f), 1e-5);
  // From within: only what is ahead.
  const shared::DrawnBall around{{0, 0, 0, 2}, {1, 1, 1, 3}};
  EXPECT_NEAR(shared::ball_opacity(around, ahead, 100), 1 - std::exp(-1.5f), 1e-6);
  // No step at the rim.
  EXPECT_LT(shared::ball_opacity(ball, glm::normalize(glm::vec3(2.0405f, 0, -10)), 100), 0.15f);
}

TEST(InhabitantsOfAPicture, ASmallParticleKeepsItsShareOfAPixel) {
  const world::World w(world::standard_blocks());
  Camera camera = camera_at({}, {0.5, 0.5, 0.5}, {0, 0, -1});
  const auto sum = [&](float radius, float distance) {
    const std::vector<ParticleRecord> one{{0.5f, 0.5f, 0.5f - distance, radius, {1, 1, 1}, 0.5f, {1000, 1000, 1000}}};
    const world::WorldView view(w);
    const DrawnInhabitants drawn = drawn_inhabitants(view, {{}, one, {}}, camera, {}, 320, 180);
    Image image(320, 180);
    const std::vector<float> far(image.pixels.size(), 1e30f);
    PixelDistances distances{far, far};
    draw_over(drawn, camera, distances, image);
    double total = 0;
    for (const Rgb& p : image.pixels) total += double{p.g};
    return total;
  };
  // Four times as far has a sixteenth of the light, down to far below a pixel.
  EXPECT_NEAR(sum(0.3f, 10) / sum(0.3f, 40), 16, 2.5);
  EXPECT_NEAR(sum(0.02f, 10) / sum(0.02f, 40), 16, 2.5);
}

TEST(InhabitantsOfAPicture, AStreakIsTheMeanOfWhereTheParticleIs) {
  const shared::DrawnBall streak{{0.3f, -0.2f, -10, 0.5f}, {1, 1, 1, 0.8f}, {3, 1, -2, 1}};
  for (int y = -8; y <= 8; ++y)
    for (int x = -20; x <= 20; ++x) {
      const glm::vec3 direction = glm::normalize(glm::vec3(0.01f * float(x) + 0.003f, 0.01f * float(y), -1));
      double depth = 0;
      constexpr int kTimes = 4000;
      for (int i = 0; i < kTimes; ++i) {
        shared::DrawnBall still = streak;
        still.middle += ((float(i) + 0.5f) / kTimes - 0.5f) * glm::vec4(glm::vec3(streak.way), 0);
        still.way = glm::vec4(0);
        depth -= std::log1p(-double{shared::ball_opacity(still, direction, 100)}) / kTimes;
      }
      ASSERT_NEAR(shared::ball_opacity(streak, direction, 100), 1 - std::exp(-depth), 2e-4) << x << " " << y;
    }
  // Straight away from the eye it is a ball.
  const shared::DrawnBall away{{0, 0, -10, 0.5f}, {1, 1, 1, 0.8f}, {0, 0, 4, 1}};
  EXPECT_NEAR(shared::ball_opacity(away, {0, 0, -1}, 100), 1 - std::exp(-0.8f), 1e-4);
  EXPECT_EQ(shared::ball_opacity(streak, {0, 0, 1}, 100), 0);  // behind
  EXPECT_EQ(shared::ball_opacity(streak, {0, 0, -1}, 3), 0);   // hidden
}

TEST(InhabitantsOfAPicture, AThinParticleHidesAsMuchHoweverItMoves) {
  const world::World w(world::standard_blocks());
  const Camera camera = camera_at({}, {0.5, 0.5, 0.5}, {0, 0, -1});
  const auto sum = [&](world::Vec3f velocity, float shutter) {
    std::vector<ParticleRecord> one{{0.5f, 0.5f, -9.5f, 0.1f, {1, 1, 1}, 0.05f, {1000, 1000, 1000}}};
    one[0].velocity_x = velocity.x, one[0].velocity_y = velocity.y, one[0].velocity_z = velocity.z;
    RenderKnobs knobs;
    knobs.shutter = shutter;
    const DrawnInhabitants drawn = drawn_inhabitants(world::WorldView(w), {{}, one, {}}, camera, knobs, 640, 360);
    Image image(640, 360);
    const std::vector<float> far(image.pixels.size(), 1e30f);
    PixelDistances distances{far, far};
    draw_over(drawn, camera, distances, image);
    double total = 0;
    for (const Rgb& p : image.pixels) total += double{p.g};
    return total;
  };
  const double still = sum({}, 0.02f);
  EXPECT_GT(still, 0);
  EXPECT_EQ(sum({5, -60, 3}, 0), still);  // no shutter, no streak
  for (const world::Vec3f velocity : {world::Vec3f(0, -60, 0), world::Vec3f(70, 50, 0), world::Vec3f(-30, 10, 4)})
    EXPECT_NEAR(sum(velocity, 0.02f), still, 0.04 * still);  // it is some 7 pixels wide, sampled at their middles
}

}  // namespace
}  // namespace render
