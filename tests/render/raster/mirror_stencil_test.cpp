/// Pictures in a mirror are shaded where the stencil says that the mirror is, and nothing is missing.
#include <cstring>

#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 320, kHeight = 180;

/// Hills with a lake, and upright mirrors of two axes.
world::World lake_and_mirrors() {
  world::World w = hills();
  world::EditBatch batch;
  batch.fill({{10, 20, 20}, {30, 34, 20}}, block(w, "mercury"));
  batch.fill({{-40, 20, -30}, {-40, 33, -9}}, block(w, "mercury"));
  apply(w, batch);
  return w;
}

std::vector<NamedCamera> cameras() {
  return {{"the lake", camera_at({}, {-60.3, 40.2, 60.7}, {0.6, -0.5, -0.7})},
          {"a mirror along x", camera_at({}, {14.3, 27.4, 50.2}, {0.1, -0.05, -1})},
          {"a mirror along z", camera_at({}, {-15.3, 26.2, -16.4}, {-1, 0.02, -0.1})},
          {"close by, at a slant", camera_at({}, {11.3, 24.4, 22.1}, {0.7, 0.1, -0.5})}};
}

TEST(MirrorStencil, LeavesOutNothingThatIsSeen) {
  auto raster = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok()) << raster.error().message;
  world::World w = lake_and_mirrors();
  RenderKnobs knobs;
  knobs.reflection = Reflection::planar;
  size_t with = 0;
  const auto expect_equal = [&](const NamedCamera& view, const char* when) {
    Image images[2];
    for (const bool whole : {false, true}) {
      (*raster)->rasterizer().whole_mirror = whole;
      auto frame = (*raster)->render(world::WorldView(w), view.camera, knobs, kWidth, kHeight);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      for (const PassReport& row : frame->report.passes) with += !whole && row.name == "mirror_stencil";
      images[whole] = std::move(frame->image);
    }
    EXPECT_EQ(0, std::memcmp(images[0].pixels.data(), images[1].pixels.data(),
                             images[0].pixels.size() * sizeof(images[0].pixels[0])))
        << view.name << when;
  };
  for (const NamedCamera& view : cameras()) expect_equal(view, "");
  EXPECT_EQ(with, cameras().size()) << "each camera sees a mirror";
  world::EditBatch batch;
  batch.fill({{31, 20, 20}, {50, 40, 20}}, block(w, "mercury"));
  apply(w, batch);
  expect_equal(cameras()[1], ", after an edit");
  EXPECT_EQ((*raster)->messages(), std::vector<std::string>{});
}

TEST(MirrorStencil, IsThereOnlyWhereAPictureIsTakenFromBehindAMirror) {
  auto raster = make_raster({});
  ASSERT_TRUE(raster.ok()) << raster.error().message;
  const world::World w = lake_and_mirrors();
  for (const Reflection reflection : {Reflection::none, Reflection::screen}) {
    RenderKnobs knobs;
    knobs.reflection = reflection;
    auto frame = (*raster)->render(world::WorldView(w), cameras()[0].camera, knobs, 64, 36);
    ASSERT_TRUE(frame.ok());
    for (const PassReport& row : frame->report.passes) EXPECT_NE(row.name, "mirror_stencil");
  }
}

}  // namespace
}  // namespace render
