/// Two rasterizers: one that draws faces of cubes, small shapes and layers by dispatches where the device does that
/// faster, and one that draws all by pipelines.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "tests/render/raster/compare_pictures.h"

namespace render {

class ListsAndDraws : public testing::Test {
 protected:
  void SetUp() override {
    for (auto* backend : {&lists_, &draws_}) {
      auto made = make_raster({.validation = true});
      ASSERT_TRUE(made.ok()) << made.error().message;
      *backend = std::move(*made);
    }
    draws_->rasterizer().may_list_faces = false;
    if (!lists_->rasterizer().device().is_processor()) GTEST_SKIP() << "this device draws all by pipelines";
  }
  void TearDown() override {
    for (const auto* backend : {&lists_, &draws_})
      if (*backend) {
        EXPECT_EQ((*backend)->messages(), std::vector<std::string>{});
      }
  }
  /// Twice, as what the first picture saw tells how the second is drawn. counted: the work that the first rasterizer
  /// does by lists, and the second doesn't.
  void expect_equal(const world::World& w, const Camera& camera, const RenderKnobs& of_lists,
                    const RenderKnobs& of_draws, int width, int height, const char* counted, const std::string& what) {
    for (int picture = 0; picture < 2; ++picture) {
      const Frame listed = draw(*lists_, w, camera, of_lists, width, height);
      const Frame drawn = draw(*draws_, w, camera, of_draws, width, height);
      EXPECT_GT(work(listed, counted), 0u) << what;
      EXPECT_EQ(work(drawn, counted), 0u) << what;
      EXPECT_TRUE(same(listed.image, drawn.image)) << what << ", picture " << picture;
    }
  }

  std::unique_ptr<RasterBackend> lists_, draws_;
};

}  // namespace render
