/// The rasterizer, with Vulkan's validation on and silent at the end, and the ray caster, for tests that compare them.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "render/raycast/raycast.h"

namespace render {

class BothBackends : public testing::Test {
 protected:
  void SetUp() override {
    auto made = make_raster({.validation = true});
    ASSERT_TRUE(made.ok()) << made.error().message;
    raster_ = std::move(*made);
    auto cast = make_raycast_backend();
    ASSERT_TRUE(cast.ok()) << cast.error().message;
    raycast_ = std::move(*cast);
  }
  void TearDown() override {
    if (raster_) {
      EXPECT_EQ(raster_->messages(), std::vector<std::string>{});
    }
  }

  std::unique_ptr<RasterBackend> raster_;
  std::unique_ptr<Backend> raycast_;
};

}  // namespace render
