/// Faces of cubes that dispatches draw (render/raster/face_blocks.h): the picture is that of the pipeline, in these
/// worlds bit by bit, and nothing of it is there where it isn't called for.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/raster/block_lists.h"
#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/lists_and_draws.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

/// Threads of a processor get a run of the groups each; the ground is a run of a picture's rows.
TEST(SpreadingStride, TakesEachOnceAndGivesHalvesTheirShareOfAnyTenth) {
  for (const uint32_t count : {1u, 2u, 3u, 4u, 5u, 6u, 30u, 97u, 450u, 1800u, 65535u}) {
    const uint32_t stride = raster::spreading_stride(count);
    std::vector<uint32_t> place(count, count);
    for (uint32_t i = 0; i < count; ++i) place[uint64_t{i} * stride % count] = i;
    ASSERT_EQ(std::count(place.begin(), place.end(), count), 0) << count;
    if (count < 30) continue;
    const uint32_t tenth = count / 10;
    for (uint32_t first = 0; first + tenth <= count; first += tenth) {
      const auto in_first_half = std::count_if(place.begin() + first, place.begin() + first + tenth,
                                               [&](uint32_t i) { return i < count / 2; });
      // By the three-distance theorem gaps of multiples of a number near the golden section differ by at most its
      // square (Vera Sos. On the distribution mod 1 of the sequence n alpha. 1958): ends of a run and of a tenth cut
      // one each.
      EXPECT_LE(std::abs(static_cast<double>(in_first_half) - tenth / 2.0), 2) << count << " " << first;
    }
  }
}

uint64_t faces_listed(const Frame& frame) { return work(frame, "faces_listed"); }

class FaceBlocks : public ListsAndDraws {
 protected:
  void expect_equal(const world::World& w, const Camera& camera, const RenderKnobs& knobs, int width, int height,
                    const std::string& what) {
    ListsAndDraws::expect_equal(w, camera, knobs, knobs, width, height, "faces_listed", what);
  }
};

TEST_F(FaceBlocks, ShowWhatPipelinesShow) {
  const world::World w = hills();
  for (const NamedCamera& c : hill_cameras()) {
    if (c.name == "in the tunnel") continue;  // few faces
    expect_equal(w, c.camera, {}, 160, 90, c.name);
  }
}

TEST_F(FaceBlocks, ShowItInPicturesThatNoBlockDivides) {
  const world::World w = hills(), d = dust();
  for (const auto& [width, height] : {std::pair(163, 91), std::pair(121, 113), std::pair(8, 200)})
    for (const size_t camera : {0, 1})  // of the second the ground lies around the eye
      expect_equal(w, hill_cameras()[camera].camera, {}, width, height, std::to_string(width));
  expect_equal(d, camera_at({}, {0.3, 0.4, 0.2}, {0.4, 0.2, -1}, 100), {}, 163, 91, "dust");
}

TEST_F(FaceBlocks, ShowItOnThePlanesOfTheGridAndAHairsBreadthFromThem) {
  const world::World w = hills();
  for (const double off : {0.0, 1e-9, 1e-5, 5e-4, 0.999})
    expect_equal(w, camera_at({}, {3 + off, 26 + off, 50 + off}, {0.1, -0.3, -1}), {}, 160, 90, std::to_string(off));
}

TEST_F(FaceBlocks, ShowItFarFromTheOrigin) {
  const world::VoxelPos offset{100'000'007, 3, -99'999'989};
  expect_equal(hills(offset), hill_cameras(offset)[0].camera, {}, 160, 90, "far");
}

TEST_F(FaceBlocks, ShowTwoLevelsWhereTheyBlend) {
  RenderKnobs knobs;
  for (const float error : {2.0f, 4.0f, 8.0f}) {
    knobs.lod_error_px = error;
    expect_equal(hills(), hill_cameras()[0].camera, knobs, 160, 90, std::to_string(error));
  }
}

TEST_F(FaceBlocks, ShowLiquidsAsHighAsTheyAre) {
  world::World w = hills();
  world::EditBatch batch;
  batch.fill({{-40, 20, -40}, {40, 20, 40}}, block(w, "stone"));
  batch.fill({{-40, 21, -40}, {40, 21, 40}}, block(w, "lava"));
  apply(w, batch);
  world::IntLayer& amounts = w.store.make_int_layer(world::Layer::liquid);
  for (int x = -40; x <= 40; ++x)
    for (int z = -40; z <= 40; ++z) amounts.set({x, 21, z}, 40 + (x * 7 + z * 3) % 11 * 19 + 100);
  RenderKnobs knobs;
  knobs.liquid_surface = LiquidSurface::level;
  expect_equal(w, camera_at({}, {0.3, 28.4, 60.2}, {0.1, -0.3, -1}), knobs, 160, 90, "slopes");
  expect_equal(w, camera_at({}, {0.3, 21.5, 44.2}, {0.1, -0.1, -1}), knobs, 160, 90, "on a sixteenth");
}

/// A wall of single voxels so far away that a block of pixels has more of them than there is room for at first.
TEST_F(FaceBlocks, MakeRoomForLongLists) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  const world::BlockId blocks[] = {block(w, "stone"), block(w, "sand")};
  for (int x = -64; x < 64; ++x)
    for (int y = -64; y < 64; ++y) batch.set({x, y, -400}, blocks[(x ^ y) & 1]);
  apply(w, batch);
  RenderKnobs knobs;
  knobs.lod_error_px = 0;
  expect_equal(w, camera_at({}, {0.3, 0.4, 0.2}, {0.02, 0.01, -1}), knobs, 160, 90, "wall");
  // Seen from before it, faces are items.
  expect_equal(w, camera_at({}, {10.3, 0.4, -395.2}, {0.9, 0.01, -0.6}, 100), knobs, 320, 180, "near wall");
}

/// The first picture finds too little room, and is drawn again: of that what is mixed in time learns nothing.
TEST_F(FaceBlocks, OfATryWithoutRoomNothingIsRemembered) {
  RenderKnobs knobs;
  knobs.anti_aliasing = AntiAliasing::temporal;
  expect_equal(hills(), hill_cameras()[0].camera, knobs, 320, 180, "in time");
}

/// A small picture's lists are long, and room for them in each block of a large one would be large.
TEST_F(FaceBlocks, TakeNoMoreOfALargePictureAfterASmallOne) {
  const world::World w = hills();
  const Camera camera = hill_cameras()[0].camera;
  const auto bytes = [](const Frame& frame) {
    for (const PassReport& pass : frame.report.passes)
      if (pass.name == "faces") return pass.bytes;
    return uint64_t{0};
  };
  auto fresh = make_raster({});
  ASSERT_TRUE(fresh.ok());
  draw(*lists_, w, camera, {}, 160, 90);
  EXPECT_LT(bytes(draw(*lists_, w, camera, {}, 1280, 720)), 2 * bytes(draw(**fresh, w, camera, {}, 1280, 720)));
}

TEST_F(FaceBlocks, AreAbsentWhereTheyAreNotCalledFor) {
  const world::World w = hills();
  const Camera camera = hill_cameras()[0].camera;
  RenderKnobs hardware;
  hardware.face_edges = FaceEdges::hardware;
  EXPECT_EQ(faces_listed(draw(*lists_, w, camera, hardware, 160, 90)), 0u);
  // Few faces cost a pipeline less.
  EXPECT_EQ(faces_listed(draw(*lists_, room(), camera_at({}, {2.3, 2.4, 2.2}, {1, 0, 1}), {}, 160, 90)), 0u);
  RenderKnobs coarse_depth;
  coarse_depth.depth_format = DepthFormat::d16;
  EXPECT_EQ(faces_listed(draw(*lists_, w, camera, coarse_depth, 160, 90)), 0u);
  EXPECT_GT(faces_listed(draw(*lists_, w, camera, {}, 160, 90)), 0u);
}

}  // namespace
}  // namespace render
