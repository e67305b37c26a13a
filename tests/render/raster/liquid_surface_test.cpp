/// Liquids that end within their voxels: shadows and edits of them, and that what has none costs nothing. That the
/// rasterizer draws them as the ray caster does is claimed in tests/tools/agreement/rows.cpp.
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/see_through_worlds.h"

namespace render {
namespace {

using namespace world;

constexpr int kWidth = 320, kHeight = 180;

class LiquidSurfaceTest : public BothBackends {
 protected:
  void SetUp() override {
    BothBackends::SetUp();
    knobs_.lod_error_px = 0;
    knobs_.liquid_surface = LiquidSurface::level;
  }
  Image raster(const World& w, const Camera& camera) {
    return draw(*raster_, w, camera, knobs_, kWidth, kHeight).image;
  }
  Image raycast(const World& w, const Camera& camera) {
    return draw(*raycast_, w, camera, knobs_, kWidth, kHeight).image;
  }

  RenderKnobs knobs_;
};

TEST_F(LiquidSurfaceTest, AFilmShowsItsFloorToBentRaysAsToStraightOnes) {
  World w(standard_blocks());
  EditBatch batch;
  batch.fill({{-12, -1, -12}, {12, -1, 12}}, block(w, "brick_red"));
  batch.fill({{-12, 0, -12}, {12, 0, 12}}, block(w, "salt_water"));
  apply(w, batch);
  const Camera camera = camera_at({}, {0.4, 9.3, 0.7}, {0.02, -1, 0.03}, 70);
  knobs_.textures = TextureFilter::off;  // of what a bent ray meets no footprint is known
  const auto both = [&] {
    knobs_.refraction = Refraction::none;
    const Image straight = raster(w, camera);
    knobs_.refraction = Refraction::traced;
    return std::pair(straight, raster(w, camera));
  };
  const Image deep = raster(w, camera);
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  for (int x = -12; x <= 12; ++x)
    for (int z = -12; z <= 12; ++z) amounts.set({x, 0, z}, 200);
  const auto [film, bent] = both();
  EXPECT_GT(share_within(film, bent, 6), 0.97);
  EXPECT_LT(share_within(film, deep, 6), 0.5) << "a metre is darker";
}

TEST_F(LiquidSurfaceTest, OfFullLiquidsAreBitForBitThoseWithoutLevelsAndCostNothing) {
  World w = hills();
  w.store.make_int_layer(Layer::liquid);  // one that holds nothing
  for (const Transparency transparency : {Transparency::lists, Transparency::opaque}) {
    knobs_.transparency = transparency;
    const Camera camera = hill_cameras()[0].camera;
    knobs_.liquid_surface = LiquidSurface::full;
    for (int i = 0; i < 2; ++i) draw(*raster_, w, camera, knobs_, kWidth, kHeight);  // what is hidden is known then
    const Frame drawn = draw(*raster_, w, camera, knobs_, kWidth, kHeight);
    const Image cast = raycast(w, camera);
    knobs_.liquid_surface = LiquidSurface::level;
    const Frame again = draw(*raster_, w, camera, knobs_, kWidth, kHeight);
    EXPECT_TRUE(same(drawn.image, again.image));
    EXPECT_TRUE(same(cast, raycast(w, camera)));
    EXPECT_EQ(drawn.report.faces_drawn, again.report.faces_drawn);
    ASSERT_EQ(drawn.report.passes.size(), again.report.passes.size());
    for (size_t i = 0; i < drawn.report.passes.size(); ++i) {
      EXPECT_EQ(drawn.report.passes[i].name, again.report.passes[i].name);
      EXPECT_EQ(drawn.report.passes[i].draws, again.report.passes[i].draws) << drawn.report.passes[i].name;
    }
  }
}

TEST_F(LiquidSurfaceTest, LowLavaThrowsNoShadowWhereItsVoxelWould) {
  // A floor in low sun, a wall that faces it, a post, and lava between them: `amount` of it, or none.
  const auto yard = [](int amount) {
    World w(standard_blocks());
    EditBatch batch;
    batch.fill({{-20, -1, -20}, {20, -1, 20}}, block(w, "marble"));
    batch.fill({{-4, 0, -9}, {-4, 3, 6}}, block(w, "marble"));
    batch.fill({{6, 0, -4}, {6, 2, -4}}, block(w, "marble"));
    if (amount > 0) batch.fill({{-1, 0, -3}, {4, 0, 4}}, block(w, "lava"));
    apply(w, batch);
    IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
    for (int x = -1; x <= 4; ++x)
      for (int z = -3; z <= 4; ++z)
        if (amount > 0) amounts.set({x, 0, z}, amount);
    w.environment.sun_direction = glm::normalize(Vec3d(0.8, 0.35, 0.3));
    return w;
  };
  knobs_.textures = TextureFilter::off;
  const Camera camera = camera_at({}, {5.3, 11.2, 13.4}, {-0.35, -0.75, -0.8}, 60);
  // Lava is red by itself, so what has lost red is in its shadow.
  const auto shaded_by = [](const Image& bare, const Image& with) {
    int shaded = 0;
    for (size_t i = 0; i < bare.pixels.size(); ++i) shaded += with.pixels[i].r < 0.9f * bare.pixels[i].r;
    return shaded;
  };
  for (const auto& [shadow, cascades] :
       {std::pair(SunShadow::ray, 0), std::pair(SunShadow::map, 0), std::pair(SunShadow::map, 4)}) {
    knobs_.sun_shadow = shadow, knobs_.sun_map_cascades = cascades;
    const World bare = yard(0), low = yard(1500), full = yard(4096);
    for (Backend* backend : {static_cast<Backend*>(raster_.get()), raycast_.get()}) {
      const std::string name = (backend == raycast_.get() ? "raycast " : "raster ") + std::to_string(cascades);
      const Image without = draw(*backend, bare, camera, knobs_, kWidth, kHeight).image;
      EXPECT_EQ(shaded_by(without, draw(*backend, low, camera, knobs_, kWidth, kHeight).image), 0) << name;
      EXPECT_GT(shaded_by(without, draw(*backend, full, camera, knobs_, kWidth, kHeight).image), 100) << name;
    }
    if (shadow == SunShadow::ray) {
      EXPECT_GE(share_within(raster(low, camera), raycast(low, camera), 2), 0.999);
    }
  }
}

TEST_F(LiquidSurfaceTest, ThatRestSendNothingAndThoseThatMoveAreFollowed) {
  World w = spill();
  const Camera camera = spill_cameras()[0].camera;
  const auto sent = [](const Frame& f) {
    uint64_t bytes = 0;
    for (const PassReport& pass : f.report.passes)
      if (pass.name == "upload" || pass.name == "upload_see_through") bytes += pass.bytes;
    return bytes;
  };
  draw(*raster_, w, camera, knobs_, kWidth, kHeight);
  const Frame rests = draw(*raster_, w, camera, knobs_, kWidth, kHeight);
  EXPECT_EQ(sent(rests), 0u);
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  amounts.set({2, 0, 2}, amounts.get({2, 0, 2}) + 1);  // less than a step
  EXPECT_EQ(sent(draw(*raster_, w, camera, knobs_, kWidth, kHeight)), 0u);
  for (int x = 0; x < 12; ++x) amounts.set({x, 0, 2}, 300);
  for (int z = 2; z < 20; ++z) amounts.set({18, 0, z}, 3900);
  const Frame moved = draw(*raster_, w, camera, knobs_, kWidth, kHeight);
  EXPECT_GT(sent(moved), 0u);
  auto fresh = make_raster({.validation = true});
  ASSERT_TRUE(fresh.ok());
  EXPECT_TRUE(same(moved.image, draw(**fresh, w, camera, knobs_, kWidth, kHeight).image));
  EXPECT_FALSE(same(moved.image, rests.image));
  // And back to full ones.
  for (int x = 16; x < 24; ++x)
    for (int z = 0; z < 24; ++z) amounts.set({x, 0, z}, 4096);
  EXPECT_TRUE(same(draw(*raster_, w, camera, knobs_, kWidth, kHeight).image,
                   draw(**fresh, w, camera, knobs_, kWidth, kHeight).image));
}

TEST_F(LiquidSurfaceTest, AnEyeAboveTheSurfaceInALiquidsVoxelIsNotUnderWater) {
  World w(standard_blocks());
  EditBatch batch;
  batch.fill({{-30, -2, -30}, {30, -1, 30}}, block(w, "marble"));
  batch.fill({{-30, 0, -30}, {30, 0, 30}}, block(w, "honey"));  // dark within a metre
  batch.fill({{-30, 0, 20}, {30, 6, 20}}, block(w, "marble"));
  apply(w, batch);
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  for (int x = -30; x <= 30; ++x)
    for (int z = -30; z <= 30; ++z) amounts.set({x, 0, z}, 2048);
  const Camera above = camera_at({}, {0.3, 0.75, 0.6}, {0, 0.12, 1}),
               below = camera_at({}, {0.3, 0.35, 0.6}, {0, 0.12, 1});
  for (Backend* backend : {static_cast<Backend*>(raster_.get()), raycast_.get()}) {
    const Image seen = draw(*backend, w, above, knobs_, kWidth, kHeight).image;
    const Image under = draw(*backend, w, below, knobs_, kWidth, kHeight).image;
    const Rgb& wall = seen.at(kWidth / 2, kHeight / 2);
    EXPECT_GT(wall.b, 0.8f * wall.r) << "marble is white";
    EXPECT_LT(under.at(kWidth / 2, kHeight / 2).b, 0.2f * wall.b) << "honey lets no blue through";
  }
}

}  // namespace
}  // namespace render
