/// Coarser levels for what is far: close to the picture of voxels, without holes, and the same after edits as afresh.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "render/extract/levels.h"
#include "render/raster/culling.h"
#include "render/raster/raster.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 320, kHeight = 180;

/// Hills of 512 x 512 voxels without an edge in sight: from within, every pixel below the horizon shows ground.
world::World wide_hills() {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  const world::BlockId stone = block(w, "stone"), grass = block(w, "grass");
  for (int x = -256; x < 256; ++x)
    for (int z = -256; z < 256; ++z) {
      const int top = static_cast<int>(20 + 9 * std::sin(x * 0.05) * std::cos(z * 0.043) + 4 * std::sin(z * 0.21));
      batch.fill({{x, 0, z}, {x, top - 1, z}}, stone);
      batch.set({x, top, z}, grass);
    }
  apply(w, batch);
  // A ground that no surface looks like: what a hole shows.
  w.environment.sky_ground = w.environment.sky_horizon = {-1, -1, -1};
  return w;
}

RenderKnobs with_error(float px) {
  RenderKnobs knobs;
  knobs.lod_error_px = px;
  knobs.sun_shadow = SunShadow::none;
  return knobs;
}

Frame frame(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs) {
  const world::WorldView view(w);
  auto drawn = backend.render(view, camera, knobs, kWidth, kHeight);
  EXPECT_TRUE(drawn.ok()) << (drawn.ok() ? "" : drawn.error().message);
  return drawn.ok() ? std::move(*drawn) : Frame{Image(kWidth, kHeight), {}};
}

TEST(Levels, ACellIsSolidWhereHalfOfItIsAndShowsWhatLiesOnTop) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  const world::BlockId stone = block(w, "stone"), grass = block(w, "grass");
  batch.fill({{0, 0, 0}, {15, 0, 15}}, stone);  // half of cells: the lower layer
  batch.fill({{0, 2, 0}, {7, 2, 7}}, stone);    // and one with grass on it
  batch.fill({{0, 3, 0}, {7, 3, 7}}, grass);
  batch.set({12, 5, 12}, stone);  // an eighth
  apply(w, batch);
  CoarseLevels levels;
  levels.rebuild(world::WorldView(w), nullptr, 2, {});
  ASSERT_EQ(levels.level(1).chunks().size(), 1u);
  const ExtractedChunk& chunk = *levels.level(1).chunks()[0];
  uint64_t of_grass = 0, of_stone = 0;
  for (const FaceRecord& r : chunk.of_direction(world::kFacePosY)) {
    const uint64_t area = uint64_t{face_width(r.word0)} * face_height(r.word0);
    (face_block(r.word1) == grass ? of_grass : of_stone) += area;
    EXPECT_EQ(face_voxel(r.word0).y, face_block(r.word1) == grass ? 1u : 0u);
  }
  EXPECT_EQ(of_grass, 16u);
  EXPECT_EQ(of_stone, 64u - 16u);
  // Of the next level each cell is half full.
  uint64_t area = 0;
  for (const FaceRecord& r : levels.level(2).chunks()[0]->of_direction(world::kFacePosY))
    area += uint64_t{face_width(r.word0)} * face_height(r.word0);
  EXPECT_EQ(area, 16u);
}

TEST(HardCaseG9, LevelsShowNoHoleAndLieCloseToTheVoxels) {
  auto raster = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok());
  const world::World w = wide_hills();
  for (const Camera& camera :
       {camera_at({}, {-200.3, 45.2, 3.4}, {1, -0.25, 0.1}), camera_at({}, {0.3, 60.2, 0.4}, {0.6, -0.5, 0.8}),
        camera_at({}, {100.3, 36.7, -120.4}, {-0.7, -0.1, 0.6}, 90)}) {
    const Frame exact = frame(**raster, w, camera, with_error(0));
    const Frame coarse = frame(**raster, w, camera, with_error(1));
    const PixelRays rays(camera, kWidth, kHeight);
    // A hole: nothing where there is ground all around in the picture of voxels.
    const auto nothing = [&](const Image& image, int x, int y) {
      return image.at(std::clamp(x, 0, kWidth - 1), std::clamp(y, 0, kHeight - 1)) == w.environment.sky_ground;
    };
    size_t holes = 0;
    double error = 0, sum = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        bool ground = true;
        for (int i = 0; i < 25; ++i) ground &= !nothing(exact.image, x + i % 5 - 2, y + i / 5 - 2);
        holes += ground && nothing(coarse.image, x, y);
        error += std::abs(double{coarse.image.at(x, y).g} - exact.image.at(x, y).g);
        sum += std::abs(double{exact.image.at(x, y).g});
      }
    std::printf("  %zu holes, mean error %.4f, %llu faces for %llu\n", holes, error / sum,
                static_cast<unsigned long long>(coarse.report.faces_drawn),
                static_cast<unsigned long long>(exact.report.faces_drawn));
    EXPECT_EQ(holes, 0u);
    EXPECT_LT(error / sum, 0.05);
    EXPECT_LT(coarse.report.faces_drawn, exact.report.faces_drawn);
  }
  EXPECT_EQ((*raster)->messages(), std::vector<std::string>{});
}

TEST(Levels, AfterEditsThePictureIsThatOfAFreshBackend) {
  auto followed = make_raster({.validation = true}), fresh = make_raster({.validation = true});
  ASSERT_TRUE(followed.ok() && fresh.ok());
  world::World w = wide_hills();
  const Camera camera = camera_at({}, {-200.3, 45.2, 3.4}, {1, -0.25, 0.1});
  frame(**followed, w, camera, with_error(2));
  world::EditBatch batch;
  batch.fill({{90, 10, -20}, {140, 60, 20}}, block(w, "brick_red"));
  batch.fill({{0, 0, -60}, {30, 40, -30}}, world::kAir);
  apply(w, batch);
  RenderKnobs knobs = with_error(2);
  knobs.sealed_cavities = true;  // an edit may close one
  const Image after = frame(**followed, w, camera, knobs).image, anew = frame(**fresh, w, camera, knobs).image;
  EXPECT_EQ(std::memcmp(after.pixels.data(), anew.pixels.data(), anew.pixels.size() * sizeof(Rgb)), 0);
}

TEST(Levels, ShowNoHoleWhileTheyBlend) {
  const world::World w = wide_hills();
  auto raster = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok());
  for (int step = 0; step < 4; ++step) {
    const Camera camera = camera_at({}, {-150.3 + 20 * step, 300.2, 3.4}, {0.001, -1, 0.001}, 20);
    const Image drawn = frame(**raster, w, camera, with_error(0.5f + static_cast<float>(step))).image;
    EXPECT_EQ(std::count(drawn.pixels.begin(), drawn.pixels.end(), w.environment.sky_ground), 0);
  }
}

TEST(Levels, ThereAndBackThePictureIsTheSame) {
  auto flown = make_raster({.validation = true}), fresh = make_raster({.validation = true});
  ASSERT_TRUE(flown.ok() && fresh.ok());
  world::World w = wide_hills();
  RenderKnobs knobs = with_error(8);  // fine levels reach but a chunk or two
  knobs.sealed_cavities = true;
  const auto eye = [](int step) { return camera_at({}, {-240.3 + 12 * step, 45.2, 3.4}, {1, -0.25, 0.1}); };
  for (int step = 0; step <= 20; ++step) {
    const Camera camera = eye(step <= 10 ? 4 * step : 80 - 4 * step);
    world::EditBatch batch;
    batch.fill({{step * 20 - 200, 12, -8}, {step * 20 - 190, 40, 8}}, block(w, step % 2 ? "brick_red" : "sand"));
    apply(w, batch);
    const Image drawn = frame(**flown, w, camera, knobs).image;
    if (step % 5 != 0) continue;
    fresh = make_raster({.validation = true});
    const Image anew = frame(**fresh, w, camera, knobs).image;
    EXPECT_EQ(std::memcmp(drawn.pixels.data(), anew.pixels.data(), anew.pixels.size() * sizeof(Rgb)), 0) << step;
  }
}

}  // namespace
}  // namespace render
