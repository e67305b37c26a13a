/// Blocks with a shape of their own (world/proxies), drawn: as points as faces, after edits as afresh. That they look
/// as the ray caster has them is claimed in tests/tools/agreement/rows.cpp.
#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>

#include "render/extract/proxies.h"
#include "render/image/display.h"
#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/shape_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 480, kHeight = 270;

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
