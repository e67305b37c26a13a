// Presets are a ladder: a dearer one is no further from the truth.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "render/image/display.h"
#include "render/image/error_metrics.h"
#include "tools/light.h"
#include "tools/picture.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

render::Image drawn(render::Backend& backend, const world::World& world, const render::RenderKnobs& knobs) {
  const world::WorldView view(world);
  const auto placement = world::camera_of(world, "");
  EXPECT_TRUE(placement.ok());
  const render::Camera camera = render::Camera::from(*placement);
  LightOfWorld light;
  if (backend.reads_light(world, knobs)) {
    const auto made = light.follow(world, camera.position, knobs);
    EXPECT_TRUE(made.ok());
    backend.light = *made;
  }
  auto frame = backend.render(view, camera, knobs, 48, 32);
  EXPECT_TRUE(frame.ok());
  return frame.ok() ? std::move(frame->image) : render::Image(48, 32);
}

struct RungError {
  double flip = 0, mse = 0;
};

/// Rungs that lie further off than the one before. Edges of pixels are all that is left between the dear ones; a rung
/// may not undo another by more than a hundredth of that.
size_t steps_back(const std::vector<RungError>& rungs) {
  size_t count = 0;
  for (size_t i = 1; i < rungs.size(); ++i)
    count += rungs[i].flip > 1.01 * rungs[i - 1].flip || rungs[i].mse > 1.01 * rungs[i - 1].mse;
  return count;
}

}  // namespace

TEST(Presets, ADearerOneIsNoFurtherFromTheReference) {
  for (const char* name : {"valley", "cave", "cube"}) {
    auto scene = world::load_scene(name);
    ASSERT_TRUE(scene.ok());
    if (scene->name == "valley") scene->box = {{128, 0, -256}, {255, 255, -129}}, scene->cameras.clear();
    world::ImportReport report;
    const auto world = build_picture_world(*scene, report);
    ASSERT_TRUE(world.ok());
    const auto backend = make_backend("raycast");
    ASSERT_TRUE(backend.ok());
    render::RenderKnobs best = render::render_knobs().preset(world::Accuracy::exact);
    best.spp = 4;  // a box over each pixel
    const render::Image truth = drawn(**backend, *world, best);
    std::vector<RungError> rungs;
    for (const world::Accuracy accuracy : {world::Accuracy::fast, world::Accuracy::usual, world::Accuracy::exact}) {
      const auto compared =
          render::compare_images(drawn(**backend, *world, render::render_knobs().preset(accuracy)), truth);
      rungs.push_back({compared.metrics.flip, compared.metrics.mse});
    }
    EXPECT_EQ(steps_back(rungs), 0u) << name << ": FLIP " << rungs[0].flip << ", " << rungs[1].flip << ", "
                                     << rungs[2].flip;
    std::reverse(rungs.begin(), rungs.end());
    if (scene->name == "valley") {
      EXPECT_GT(steps_back(rungs), 0u) << "control: a ladder upside down is found";
    }
  }
}

}  // namespace tools
