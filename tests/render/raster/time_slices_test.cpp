// Passes over a picture in pieces that a GPU can stop between: hard case R10. That every loop of a shader ends is
// claimed in tests/render/shaders_test.cpp.
#include <functional>
#include <memory>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "render/gpu/time_slices.h"
#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/shape_worlds.h"
#include "tests/render/raster/small_meshes.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 320, kHeight = 180;

/// Of all passes of the last picture.
uint64_t count(const gpu::TimeSlices& slices) {
  const auto uses = slices.uses();
  return std::accumulate(uses.begin(), uses.end(), uint64_t{0},
                         [](uint64_t sum, const gpu::TimeSlices::Use& use) { return sum + use.slices; });
}

/// Up to groups of which each pixel takes a thousand million steps of 10 ns.
TEST(HardCaseR10, ASliceIsForeseenToTakeLessThan50MsOrIsAGroup) {
  for (const uint64_t groups : {1ull, 7ull, 64ull, 14'400ull, 4'194'304ull, 1ull << 40})
    for (double group_ms = 1e-9; group_ms <= 1e4 * 64; group_ms *= 1.7) {
      const uint64_t of_slice = gpu::groups_of_slice(groups, group_ms);
      ASSERT_GE(of_slice, 1u);
      ASSERT_LE(of_slice, groups);
      if (of_slice > 1) {
        EXPECT_LE(static_cast<double>(of_slice) * group_ms, gpu::kSliceAimMs) << groups << ", " << group_ms;
      }
      const bool is_short = static_cast<double>(groups) * group_ms <= gpu::kSliceAimMs;
      EXPECT_EQ(of_slice == groups, is_short || groups == 1) << groups << ", " << group_ms;
    }
}

struct Asked {
  const char* name;
  std::function<world::World()> world;
  Camera camera;
  RenderKnobs knobs;
};

/// Between them of all passes that are cut, but the one that makes impostors.
std::vector<Asked> pictures() {
  std::vector<Asked> all;
  const Camera overview = hill_cameras()[0].camera;
  RenderKnobs knobs;
  knobs.transparency = Transparency::lists;
  all.push_back({"lists of tiles", [] { return hills(); }, overview, knobs});
  knobs.reflection = Reflection::planar;
  all.push_back({"all tiles, and a mirror's picture", mirror, kMirrorViews[0].camera, knobs});
  knobs = {};
  knobs.transparency = Transparency::weighted;
  all.push_back({"weighted layers", [] { return hills(); }, overview, knobs});
  knobs.transparency = Transparency::sorted;
  all.push_back({"sorted layers", [] { return hills(); }, overview, knobs});
  const auto meshes = [] {
    world::World w = dry_hills();
    w.meshes = meshes_of_each_kind(w);
    return w;
  };
  all.push_back({"pixels put off", meshes, over_the_hills(), {}});
  knobs = {};
  knobs.anti_aliasing = AntiAliasing::x2;
  knobs.exposure_mode = ExposureMode::histogram;
  knobs.bloom = 0.2f, knobs.bloom_threshold = 0.2f;
  all.push_back({"effects", [] { return hills(); }, overview, knobs});
  return all;
}

std::unique_ptr<RasterBackend> checked_raster() {
  auto made = make_raster({.validation = true});
  CHECK(made.ok());
  return std::move(*made);
}

TEST(HardCaseR10, AnyNumberOfSlicesMakesTheSamePicture) {
  const auto raster = checked_raster();
  gpu::TimeSlices& slices = raster->rasterizer().slices();
  for (const Asked& asked : pictures()) {
    SCOPED_TRACE(asked.name);
    const world::World w = asked.world();
    // What a slice leaves out would show the last picture, so that is another one.
    Camera elsewhere = asked.camera;
    elsewhere.forward = -elsewhere.forward;
    const auto drawn = [&](uint64_t into) {
      slices.forced = 1;
      (void)draw(*raster, w, elsewhere, asked.knobs, kWidth, kHeight);
      slices.forced = into;
      return draw(*raster, w, asked.camera, asked.knobs, kWidth, kHeight).image;
    };
    const Image whole = drawn(1);
    const size_t uses = slices.uses().size();
    EXPECT_EQ(count(slices), uses);
    for (const uint64_t into : {3, 500}) {
      EXPECT_TRUE(same(whole, drawn(into))) << into << " slices";
      EXPECT_EQ(slices.uses().size(), uses);
      EXPECT_GT(count(slices), 2 * uses);
    }
  }
  EXPECT_EQ(raster->messages(), std::vector<std::string>{});
}

/// Each is mixed with those before it.
TEST(HardCaseR10, AnyNumberOfSlicesMakesTheSamePicturesInTime) {
  const world::World w = hills();
  RenderKnobs knobs;
  knobs.anti_aliasing = AntiAliasing::temporal;
  const auto whole = checked_raster(), cut = checked_raster();
  whole->rasterizer().slices().forced = 1, cut->rasterizer().slices().forced = 7;
  for (int picture = 0; picture < 3; ++picture)
    EXPECT_TRUE(same(draw(*whole, w, hill_cameras()[0].camera, knobs, kWidth, kHeight).image,
                     draw(*cut, w, hill_cameras()[0].camera, knobs, kWidth, kHeight).image))
        << picture;
  EXPECT_EQ(cut->messages(), std::vector<std::string>{});
}

/// Of layers that something hides nothing is listed: so their resolve takes no time, and tells none of a group.
TEST(HardCaseR10, AListThatCameToBeEmptyIsNotForeseenToTakeLong) {
  world::World w = hills();
  world::EditBatch batch;
  batch.fill({{-2, 58, -2}, {2, 62, 2}}, block(w, "stone"));
  batch.fill({{-1, 59, -1}, {1, 61, 1}}, world::kAir);
  apply(w, batch);
  const Camera within = camera_at({}, {0.3, 60.4, 0.2}, {0.3, -0.8, -0.5});
  const auto raster = checked_raster();
  for (int picture = 0; picture < 3; ++picture) {
    const Frame drawn = draw(*raster, w, within, {}, kWidth, kHeight);
    bool lists = false;
    for (const PassReport& pass : drawn.report.passes) lists |= pass.name == "transparency_resolve";
    EXPECT_TRUE(lists) << "no layer lies in the picture's direction";
    for (const gpu::TimeSlices::Use& use : raster->rasterizer().slices().uses()) EXPECT_LT(use.slices, 100u) << picture;
  }
}

/// Rays without end, of up to 2^24 steps each. What the second picture was foreseen to take is what the first took.
TEST(HardCaseR10, APictureOfFarMoreThanABillionStepsEndsAndIsCutIntoShortSlices) {
  const world::World w = hills();
  RenderKnobs knobs;
  knobs.view_distance = knobs.occlusion_distance = 1e9f;
  knobs.sky_rays = 32;
  knobs.transparency = Transparency::opaque;
  auto raster = make_raster({});
  ASSERT_TRUE(raster.ok()) << raster.error().message;
  const auto drawn = [&] { return draw(**raster, w, hill_cameras()[0].camera, knobs, kWidth, kHeight).image; };
  const Image first = drawn();
  EXPECT_TRUE(same(first, drawn()));
  const auto uses = (*raster)->rasterizer().slices().uses();
  ASSERT_FALSE(uses.empty());
  for (const gpu::TimeSlices::Use& use : uses) {
    EXPECT_NE(use.group_ms, gpu::kUnmeasuredGroupMs);
    if (use.of_slice > 1) {
      EXPECT_LE(static_cast<double>(use.of_slice) * use.group_ms, gpu::kSliceMostMs);
    }
    EXPECT_TRUE(use.slices > 1 || static_cast<double>(use.groups) * use.group_ms <= gpu::kSliceAimMs);
  }
}

}  // namespace
}  // namespace render
