/// The outline of the picked box: around what of it is seen, and nowhere else.
#include <algorithm>
#include <cstring>
#include <optional>

#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 240, kHeight = 135;

/// A block on a floor, and a post that hides part of it from one side.
world::World block_on_a_floor() {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-20, 0, -20}, {20, 0, 20}}, block(w, "plaster"));
  batch.set({0, 1, 0}, block(w, "brick_red"));
  batch.fill({{-1, 1, -4}, {-1, 6, -4}}, block(w, "stone"));
  apply(w, batch);
  return w;
}

class Outline : public testing::Test {
 protected:
  void SetUp() override { make({}); }
  /// A rasterizer whose device lacks some formats.
  void make(std::vector<VkFormat> without) {
    auto made = make_raster({.validation = true, .without_formats = std::move(without)});
    ASSERT_TRUE(made.ok()) << made.error().message;
    raster_ = std::move(*made);
  }
  void TearDown() override {
    if (raster_) {
      EXPECT_EQ(raster_->messages(), std::vector<std::string>{});
    }
  }
  Frame frame(const Camera& camera, std::optional<raster::Selection> selected, RenderKnobs knobs = {}) {
    raster_->rasterizer().selected = selected;
    auto drawn = raster_->render(world::WorldView(world_), camera, knobs, kWidth, kHeight);
    EXPECT_TRUE(drawn.ok()) << (drawn.ok() ? "" : drawn.error().message);
    return drawn.ok() ? std::move(*drawn) : Frame{Image(kWidth, kHeight), {}};
  }
  world::World world_ = block_on_a_floor();
  std::unique_ptr<RasterBackend> raster_;
};

bool same(const Rgb& a, const Rgb& b) { return a.r == b.r && a.g == b.g && a.b == b.b; }

TEST_F(Outline, LiesAroundTheBlockAndNotOnIt) {
  const raster::Selection block_at_origin{world::WorldPoint::from(0, 1, 0), Vec3d(1), 2};
  const Camera camera = camera_at({}, {3.1, 4.2, 5.3}, {-2.6, -2.7, -4.8}, 40);
  const Image without = frame(camera, {}).image, with = frame(camera, block_at_origin).image;
  // What shows the block: it changes with the block's colour.
  world::EditBatch batch;
  batch.set({0, 1, 0}, block(world_, "oak_log"));
  apply(world_, batch);
  const Image other = frame(camera, {}).image;
  int changed = 0, on_block = 0, of_block = 0;
  const auto shows_block = [&](int x, int y) { return !same(other.at(x, y), without.at(x, y)); };
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      of_block += shows_block(x, y);
      if (same(with.at(x, y), without.at(x, y))) continue;
      ++changed;
      on_block += shows_block(x, y);
      EXPECT_LT(with.at(x, y).g, 0.16f * without.at(x, y).g + 1e-6f);
      bool near = false;
      for (int dy = -4; dy <= 4 && !near; ++dy)
        for (int dx = -4; dx <= 4 && !near; ++dx)
          near = x + dx >= 0 && y + dy >= 0 && x + dx < kWidth && y + dy < kHeight && shows_block(x + dx, y + dy);
      EXPECT_TRUE(near) << x << ' ' << y;
    }
  EXPECT_GT(of_block, 200);
  EXPECT_GT(changed, 80) << "a line of two pixels around it";
  EXPECT_LE(on_block, of_block / 50) << "but for the two millimetres that the box stands out";
}

TEST_F(Outline, IsHiddenByWhatStandsBefore) {
  const raster::Selection block_at_origin{world::WorldPoint::from(0, 1, 0), Vec3d(1), 2};
  const Camera camera = camera_at({}, {-0.6, 1.9, -8.1}, {0.08, -0.05, 1}, 40);  // past the post
  const Image without = frame(camera, {}).image, with = frame(camera, block_at_origin).image;
  world::EditBatch batch;
  batch.fill({{-1, 1, -4}, {-1, 6, -4}}, block(world_, "oak_log"));
  apply(world_, batch);
  const Image other = frame(camera, {}).image;
  int on_post = 0, elsewhere = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (!same(with.at(x, y), without.at(x, y))) (same(other.at(x, y), without.at(x, y)) ? elsewhere : on_post)++;
  EXPECT_GT(elsewhere, 20);
  EXPECT_EQ(on_post, 0);
  EXPECT_EQ(std::memcmp(frame(camera_at({}, {0.5, 0.5, 0.5}, {0, 0.1, 1}), block_at_origin).image.pixels.data(),
                        frame(camera_at({}, {0.5, 0.5, 0.5}, {0, 0.1, 1}), {}).image.pixels.data(), 64),
            0)
      << "from within the floor";
}

TEST_F(Outline, IsTheSameInAnyFormatOfTheStencilThatADeviceHas) {
  const raster::Selection block_at_origin{world::WorldPoint::from(0, 1, 0), Vec3d(1), 2};
  const Camera camera = camera_at({}, {3.1, 4.2, 5.3}, {-2.6, -2.7, -4.8}, 40);
  const Image usual = frame(camera, block_at_origin).image;
  std::vector<VkFormat> without;
  for (const VkFormat next : {VK_FORMAT_S8_UINT, VK_FORMAT_D24_UNORM_S8_UINT}) {
    without.push_back(next);
    make(without);
    const Image other = frame(camera, block_at_origin).image;
    EXPECT_TRUE(std::equal(usual.pixels.begin(), usual.pixels.end(), other.pixels.begin(), same)) << next;
    EXPECT_EQ(raster_->messages(), std::vector<std::string>{});
  }
}

TEST_F(Outline, CostsNothingWhereNothingIsPicked) {
  const Camera camera = camera_at({}, {3.1, 4.2, 5.3}, {-2.6, -2.7, -4.8}, 40);
  const auto rows = [](const Frame& f) {
    return std::count_if(f.report.passes.begin(), f.report.passes.end(),
                         [](const PassReport& row) { return row.name == "outline"; });
  };
  EXPECT_EQ(rows(frame(camera, {})), 0);
  EXPECT_EQ(rows(frame(camera, raster::Selection{world::WorldPoint::from(0, 1, 0), Vec3d(1), 2})), 1);
  EXPECT_EQ(rows(frame(camera, {})), 0);
}

}  // namespace
}  // namespace render
