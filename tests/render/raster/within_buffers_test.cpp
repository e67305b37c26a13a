/// Hard case R15: that robust access hides no read or write beyond a buffer's end.
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "tests/render/gpu/gpu_assisted.h"
#include "tests/render/raster/compare_pictures.h"
#include "world/scenes/scene.h"

namespace render {
namespace {

/// Scenes that have most of what the rasterizer draws; all of them, some minutes, where LOAM_GPU_ASSISTED is set.
std::vector<std::string> asked_scenes() {
  return std::getenv("LOAM_GPU_ASSISTED") ? world::scene_names() : std::vector<std::string>{"valley", "far_lands"};
}

TEST(HardCaseR15, PicturesStayWithinTheirBuffers) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "shaders that check themselves take minutes with sanitizers, which don't see into them";
#endif
  const GpuAssisted assisted;
  for (const std::string& name : asked_scenes()) {
    auto scene = world::load_scene(name);
    ASSERT_TRUE(scene.ok()) << scene.error().message;
    world::ImportReport report;
    const auto w = world::build_world(*scene, report);
    ASSERT_TRUE(w.ok()) << w.error().message;
    auto made = make_raster({.validation = true});
    ASSERT_TRUE(made.ok()) << made.error().message;
    const Camera camera = w->cameras.empty() ? Camera{} : Camera::from(w->cameras[0]);
    // No tile divides it. The first tells what the second draws before it looks for more.
    for (int picture = 0; picture < 2; ++picture) draw(**made, *w, camera, {}, 163, 91);
    EXPECT_EQ((*made)->messages(), std::vector<std::string>{}) << name;
  }
}

}  // namespace
}  // namespace render
