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
#include "tests/render/raster/small_worlds.h"
#include "world/proxies/proxy.h"

namespace render {
namespace {

constexpr int kWidth = 240, kHeight = 135;

world::BlockId made(world::World& w, const char* name, const char* bsdf, bool thin) {
  world::Block block;
  block.name = name, block.bsdf = bsdf, block.opaque = false;
  block.albedo = {0.2f, 0.1f, 0.1f};
  if (thin)
    block.transmission = {0.5f, 0.4f, 0.1f};
  else
    block.coverage = 0.4f;
  auto id = w.palette->add(block);
  CHECK(id.ok());
  return *id;
}

/// A floor under panes of coloured glass, a sheet, a screen with holes and a pool; fences, plants and stairs on it.
world::World window_hall() {
  world::World w(world::standard_blocks());
  w.environment.sun_direction = glm::normalize(Vec3d(0.35, 1, 0.2));
  world::EditBatch batch;
  batch.fill({{-40, 0, -40}, {40, 3, 40}}, block(w, "plaster"));
  const char* panes[] = {"glass_red", "glass_green", "glass_yellow", "glass_cyan"};
  for (int i = 0; i < 4; ++i) batch.fill({{-20 + 8 * i, 12 + i, -10}, {-14 + 8 * i, 12 + i, -2}}, block(w, panes[i]));
  batch.fill({{-20, 20, 0}, {-13, 20, 6}}, made(w, "stained_sheet", "thin", true));
  batch.fill({{-10, 20, 0}, {-3, 20, 6}}, made(w, "screen", "coverage", false));
  batch.fill({{0, 20, 0}, {2, 20, 2}}, made(w, "dull", "lambert", false));  // neither opaque nor seen through
  batch.fill({{4, 1, 0}, {14, 3, 8}}, block(w, "water"));
  batch.fill({{-10, 10, -16}, {-6, 14, -16}}, block(w, "glass_red"));  // upright, two kinds deep
  batch.fill({{-10, 10, -17}, {-6, 14, -17}}, block(w, "glass_cyan"));
  int x = -24;
  for (const world::Proxy& proxy : world::proxies()) {
    world::Block shaped;
    shaped.name = "shaped_" + proxy.name, shaped.proxy = proxy.name, shaped.opaque = false;
    shaped.albedo = {0.5f, 0.5f, 0.4f};
    const auto id = w.palette->add(shaped);
    CHECK(id.ok());
    batch.set({x, 4, 14}, *id);
    batch.set({x, 4, 15}, *id);
    batch.set({x, 8, 18}, *id);  // in the air, above its shadow
    ++x;
  }
  apply(w, batch);
  return w;
}

const std::vector<NamedCamera>& hall_cameras() {
  static const std::vector<NamedCamera> cameras = {
      {"over the panes", camera_at({}, {-2.3, 30.2, -40.7}, {0.1, -0.8, 1})},
      {"the shapes", camera_at({}, {-8.4, 11.2, 30.3}, {0.1, -0.6, -1})},
      {"the pool", camera_at({}, {9.1, 9.3, 16.2}, {-0.03, -0.5, -0.6})},
      {"down", camera_at({}, {-6.3, 60.1, -3.2}, {0.01, -1, 0.02})}};
  return cameras;
}

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

/// The bound of the project: 99.9 % of pixels within 2/255; the rest lie on edges of shadows and faces.
TEST_F(SunThroughBlocks, BothBackendsAndTheTracerShowTheSame) {
  const world::World w = window_hall();
  world::World lit = window_hall();
  world::Luminaire spark;  // that no picture shows, but for which the tracer draws it
  spark.kind = "omni", spark.power = {1e-12f, 1e-12f, 1e-12f}, spark.position = world::WorldPoint::from(0, 500, 0);
  lit.luminaires.push_back(spark);
  for (const NamedCamera& view : hall_cameras()) {
    const Image drawn = frame(*raster_, w, view.camera, tinted()).image;
    const Image cast = frame(*raycast_, w, view.camera, tinted()).image;
    const Image traced = frame(*raycast_, lit, view.camera, tinted()).image;
    const Image drawn_lit = frame(*raster_, lit, view.camera, tinted()).image;
    std::printf("  %-16s %.4f %% as cast, %.4f %% as traced\n", view.name.c_str(), 100 * share_within(drawn, cast, 2),
                100 * share_within(drawn_lit, traced, 2));
    EXPECT_GE(share_within(drawn, cast, 2), 0.999) << view.name;
    EXPECT_GE(share_within(drawn_lit, traced, 2), 0.999) << view.name;
    EXPECT_GE(share_within(cast, traced, 2), 0.999) << view.name;
    // Without it only what is opaque holds the sun back, there too.
    RenderKnobs untinted = tinted();
    untinted.tinted_shadows = false;
    const Image whole = frame(*raster_, w, view.camera, untinted).image;
    EXPECT_GE(share_within(whole, frame(*raycast_, w, view.camera, untinted).image, 2), 0.999) << view.name;
    EXPECT_GE(share_within(frame(*raster_, lit, view.camera, untinted).image,
                           frame(*raycast_, lit, view.camera, untinted).image, 2),
              0.999)
        << view.name;
    EXPECT_LT(share_within(drawn, whole, 2), 0.99) << view.name << ": there is something to see";
  }
}

TEST_F(SunThroughBlocks, MapsOfTheSunAreTintedAsRaysAre) {
  const world::World w = window_hall();
  RenderKnobs knobs = tinted(SunShadow::map);
  for (const int cascades : {0, 3}) {
    knobs.sun_map_cascades = cascades;
    const Camera& camera = hall_cameras()[0].camera;
    EXPECT_GE(share_within(frame(*raster_, w, camera, knobs).image, frame(*raycast_, w, camera, knobs).image, 2),
              0.999);
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
