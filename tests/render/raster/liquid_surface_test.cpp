/// Liquids that end within their voxels: the rasterizer draws them as the ray caster does, and what has none costs
/// nothing.
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "render/image/flip.h"
#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

using namespace world;

constexpr int kWidth = 320, kHeight = 180;

/// A basin of 24 x 24 m: water that slopes down from a full voxel to a film, with a film of oil beyond it; a waterfall
/// from a ledge; lava that slopes across; panes and posts that stand in them.
World spill(VoxelPos at = {}) {
  World w(standard_blocks());
  EditBatch batch;
  batch.fill(box_at(at, {-1, -2, -1}, {24, 3, 24}), block(w, "stone"));
  batch.fill(box_at(at, {0, 0, 0}, {23, 3, 23}), kAir);
  batch.fill(box_at(at, {0, 0, 0}, {11, 0, 23}), block(w, "water"));
  batch.fill(box_at(at, {12, 0, 0}, {15, 0, 11}), block(w, "oil"));
  batch.fill(box_at(at, {16, 0, 0}, {23, 0, 23}), block(w, "lava"));
  batch.fill(box_at(at, {12, 0, 12}, {15, 2, 23}), block(w, "brick_red"));  // a wall, and the ledge
  batch.fill(box_at(at, {0, 0, 20}, {11, 2, 23}), block(w, "brick_red"));
  batch.fill(box_at(at, {3, 3, 19}, {5, 3, 23}), block(w, "water"));  // along the ledge and over it
  batch.fill(box_at(at, {3, 1, 19}, {5, 2, 19}), block(w, "water"));
  batch.fill(box_at(at, {8, 0, 4}, {8, 2, 7}), block(w, "glass"));
  batch.fill(box_at(at, {20, 0, 6}, {20, 2, 6}), block(w, "marble"));
  batch.set(at + VoxelPos{6, 0, 12}, block(w, "fence_oak"));
  apply(w, batch);
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  for (int x = 0; x < 24; ++x)
    for (int z = 0; z < 24; ++z) {
      if (x < 12 && z < 20) amounts.set(at + VoxelPos{x, 0, z}, std::max(4096 - 350 * x, 40));
      if (x >= 12 && x < 16 && z < 12) amounts.set(at + VoxelPos{x, 0, z}, 60);
      if (x >= 16) amounts.set(at + VoxelPos{x, 0, z}, std::max(4000 - 170 * z, 100));
    }
  for (int x = 3; x < 6; ++x)
    for (int z = 19; z < 24; ++z) amounts.set(at + VoxelPos{x, 3, z}, 900);
  return w;
}

std::vector<NamedCamera> spill_cameras(VoxelPos at = {}) {
  return {{"overview", camera_at(at, {-4.3, 9.2, -6.7}, {0.7, -0.5, 0.8})},
          {"along the water", camera_at(at, {10.4, 1.13, 1.6}, {-0.5, -0.08, 1})},
          {"over a film", camera_at(at, {11.3, 0.42, 3.2}, {-1, -0.02, 0.35})},
          {"before the fall", camera_at(at, {4.6, 1.9, 11.3}, {0.03, -0.1, 1})},
          {"over lava", camera_at(at, {19.7, 1.4, 22.2}, {0.1, -0.3, -1})},
          {"in the film's voxel above it", camera_at(at, {9.5, 0.61, 8.4}, {-0.8, -0.1, 0.6})},
          {"under water", camera_at(at, {0.6, 0.35, 6.4}, {0.9, 0.15, 0.4})},
          {"straight down", camera_at(at, {12.5, 21.3, 12.1}, {0, -1, 0}, 70)}};
}

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

  /// Within 2/255 on 99.9 % of the pixels, and FLIP below 0.01.
  void expect_agreement(const World& w, const NamedCamera& view, const std::string& what) {
    const Image drawn = raster(w, view.camera), cast = raycast(w, view.camera);
    const double share = share_within(drawn, cast, 2);
    const double flip = flip_map(display_image(drawn, 0), display_image(cast, 0)).mean;
    EXPECT_GE(share, 0.999) << what << ", " << view.name;
    EXPECT_LT(flip, 0.01) << what << ", " << view.name;
    std::printf("%-20s %-30s %.3f %% within 2/255, FLIP %.5f\n", what.c_str(), view.name.c_str(), 100 * share, flip);
  }

  RenderKnobs knobs_;
};

TEST_F(LiquidSurfaceTest, FilmsSlopesWaterfallsAndLavaAreTheSameInBothBackends) {
  const World w = spill();
  for (const NamedCamera& view : spill_cameras()) expect_agreement(w, view, "lists");
  knobs_.merge_faces = false;
  expect_agreement(w, spill_cameras()[0], "unit faces");
  knobs_.merge_faces = true;
  knobs_.transparency = Transparency::opaque;
  for (const NamedCamera& view : spill_cameras())
    if (view.name != "under water") expect_agreement(w, view, "opaque");
}

TEST_F(LiquidSurfaceTest, OfUnitFacesSortedAreTheSame) {
  const World w = spill();
  knobs_.transparency = Transparency::sorted;
  knobs_.merge_faces = false;
  for (const size_t i : {size_t{0}, size_t{3}, size_t{7}}) expect_agreement(w, spill_cameras()[i], "sorted");
}

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

TEST_F(LiquidSurfaceTest, AreTheSameFarFromTheOrigin) {
  constexpr VoxelPos kFar{10'000'000, 0, -10'000'000};
  const World w = spill(kFar);
  expect_agreement(w, spill_cameras(kFar)[0], "far");
}

TEST_F(LiquidSurfaceTest, AreTheSameWithLuminaires) {
  World w = spill();
  Luminaire lamp;
  lamp.kind = "sphere";
  lamp.position = WorldPoint::from(9.5, 6.2, 9.5);
  lamp.radius = 0.3f;
  lamp.power = {900, 800, 700};
  w.luminaires.push_back(lamp);
  // What the rasterizer's water doesn't hold back of light, the tracer's does.
  knobs_.luminaire_shadow = LuminaireShadow::none, knobs_.sun_shadow = SunShadow::none;
  for (const size_t i : {0, 3, 5}) {
    const NamedCamera view = spill_cameras()[static_cast<size_t>(i)];
    const Image drawn = raster(w, view.camera), cast = raycast(w, view.camera);
    EXPECT_LT(flip_map(display_image(drawn, 0), display_image(cast, 0)).mean, 0.01) << view.name;
  }
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
    if (shadow == SunShadow::ray) expect_agreement(low, {"yard", camera}, "low lava");
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
