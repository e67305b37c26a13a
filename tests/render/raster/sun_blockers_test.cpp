/// The sun through stained glass, water and leaves, and past shapes of blocks (knob tinted_shadows).
#include "render/raster/sun_blockers.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "render/bsdf/fresnel.shared.h"
#include "render/image/display.h"
#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/see_through_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 240, kHeight = 135;

RenderKnobs tinted(SunShadow shadow = SunShadow::ray) {
  RenderKnobs knobs;
  knobs.tinted_shadows = true, knobs.sun_shadow = shadow;
  knobs.textures = TextureFilter::off;
  return knobs;
}

class SunThroughBlocks : public BothBackends {
 protected:
  static Frame frame(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs) {
    auto drawn = backend.render(world::WorldView(w), camera, knobs, kWidth, kHeight);
    EXPECT_TRUE(drawn.ok()) << (drawn.ok() ? "" : drawn.error().message);
    return drawn.ok() ? std::move(*drawn) : Frame{Image(kWidth, kHeight), {}};
  }
};

/// A pane d thick holds back what it absorbs over d / cos, and at its two faces what Fresnel's law mirrors.
TEST_F(SunThroughBlocks, APaneTakesItsAbsorptionAndTwiceFresnelsShare) {
  world::World w(world::standard_blocks());
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};
  w.environment.sun_direction = glm::normalize(Vec3d(0.6, 1, 0.3));
  world::EditBatch batch;
  batch.fill({{-20, 0, -20}, {20, 0, 20}}, block(w, "plaster"));
  apply(w, batch);
  const Camera camera = camera_at({}, {0.5, 3.2, 0.4}, {0, -1, 0.001});
  const Rgb open = frame(*raycast_, w, camera, tinted()).image.at(kWidth / 2, kHeight / 2);
  batch.fill({{-20, 8, -20}, {20, 9, 20}}, block(w, "glass_green"));
  apply(w, batch);
  const world::Block& glass = (*w.palette)[block(w, "glass_green")];
  const auto cosine = static_cast<float>(w.environment.sun_direction.y);
  const float passed =
      1 - shared::fresnel_reflectance(cosine, glass.index_of_refraction / (*w.palette)[0].index_of_refraction);
  for (Backend* backend : {raycast_.get(), static_cast<Backend*>(raster_.get())}) {
    const Rgb seen = frame(*backend, w, camera, tinted()).image.at(kWidth / 2, kHeight / 2);
    const float absorption[3] = {glass.absorption.r, glass.absorption.g, glass.absorption.b};
    const float before[3] = {open.r, open.g, open.b}, now[3] = {seen.r, seen.g, seen.b};
    for (int b = 0; b < 3; ++b)
      EXPECT_NEAR(now[b] / before[b], passed * passed * std::exp(-absorption[b] * 2 / cosine), 2e-5) << b;
  }
}

/// Dust under a roof, into which the sun comes through one pane alone: all that is seen is what passes it.
TEST_F(SunThroughBlocks, AShaftHasTheColourOfItsPane) {
  world::World w(world::standard_blocks());
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};
  w.environment.sun_direction = glm::normalize(Vec3d(0.2, 1, 0.1));
  world::EditBatch batch;
  batch.fill({{-40, 20, -40}, {40, 21, 40}}, block(w, "stone"));
  batch.fill({{-4, 20, -6}, {3, 21, 5}}, block(w, "glass_green"));
  apply(w, batch);
  world::Medium dust = fog_box({20, 10, 20});
  dust.emission = {}, dust.absorption = {}, dust.scattering = {0.01f, 0.02f, 0.015f};
  w.media = {dust};
  const Camera camera = camera_at({}, {-30.4, 2.3, 0.6}, {1, 0.02, 0});
  const world::Block& glass = (*w.palette)[block(w, "glass_green")];
  const auto cosine = static_cast<float>(w.environment.sun_direction.y);
  const float passed =
      1 - shared::fresnel_reflectance(cosine, glass.index_of_refraction / (*w.palette)[0].index_of_refraction);
  const float absorption[3] = {glass.absorption.r, glass.absorption.g, glass.absorption.b};
  RenderKnobs knobs = tinted();
  knobs.fog_sun_rays = 8;
  RenderKnobs plain = knobs;
  plain.tinted_shadows = false;
  for (Backend* backend : {raycast_.get(), static_cast<Backend*>(raster_.get())}) {
    const Rgb seen = frame(*backend, w, camera, knobs).image.at(kWidth / 2, kHeight / 2);
    const Rgb open = frame(*backend, w, camera, plain).image.at(kWidth / 2, kHeight / 2);
    const float before[3] = {open.r, open.g, open.b}, now[3] = {seen.r, seen.g, seen.b};
    for (int b = 0; b < 3; ++b) {
      ASSERT_GT(before[b], 0.0f);
      EXPECT_NEAR(now[b] / before[b], passed * passed * std::exp(-absorption[b] * 2 / cosine), 2e-5) << b;
    }
    // Where the sun throws no shadows through what isn't opaque, neither does it into fog.
    knobs.sun_shadow = plain.sun_shadow = SunShadow::none;
    EXPECT_EQ(frame(*backend, w, camera, knobs).image.pixels, frame(*backend, w, camera, plain).image.pixels);
    knobs.sun_shadow = plain.sun_shadow = SunShadow::ray;
  }
}

/// The ray caster's walk through the grid and its tracer. The rest lies on edges of shadows and faces.
TEST_F(SunThroughBlocks, TheTracerShowsWhatIsCast) {
  const world::World w = window_hall();
  world::World lit = window_hall();
  world::Luminaire spark;  // that no picture shows, but for which the tracer draws it
  spark.kind = "omni", spark.power = {1e-12f, 1e-12f, 1e-12f}, spark.position = world::WorldPoint::from(0, 500, 0);
  lit.luminaires.push_back(spark);
  for (const NamedCamera& view : hall_cameras()) {
    const Image cast = frame(*raycast_, w, view.camera, tinted()).image;
    EXPECT_GE(share_within(cast, frame(*raycast_, lit, view.camera, tinted()).image, 2), 0.999) << view.name;
  }
}

TEST_F(SunThroughBlocks, FollowsEditsAsAFreshStartDoes) {
  world::World w = window_hall();
  const Camera& camera = hall_cameras()[1].camera;
  frame(*raster_, w, camera, tinted());
  const auto expect_as_cast = [&](const char* what) {
    EXPECT_GE(share_within(frame(*raster_, w, camera, tinted()).image, frame(*raycast_, w, camera, tinted()).image, 2),
              0.999)
        << what;
  };
  world::EditBatch batch;
  batch.fill({{-20, 9, 10}, {-12, 9, 22}}, block(w, "glass_red"));
  batch.set({-2, 4, 20}, block(w, "flower_red"));
  apply(w, batch);
  expect_as_cast("a pane and a flower");
  world::EditBatch away;
  away.fill({{-40, 4, 10}, {40, 30, 22}}, world::kAir);
  apply(w, away);
  expect_as_cast("all gone");
  world::EditBatch far_off;
  far_off.fill({{-300, 9, 10}, {-290, 9, 22}}, block(w, "glass_red"));  // in a region of its own
  apply(w, far_off);
  expect_as_cast("a new region");
}

uint64_t work_of(const Frame& frame) {
  uint64_t sum = 0;
  for (const EffectWork& work : frame.report.work)
    if (work.name == "tinted_shadows") sum += work.work;
  return sum;
}

TEST_F(SunThroughBlocks, CostsNothingWhereTheWorldOrTheKnobsDontCallForIt) {
  const world::World w = window_hall();
  world::World bare(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-20, 0, -20}, {20, 3, 20}}, block(bare, "plaster"));
  apply(bare, batch);
  const Camera& camera = hall_cameras()[0].camera;
  for (Backend* backend : {raycast_.get(), static_cast<Backend*>(raster_.get())}) {
    EXPECT_GT(work_of(frame(*backend, w, camera, tinted())), 0u);
    EXPECT_EQ(work_of(frame(*backend, bare, camera, tinted())), 0u);
    RenderKnobs off = tinted();
    off.tinted_shadows = false;
    EXPECT_EQ(work_of(frame(*backend, w, camera, off)), 0u);
    EXPECT_EQ(work_of(frame(*backend, w, camera, tinted(SunShadow::none))), 0u);
  }
}

}  // namespace
}  // namespace render
