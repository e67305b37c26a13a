/// The two backends draw the same picture: the bar of the project (hard case R5).
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "render/image/display.h"
#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 1280, kHeight = 720;

struct Agreement {
  double fraction = 0;  // of pixels whose channels all differ by at most 1/255
  int worst = 0;        // of 255
  size_t differing = 0;
  size_t unexplained = 0;  // differing pixels with nothing but their own colour around them in both pictures
};

Agreement compare(const Image& a, const Image& b) {
  const Image8 x = display_image(a, 0), y = display_image(b, 0);
  Agreement result;
  std::vector<bool> differs(x.pixels.size() / 3);
  size_t same = 0;
  for (size_t i = 0; i < differs.size(); ++i) {
    int worst = 0;
    for (size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(x.pixels[3 * i + c] - y.pixels[3 * i + c]));
    differs[i] = worst > 1;
    same += worst <= 1;
    result.worst = std::max(result.worst, worst);
  }
  result.fraction = static_cast<double>(same) / static_cast<double>(differs.size());
  const auto flat = [&](const Image8& image, int px, int py) {
    const auto* centre = &image.pixels[3 * static_cast<size_t>(py * image.width + px)];
    for (int qy = std::max(py - 1, 0); qy <= std::min(py + 1, image.height - 1); ++qy)
      for (int qx = std::max(px - 1, 0); qx <= std::min(px + 1, image.width - 1); ++qx)
        if (std::memcmp(centre, &image.pixels[3 * static_cast<size_t>(qy * image.width + qx)], 3) != 0) return false;
    return true;
  };
  for (size_t i = 0; i < differs.size(); ++i) {
    if (!differs[i]) continue;
    ++result.differing;
    const int px = static_cast<int>(i) % a.width, py = static_cast<int>(i) / a.width;
    result.unexplained += flat(x, px, py) && flat(y, px, py);
  }
  return result;
}

class BackendsAgree : public BothBackends {
 protected:
  void expect_agreement(const world::World& w, const std::string& scene, const NamedCamera& view,
                        const RenderKnobs& knobs = {}) {
    const world::WorldView world_view(w);
    auto drawn = raster_->render(world_view, view.camera, knobs, kWidth, kHeight);
    ASSERT_TRUE(drawn.ok()) << drawn.error().message;
    auto cast = raycast_->render(world_view, view.camera, knobs, kWidth, kHeight);
    ASSERT_TRUE(cast.ok()) << cast.error().message;
    const Agreement agreement = compare(drawn->image, cast->image);
    std::printf("%-24s %-18s %.4f %% agree, worst difference %d, %zu pixels differ\n", scene.c_str(), view.name.c_str(),
                100 * agreement.fraction, agreement.worst, agreement.differing);
    EXPECT_GE(agreement.fraction, 0.9995) << scene << ", " << view.name;
    // Hard case R5: what differs lies on an edge between faces or of a shadow, where the ray in float passes on the
    // other side of it than the ray in double.
    EXPECT_EQ(agreement.unexplained, 0u) << scene << ", " << view.name;
  }
};

constexpr world::VoxelPos kFar{10'000'000, 0, -10'000'000};

TEST_F(BackendsAgree, OnHills) {
  const world::World w = hills();
  for (const NamedCamera& view : hill_cameras()) expect_agreement(w, "hills", view);
}

TEST_F(BackendsAgree, OnHillsTenThousandKilometresFromTheOrigin) {
  const world::World w = hills(kFar);
  for (const size_t i : {0u, 2u}) expect_agreement(w, "hills far out", hill_cameras(kFar)[i]);
}

TEST_F(BackendsAgree, OnHillsWithinAViewDistance) {
  const world::World w = hills();
  RenderKnobs knobs;
  knobs.view_distance = 60;
  expect_agreement(w, "hills, 60 m", hill_cameras()[1], knobs);
}

TEST_F(BackendsAgree, OnHillsWithUnmergedFaces) {
  const world::World w = hills();
  RenderKnobs knobs;
  knobs.merge_faces = false;
  knobs.sealed_cavities = true;
  expect_agreement(w, "hills, unmerged", hill_cameras()[2], knobs);
}

TEST_F(BackendsAgree, OnDust) {
  const world::World w = dust();
  expect_agreement(w, "dust", {"inside", camera_at({}, {0.2, 0.4, 0.3}, {0.5, 0.3, -0.8})});
  expect_agreement(w, "dust", {"outside", camera_at({}, {90.2, 60.4, 100.3}, {-0.8, -0.5, -0.9})});
}

TEST_F(BackendsAgree, InARoomWithTheEyeAgainstTheWall) {
  const world::World w = room();
  for (const double gap : {1e-2, 1e-5, 1e-9, 0.0})
    expect_agreement(w, "room", {fmt::format("gap {}", gap), camera_at({}, {6.5, 2.5, gap}, {1, -0.1, 0.2}, 90)});
  expect_agreement(w, "room",
                   {"a hair below 12", camera_at({}, {6.5, 2.5, std::nextafter(12.0, 0.0)}, {1, 0, 0.2}, 90)});
}

TEST_F(BackendsAgree, FromInsideABlock) {
  const world::World w = hills();
  // From within what is opaque there is no first see-through block, and layers are left out.
  RenderKnobs opaque;
  opaque.transparency = Transparency::opaque;
  expect_agreement(w, "hills", {"inside stone", camera_at({}, {10.5, 2.5, 20.5}, {0.3, 0.2, -1})}, opaque);
  expect_agreement(w, "hills", {"inside glass", camera_at({}, {-29.5, 20.5, 20.5}, {1, -0.3, -0.2})});
}

TEST_F(BackendsAgree, ThatABlockWithAnUnknownBsdfIsAnError) {
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
