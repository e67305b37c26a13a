/// What no backend draws.
#include <gtest/gtest.h>

#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

class BadBlocks : public BothBackends {};

TEST_F(BadBlocks, WithAnUnknownBsdfAreAnErrorOfBothBackends) {
  world::World w;
  world::Block chrome;
  chrome.name = "chrome";
  chrome.bsdf = "blin_phong";
  ASSERT_TRUE(w.palette->add(chrome).ok());
  const world::WorldView view(w);
  for (Backend* backend : {static_cast<Backend*>(raster_.get()), raycast_.get()}) {
    const auto drawn = backend->render(view, camera_at({}, {0, 0, 0}, {1, 0, 0}), {}, 16, 16);
    ASSERT_FALSE(drawn.ok());
    EXPECT_EQ(drawn.error().message, "block 'chrome': there is no bsdf 'blin_phong'; the nearest is 'blinn_phong'");
  }
}

}  // namespace
}  // namespace render
