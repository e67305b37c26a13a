/// Blocks with a shape of their own (world/proxies), drawn: the same picture from all backends, after edits as afresh.
#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>

#include "render/extract/proxies.h"
#include "render/image/display.h"
#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/small_worlds.h"
#include "world/proxies/proxy.h"

namespace render {
namespace {

constexpr int kWidth = 480, kHeight = 270;

/// Every shape twice on a floor of stone, beside each other and beside walls; a garden of plants, a fence round it.
world::World garden(world::VoxelPos offset = {}) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill(box_at(offset, {-20, -1, -20}, {30, -1, 20}), block(w, "stone"));
  int x = 0;
  for (const world::Proxy& proxy : world::proxies()) {
    const float shade = 0.2f + 0.008f * static_cast<float>(x);
    const world::BlockId id = shaped(w, proxy.name, {shade, 0.5f, 0.8f - shade});
    const int column = x % 12 * 2, row = x / 12 * 3;
    batch.set(offset + world::VoxelPos{column, 0, row}, id);
    batch.set(offset + world::VoxelPos{column + 1, 0, row}, id);
    if (x % 3 == 0) batch.set(offset + world::VoxelPos{column, 0, row + 1}, block(w, "brick_red"));
    if (x % 4 == 0) batch.set(offset + world::VoxelPos{column, 1, row}, block(w, "glass"));
    ++x;
  }
  const char* plants[] = {"flower_red", "reed", "tall_grass", "fern", "torch"};
  for (int i = 0; i < 120; ++i) {
    const uint64_t h = world::mix64(static_cast<uint64_t>(i + 5));
    batch.set(offset + world::VoxelPos{static_cast<int>(h % 14) - 16, 0, static_cast<int>(h / 14 % 24) - 12},
              block(w, plants[h / 1000 % 5]));
  }
  apply(w, batch);
  return w;
}

std::vector<NamedCamera> garden_cameras(world::VoxelPos offset = {}) {
  return {{"along", camera_at(offset, {-3.3, 2.1, -4.2}, {0.7, -0.3, 0.6})},
          {"above", camera_at(offset, {8.4, 9.2, 6.3}, {0.1, -1, 0.3})},
          {"in the plants", camera_at(offset, {-9.4, 0.6, 0.3}, {1, -0.1, 0.2})}};
}

class ShapesOfBlocks : public BothBackends {
 protected:
  static Frame frame(Backend& backend, const world::World& w, const Camera& camera, RenderKnobs knobs = {}) {
    const world::WorldView view(w);
    knobs.transparency = Transparency::opaque, knobs.textures = TextureFilter::off;  // those are other tests'
    auto drawn = backend.render(view, camera, knobs, kWidth, kHeight);
    EXPECT_TRUE(drawn.ok()) << (drawn.ok() ? "" : drawn.error().message);
    return drawn.ok() ? std::move(*drawn) : Frame{Image(kWidth, kHeight), {}};
  }
};

/// The bound of the project: 99.9 % of pixels within 2/255.
TEST_F(ShapesOfBlocks, AreDrawnAsTheyAreTraced) {
  const world::World w = garden();
  world::World lit = garden();
  world::Luminaire spark;  // that no picture shows
  spark.kind = "omni";
  spark.power = {1e-12f, 1e-12f, 1e-12f};
  spark.position = world::WorldPoint::from(0, 500, 0);
  lit.luminaires.push_back(spark);
  for (const NamedCamera& view : garden_cameras()) {
    const double share = share_within(frame(*raster_, w, view.camera).image, frame(*raycast_, w, view.camera).image, 2);
    std::printf("  %-14s %.4f %% within 2/255 of the ray caster\n", view.name.c_str(), 100 * share);
    EXPECT_GE(share, 0.999) << view.name;
    // The tracer, which a lamp calls for, finds and lights shapes by code of its own. Without shadows, which shapes
    // cast there and not here.
    RenderKnobs knobs;
    knobs.sun_shadow = SunShadow::none;
    const double of_tracer =
        share_within(frame(*raster_, w, view.camera, knobs).image, frame(*raycast_, lit, view.camera, knobs).image, 2);
    std::printf("  %-14s %.4f %% without shadows\n", view.name.c_str(), 100 * of_tracer);
    EXPECT_GE(of_tracer, 0.999) << view.name;
  }
}

/// Each pixel asks its own ray either way; where two faces meet, rounding of depth may choose the other one.
TEST_F(ShapesOfBlocks, AsPointsTheyAreThePictureThatTheyAreAsFaces) {
  constexpr world::VoxelPos kUp{0, 56, 0};  // just below the end of its chunk
  const world::World w = garden(kUp);
  // Plants of 8 to 30 pixels, cut by the picture's border.
  const NamedCamera cameras[] = {{"down", camera_at(kUp, {-8.4, 16.2, 1.3}, {0.1, -1, 0.03})},
                                 {"slanted", camera_at(kUp, {-12.3, 17.1, -9.2}, {0.7, -0.7, 0.6})},
                                 {"along", camera_at(kUp, {20.3, 18.1, 9.2}, {-0.9, -0.5, -0.1})}};
  for (const NamedCamera& view : cameras) {
    RenderKnobs knobs;
    knobs.shape_points_px = 0;
    const Frame faces = frame(*raster_, w, view.camera, knobs);
    knobs.shape_points_px = 60;
    const Frame points = frame(*raster_, w, view.camera, knobs);
    EXPECT_LT(points.report.faces_drawn, 0.5 * static_cast<double>(faces.report.faces_drawn)) << view.name;
    const double same = share_within(points.image, faces.image, 0);
    std::printf("  %-14s %.4f %% of pixels equal\n", view.name.c_str(), 100 * same);
    EXPECT_GE(same, 0.9999) << view.name;
    EXPECT_GE(share_within(points.image, frame(*raycast_, w, view.camera).image, 2), 0.999) << view.name;
  }
}

TEST_F(ShapesOfBlocks, FarOutLookTheSame) {
  constexpr world::VoxelPos kFar{10'000'000, 0, -10'000'000};
  const Image near = frame(*raster_, garden(), garden_cameras()[0].camera).image;
  const Image far = frame(*raster_, garden(kFar), garden_cameras(kFar)[0].camera).image;
  EXPECT_EQ(std::memcmp(near.pixels.data(), far.pixels.data(), near.pixels.size() * sizeof(Rgb)), 0);
}

TEST_F(ShapesOfBlocks, AfterEditsThePictureIsThatOfAFreshBackend) {
  world::World w = garden();
  const Camera camera = garden_cameras()[0].camera;
  frame(*raster_, w, camera);
  const world::BlockId edits[] = {block(w, "torch"), world::kAir, block(w, "stone"), block(w, "flower_blue"),
                                  world::kAir};
  for (size_t i = 0; i < std::size(edits); ++i) {
    world::EditBatch batch;
    batch.set({static_cast<int>(i) * 2, 0, 0}, edits[i]);
    batch.set({static_cast<int>(i) - 12, 0, 2}, edits[i]);
    apply(w, batch);
    const Image followed = frame(*raster_, w, camera).image;
    auto fresh = make_raster({.validation = true});
    ASSERT_TRUE(fresh.ok());
    const Image anew = frame(**fresh, w, camera).image;
    EXPECT_EQ(std::memcmp(followed.pixels.data(), anew.pixels.data(), anew.pixels.size() * sizeof(Rgb)), 0) << i;
  }
}

TEST_F(ShapesOfBlocks, AWorldThatLosesItsLastShapeAndGetsOneAgainIsDrawn) {
  world::World w(world::standard_blocks());
  world::EditBatch floor, torch, nothing;
  floor.fill({{-8, -1, -8}, {8, -1, 8}}, block(w, "stone"));
  torch.set({0, 0, 0}, block(w, "torch"));
  nothing.set({0, 0, 0}, world::kAir);
  apply(w, floor);
  const Camera camera = camera_at({}, {0.5, 1.2, 3.5}, {0, -0.3, -1});
  const Image empty = frame(*raster_, w, camera).image;
  apply(w, torch);
  const Image lit = frame(*raster_, w, camera).image;
  EXPECT_NE(std::memcmp(empty.pixels.data(), lit.pixels.data(), lit.pixels.size() * sizeof(Rgb)), 0);
  apply(w, nothing);
  EXPECT_EQ(
      std::memcmp(empty.pixels.data(), frame(*raster_, w, camera).image.pixels.data(), lit.pixels.size() * sizeof(Rgb)),
      0);
  apply(w, torch);
  EXPECT_EQ(
      std::memcmp(lit.pixels.data(), frame(*raster_, w, camera).image.pixels.data(), lit.pixels.size() * sizeof(Rgb)),
      0);
}

TEST_F(ShapesOfBlocks, WhatTouchesACubeOrGoesOnInAShapeIsNotDrawn) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  const world::BlockId slab = shaped(w, "slab_bottom", {0.5f, 0.5f, 0.5f}),
                       fence = shaped(w, "fence", {0.5f, 0.5f, 0.5f});
  batch.set({0, 0, 0}, slab);
  batch.set({0, -1, 0}, block(w, "stone"));
  batch.set({4, 0, 0}, fence);
  batch.set({5, 0, 0}, fence);
  apply(w, batch);
  const world::WorldView view(w);
  ShapeExtractor shapes;
  ASSERT_TRUE(shapes.rebuild(view, ProxyShapes::mesh).ok());
  ASSERT_EQ(shapes.chunks().size(), 1u);
  // The slab without its bottom; two posts, each with two rails that have no end in the side between them.
  EXPECT_EQ(shapes.chunks()[0]->records.size(), 5u + 2 * (6 + 2 * 5));
  EXPECT_EQ(shapes.instances(), 3u);
}

TEST_F(ShapesOfBlocks, AWorldWithoutThemHasNoWorkForThem) {
  const world::World w = hills();
  const world::WorldView view(w);
  ShapeExtractor shapes;
  ASSERT_TRUE(shapes.rebuild(view, ProxyShapes::mesh).ok());
  EXPECT_FALSE(shapes.any());
  EXPECT_EQ(&shapes.cubes_occupied(view), &view.masks(world::MaskKind::occupied));
}

}  // namespace
}  // namespace render
