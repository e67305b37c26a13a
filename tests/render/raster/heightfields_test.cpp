/// Grids of heights for land that is far: as near to where faces are as the knob says, without holes, up to date, and
/// absent where the knob is 0.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/far_pictures.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 320, kHeight = 180;

/// Hills of 768 x 768 voxels without an edge in sight, in stripes of two blocks, a few posts and a pit on them.
world::World wide_hills(world::VoxelPos offset = {}) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  const world::BlockId stone = block(w, "stone"), grass = block(w, "grass"), sand = block(w, "sand");
  for (int x = -384; x < 384; ++x)
    for (int z = -384; z < 384; ++z) {
      const int top = static_cast<int>(50 + 22 * std::sin(x * 0.021) * std::cos(z * 0.017) + 9 * std::sin(z * 0.05));
      batch.fill(box_at(offset, {x, 0, z}, {x, top - 1, z}), stone);
      batch.set(offset + world::VoxelPos{x, top, z}, (x >> 4 ^ z >> 4) & 1 ? grass : sand);
    }
  batch.fill(box_at(offset, {40, 20, 100}, {44, 120, 104}), block(w, "brick_red"));
  batch.fill(box_at(offset, {90, 10, -60}, {99, 120, -50}), world::kAir);
  apply(w, batch);
  // A ground that no surface looks like: what a hole shows.
  w.environment.sky_ground = w.environment.sky_horizon = {-1, -1, -1};
  return w;
}

RenderKnobs with_grids(float error_px) {
  RenderKnobs knobs;
  knobs.heightfield_error_px = error_px;
  knobs.lod_error_px = 1;
  knobs.sun_shadow = SunShadow::none;
  knobs.textures = TextureFilter::off;
  knobs.transparency = Transparency::opaque;
  return knobs;
}

Frame frame(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs, int scale = 1) {
  return draw(backend, w, camera, knobs, scale * kWidth, scale * kHeight);
}

/// Once its surfaces are made.
Frame settled_frame(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs) {
  for (int i = 0; i < 12 && work(frame(backend, w, camera, knobs), "heightfields_made") + (i == 0) > 0; ++i) continue;
  return frame(backend, w, camera, knobs);
}

Camera over_the_hills(Vec3d moved = {}, world::VoxelPos offset = {}) {
  return camera_at(offset, Vec3d(-330.3, 110.2, 3.4) + moved, {1, -0.2, 0.1});
}

TEST(Heightfields, ShowNothingFartherThanTheKnobFromTheFacesAndNoHole) {
  auto raster = make_raster({.validation = true}), exact = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok() && exact.ok());
  const world::World w = wide_hills();
  for (const Camera& camera : {over_the_hills(), camera_at({}, {0.3, 180.2, -330.4}, {0.3, -0.4, 0.8}),
                               camera_at({}, {300.3, 96.7, -120.4}, {-0.9, -0.15, 0.3}, 90)}) {
    RenderKnobs coarse = with_grids(0);
    coarse.lod_error_px *= 3;  // the same levels in a picture three times as large
    const Frame large = frame(**exact, w, camera, coarse, 3), faces = frame(**exact, w, camera, with_grids(0));
    for (const float knob : {2.0f, 4.0f, 8.0f}) {
      const Frame drawn = settled_frame(**raster, w, camera, with_grids(knob));
      // To the corners of the picture up to twice as much; and the middle of a third of a pixel.
      const size_t wrong = misplaced(drawn.image, large.image, 2 * double{knob} + 0.25),
                   of_faces = misplaced(faces.image, large.image, 2 * double{knob} + 0.25);
      std::printf("  %.0f px: %zu and %zu pixels; %llu grids of %llu triangles for %llu faces\n", double{knob}, wrong,
                  of_faces, static_cast<unsigned long long>(work(drawn, "heightfields")),
                  static_cast<unsigned long long>(work(drawn, "heightfield_triangles")),
                  static_cast<unsigned long long>(work(drawn, "faces_in_heightfields")));
      EXPECT_GT(work(drawn, "heightfields"), 3u);
      EXPECT_LE(wrong, of_faces + drawn.image.pixels.size() / 1000);
      EXPECT_EQ(holes(w.environment.sky_ground, drawn.image, faces.image, static_cast<int>(std::ceil(2 * knob))), 0u);
    }
  }
  EXPECT_EQ((*raster)->messages(), std::vector<std::string>{});
}

TEST(Heightfields, ShowNoHoleBetweenStepsAndLevelsOnTheWay) {
  auto raster = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok());
  const world::World w = wide_hills();
  for (int step = 0; step < 8; ++step) {
    // Straight down, where any gap shows the ground below; and while levels blend.
    const Camera camera = camera_at({}, {-150.3 + 25 * step, 420.2 + 11 * step, 3.4}, {0.001, -1, 0.001}, 35);
    const Frame drawn = settled_frame(**raster, w, camera, with_grids(static_cast<float>(3 + step % 4)));
    EXPECT_GT(work(drawn, "heightfields"), 0u);
    EXPECT_EQ(std::count(drawn.image.pixels.begin(), drawn.image.pixels.end(), w.environment.sky_ground), 0);
  }
}

TEST(Heightfields, FollowEditsAndMakeAnewOnlyWhatTheyTouch) {
  auto raster = make_raster({.validation = true}), fresh = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok() && fresh.ok());
  world::World w = wide_hills();
  const Camera camera = over_the_hills();
  RenderKnobs knobs = with_grids(2);
  knobs.sealed_cavities = true;  // an edit may close one
  const Frame before = settled_frame(**raster, w, camera, knobs);
  ASSERT_GT(work(before, "heightfields"), 3u);
  world::EditBatch batch;
  batch.fill({{70, 60, 10}, {90, 62, 30}}, block(w, "brick_red"));
  batch.fill({{-20, 20, -90}, {20, 90, -70}}, world::kAir);
  apply(w, batch);
  const Frame after = frame(**raster, w, camera, knobs);
  EXPECT_GT(work(after, "heightfields_made"), 0u);
  EXPECT_LE(work(after, "heightfields_made"), 16u);  // of four levels, two places each, and what is beside them
  EXPECT_FALSE(same(after.image, before.image));
  EXPECT_TRUE(same(after.image, settled_frame(**fresh, w, camera, knobs).image));
  EXPECT_EQ(work(frame(**raster, w, camera, knobs), "heightfields_made"), 0u);
}

TEST(Heightfields, AreTheSameFarFromTheOrigin) {
  const world::VoxelPos far{1 << 29, 0, -(1 << 29)};
  auto one = make_raster({.validation = true}), other = make_raster({.validation = true});
  ASSERT_TRUE(one.ok() && other.ok());
  const Frame here = settled_frame(**one, wide_hills(), over_the_hills(), with_grids(2));
  const Frame there = settled_frame(**other, wide_hills(far), over_the_hills({}, far), with_grids(2));
  EXPECT_GT(work(here, "heightfields"), 3u);
  EXPECT_TRUE(same(here.image, there.image));
}

TEST(Heightfields, AreAbsentWhereTheKnobIsZeroAndGiveTheirMemoryBack) {
  auto raster = make_raster({.validation = true}), fresh = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok() && fresh.ok());
  const world::World w = wide_hills();
  const Camera camera = over_the_hills();
  const Frame faces = frame(**fresh, w, camera, with_grids(0));
  for (int i = 0; i < 3; ++i) frame(**raster, w, camera, with_grids(0));
  const uint64_t without_grids = (*raster)->rasterizer().device().memory().bytes_used();
  const Frame with = settled_frame(**raster, w, camera, with_grids(2));
  EXPECT_TRUE(has_row(with, "heightfields"));
  EXPECT_GT(work(with, "faces_in_heightfields"), 0u);
  EXPECT_LT(work(with, "heightfield_triangles"), work(with, "faces_in_heightfields"));
  EXPECT_GT((*raster)->rasterizer().device().memory().bytes_used(), without_grids);
  frame(**raster, w, camera, with_grids(0));
  const Frame without = frame(**raster, w, camera, with_grids(0));
  EXPECT_FALSE(has_row(without, "heightfields"));
  for (const char* name : {"heightfields", "heightfield_triangles", "heightfields_made", "faces_in_heightfields"})
    EXPECT_EQ(work(without, name), 0u);
  EXPECT_TRUE(same(without.image, faces.image));
  EXPECT_LE((*raster)->rasterizer().device().memory().bytes_used(), without_grids);
}

}  // namespace
}  // namespace render
