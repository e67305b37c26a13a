// Meshes of the rasterizer: where they call for a pass, and what it can't hold. That they look as the ray caster has
// them is claimed in tests/tools/agreement/rows.cpp.
#include <algorithm>

#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "render/raster/triangles.h"
#include "tests/render/raster/small_meshes.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

using world::MeshInstance;
using world::World;

constexpr int kWidth = 320, kHeight = 180;

RasterBackend& raster() {
  static const std::unique_ptr<RasterBackend> backend = [] {
    auto made = make_raster({.validation = true});
    CHECK(made.ok());
    return std::move(*made);
  }();
  return *backend;
}

Frame drawn(Backend& backend, const World& w, const Camera& camera, const RenderKnobs& knobs) {
  auto frame = backend.render(world::WorldView(w), camera, knobs, kWidth, kHeight);
  if (!frame.ok()) ADD_FAILURE() << frame.error().message;
  return frame.ok() ? std::move(*frame) : Frame{Image(kWidth, kHeight), {}};
}

TEST(RasterMeshes, AreTheSameTenThousandKilometresFromTheOrigin) {
  constexpr world::VoxelPos kFar{10'000'000, 0, -10'000'000};
  World w = dry_hills(kFar), here = dry_hills();
  w.meshes = meshes_of_each_kind(w, kFar);
  here.meshes = meshes_of_each_kind(here);
  EXPECT_EQ(drawn(raster(), w, over_the_hills(kFar), {}).image.pixels,
            drawn(raster(), here, over_the_hills(), {}).image.pixels);
}

TEST(RasterMeshes, CallForAPassOnlyWhereTheWorldHasSome) {
  World w = dry_hills();
  const auto passes = [&] {
    std::vector<std::string> names;
    for (const PassReport& p : drawn(raster(), w, over_the_hills(), {}).report.passes) names.push_back(p.name);
    return names;
  };
  w.meshes = meshes_of_each_kind(w);
  const std::vector<std::string> with = passes();
  EXPECT_EQ(std::count(with.begin(), with.end(), "meshes"), 1);
  EXPECT_GT(raster().rasterizer().triangles().bytes(), 0u);
  // A null surface is drawn by nothing.
  w.meshes = {w.meshes.back()};
  const std::vector<std::string> null = passes();
  EXPECT_EQ(std::count(null.begin(), null.end(), "meshes"), 0);
  w.meshes.clear();
  const std::vector<std::string> without = passes();
  EXPECT_EQ(std::count(without.begin(), without.end(), "meshes"), 0);
  EXPECT_EQ(raster().rasterizer().triangles().bytes(), 0u);
}

TEST(RasterMeshes, ThatABufferCannotHoldAreLeftOutAndNamed) {
  World w = dry_hills();
  w.meshes = meshes_of_each_kind(w);
  auto small = make_raster({.validation = true});
  ASSERT_TRUE(small.ok());
  raster::TriangleList list;
  ASSERT_TRUE(raster::add_meshes(w, list).ok());
  raster::DrawnTriangles triangles;
  triangles.binding_limit = 4096;
  const auto sent = triangles.set((*small)->rasterizer().device(), list, "meshes");
  ASSERT_TRUE(sent.ok());
  EXPECT_EQ(*sent, 0u);
  EXPECT_TRUE(triangles.empty());
  ASSERT_EQ(triangles.dropped().size(), 1u);
  EXPECT_NE(triangles.dropped()[0].find("meshes"), std::string::npos);
}

TEST(RasterMeshes, AtTheWorldsBorderAreAnError) {
  World w = dry_hills();
  w.meshes = {instance(w, sheet(50), "marble", {}, {0, 0, 0})};
  w.meshes[0].position.voxel.x = static_cast<int32_t>(world::kWorldBorder) - 2;
  raster::TriangleList list;
  const world::Status status = raster::add_meshes(w, list);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("reaches outside the world"), std::string::npos);
}

}  // namespace
}  // namespace render
