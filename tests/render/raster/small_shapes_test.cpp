/// Small shapes of blocks that dispatches draw (render/raster/small_shapes.h): the picture is that of the pipeline's
/// points, in these worlds bit by bit, and nothing of it is there where it isn't called for.
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/lists_and_draws.h"
#include "tests/render/raster/shape_worlds.h"

namespace render {
namespace {

uint64_t shapes_listed(const Frame& frame) { return work(frame, "shapes_listed"); }

/// Ground of two materials, plants on most of it, posts of wood among them that hide some, a floating slab.
world::World meadow(world::VoxelPos offset = {}) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  const char* plants[] = {"tall_grass", "fern", "wheat", "flower_red", "reed", "torch"};
  for (int x = -64; x < 64; ++x)
    for (int z = -64; z < 64; ++z) {
      const uint64_t h = world::mix64(static_cast<uint64_t>((x + 64) * 128 + z + 64));
      batch.set(offset + world::VoxelPos{x, 0, z}, block(w, (x ^ z) & 1 ? "grass" : "sand"));
      if (h % 40 == 0)
        batch.fill(box_at(offset, {x, 1, z}, {x, 3, z}), block(w, "oak_log"));
      else if (h % 4 != 1)
        batch.set(offset + world::VoxelPos{x, 1, z}, block(w, plants[h / 64 % 6]));
    }
  batch.fill(box_at(offset, {-10, 8, -30}, {12, 8, -12}), block(w, "brick_red"));
  apply(w, batch);
  return w;
}

/// So far from its chunks that shapes of all of them are small.
std::vector<NamedCamera> meadow_cameras(world::VoxelPos offset = {}) {
  return {{"slanted", camera_at(offset, {-40.3, 42.2, 90.7}, {0.4, -0.5, -0.9})},
          {"along the ground", camera_at(offset, {-84.2, 4.73, -3.4}, {1, -0.06, 0.05})},
          {"straight down", camera_at(offset, {5.5, 90.25, 3.125}, {0, -1, 0})},
          {"far", camera_at(offset, {10.3, 150.2, 200.4}, {0, -0.6, -1})}};
}

class SmallShapes : public ListsAndDraws {
 protected:
  /// Dispatches draw shapes that are up to twice as large.
  void expect_equal(const world::World& w, const Camera& camera, RenderKnobs knobs, int width, int height,
                    const std::string& what) {
    RenderKnobs of_draws = knobs;
    of_draws.shape_points_px = 2 * knobs.shape_points_px;
    ListsAndDraws::expect_equal(w, camera, knobs, of_draws, width, height, "shapes_listed", what);
  }
};

TEST_F(SmallShapes, ShowWhatPipelinesShow) {
  const world::World w = meadow();
  for (const NamedCamera& c : meadow_cameras()) expect_equal(w, c.camera, {}, 320, 180, c.name);
}

TEST_F(SmallShapes, ShowItInPicturesThatNoBlockDividesAndAtTheirRim) {
  const world::World w = meadow();
  for (const auto& [width, height] : {std::pair(163, 91), std::pair(121, 113), std::pair(8, 200), std::pair(320, 180)})
    for (const size_t camera : {0, 2})
      expect_equal(w, meadow_cameras()[camera].camera, {}, width, height, std::to_string(width));
}

/// Plants of 60 pixels, and of 3.
TEST_F(SmallShapes, ShowThemAsLargeAsAPointMayBe) {
  const world::World w = meadow();
  RenderKnobs knobs;
  knobs.shape_points_px = 31;
  expect_equal(w, camera_at({}, {-68.7, 5.2, 2.3}, {1, -0.3, 0.1}), knobs, 320, 180, "large");
  knobs.shape_points_px = 1.5f;
  expect_equal(w, meadow_cameras()[0].camera, knobs, 80, 45, "small");
}

/// Fences, stairs, ladders: up to a dozen faces each, whose walls stand on cubes.
TEST_F(SmallShapes, ShowShapesOfManyFaces) {
  RenderKnobs knobs;
  knobs.shape_points_px = 31;
  const world::World w = garden();
  for (const NamedCamera& c : {NamedCamera{"down", camera_at({}, {-8.4, 16.2, 1.3}, {0.1, -1, 0.03})},
                               NamedCamera{"slanted", camera_at({}, {-12.3, 17.1, -9.2}, {0.7, -0.7, 0.6})}})
    expect_equal(w, c.camera, knobs, 64, 40, c.name);
}

TEST_F(SmallShapes, ShowThemFarFromTheOrigin) {
  const world::VoxelPos offset{100'000'007, 3, -99'999'989};
  expect_equal(meadow(offset), meadow_cameras(offset)[0].camera, {}, 320, 180, "far");
}

TEST_F(SmallShapes, ShowThemWhereALevelFadesOut) {
  RenderKnobs knobs;
  for (const float error : {1.0f, 2.0f, 4.0f}) {
    knobs.lod_error_px = error;
    expect_equal(meadow(), meadow_cameras()[1].camera, knobs, 320, 180, std::to_string(error));
  }
}

/// Of what a picture left nothing is in the next.
TEST_F(SmallShapes, OfAnEditedWorldShowWhatIsThere) {
  world::World w = meadow();
  const Camera camera = meadow_cameras()[0].camera;
  expect_equal(w, camera, {}, 320, 180, "before");
  world::EditBatch batch;
  batch.fill({{-64, 1, -64}, {0, 1, 63}}, world::kAir);
  apply(w, batch);
  expect_equal(w, camera, {}, 320, 180, "after");
}

TEST_F(SmallShapes, AreAbsentWhereTheyAreNotCalledFor) {
  const world::World w = meadow();
  const Camera camera = meadow_cameras()[0].camera;
  EXPECT_GT(shapes_listed(draw(*lists_, w, camera, {}, 320, 180)), 0u);
  RenderKnobs none;
  none.shape_points_px = 0;
  EXPECT_EQ(shapes_listed(draw(*lists_, w, camera, none, 320, 180)), 0u);
  RenderKnobs hardware;
  hardware.face_edges = FaceEdges::hardware;
  EXPECT_EQ(shapes_listed(draw(*lists_, w, camera, hardware, 320, 180)), 0u);
  // Faces of cubes are listed here, but there are no shapes.
  const Frame bare = draw(*lists_, hills(), hill_cameras()[0].camera, {}, 320, 180);
  EXPECT_GT(work(bare, "faces_listed"), 0u);
  EXPECT_EQ(shapes_listed(bare), 0u);
}

TEST_F(SmallShapes, AreDrawnByPipelinesWhereTheDeviceHasNoAtomicNumbersOf64Bits) {
  auto without = make_raster({.validation = true, .without = {"shaderBufferInt64Atomics"}});
  ASSERT_TRUE(without.ok());
  const world::World w = meadow();
  const Camera camera = meadow_cameras()[0].camera;
  const Frame frame = draw(**without, w, camera, {}, 320, 180);
  EXPECT_GT(work(frame, "faces_listed"), 0u);
  EXPECT_EQ(shapes_listed(frame), 0u);
  EXPECT_TRUE(same(frame.image, draw(*draws_, w, camera, {}, 320, 180).image));
  EXPECT_EQ((*without)->messages(), std::vector<std::string>{});
}

}  // namespace
}  // namespace render
