/// Layers of see-through blocks that dispatches list by block of pixels (render/raster/layer_blocks.h): the picture is
/// that of the pipeline and its lists of pixels, in these worlds bit by bit, and nothing of it is there where it isn't
/// called for.
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/lists_and_draws.h"
#include "tests/render/raster/see_through_worlds.h"

namespace render {
namespace {

uint64_t layers_listed(const Frame& frame) { return work(frame, "layers_listed"); }

class LayerBlocks : public ListsAndDraws {
 protected:
  void expect_equal(const world::World& w, const Camera& camera, const RenderKnobs& knobs, int width, int height,
                    const std::string& what) {
    ListsAndDraws::expect_equal(w, camera, knobs, knobs, width, height, "layers_listed", what);
  }
};

TEST_F(LayerBlocks, ShowWhatPipelinesShow) {
  const world::World w = window_hall();
  for (const NamedCamera& c : hall_cameras()) expect_equal(w, c.camera, {}, 160, 90, c.name);
}

TEST_F(LayerBlocks, ShowItHalfBehindCubesInPicturesThatNoBlockDivides) {
  const world::World w = hills();
  for (const auto& [width, height] : {std::pair(163, 91), std::pair(121, 113), std::pair(8, 200)})
    expect_equal(w, hill_cameras()[0].camera, {}, width, height, std::to_string(width));
}

/// Among the cameras is one under water, where all pixels change.
TEST_F(LayerBlocks, ShowLiquidsAsHighAsTheyAre) {
  const world::World w = spill();
  for (const NamedCamera& c : spill_cameras()) expect_equal(w, c.camera, {}, 160, 90, c.name);
}

TEST_F(LayerBlocks, ShowThemFarFromTheOrigin) {
  const world::VoxelPos offset{100'000'007, 3, -99'999'989};
  expect_equal(spill(offset), spill_cameras(offset)[0].camera, {}, 160, 90, "far");
}

TEST_F(LayerBlocks, BendMirrorAndCoverAsPipelinesDo) {
  const world::World w = window_hall();
  for (const Refraction refraction : {Refraction::screen, Refraction::traced})
    for (const Reflection reflection : {Reflection::screen, Reflection::traced}) {
      RenderKnobs knobs;
      knobs.refraction = refraction, knobs.reflection = reflection;
      expect_equal(w, hall_cameras()[2].camera, knobs, 96, 54, "the pool");
    }
  RenderKnobs knobs;
  knobs.coverage_pattern = CoveragePattern::hashed;
  expect_equal(w, hall_cameras()[0].camera, knobs, 160, 90, "by samples");
}

/// Two interfaces a pane: more than a word of a mask has, and more than there is room for at first.
TEST_F(LayerBlocks, MakeRoomForLongLists) {
  const Camera camera = camera_at({}, {0.5, 0.5, 0.5}, {0.01, 0.02, -1}, 30);
  for (const int count : {15, 16, 17, 50})
    expect_equal(panes(count, {"glass_white", "glass_pink", "ice"}), camera, {}, 96, 54, std::to_string(count));
  // Each pane is in one of several words.
  expect_equal(panes(50, {"glass_white", "glass_pink", "lace"}), camera_at({}, {-14.5, 8.5, 0.5}, {0.2, -0.1, -1}), {},
               96, 54, "aslant");
}

/// The first picture finds too little room, and is drawn again: of that what is mixed in time learns nothing.
TEST_F(LayerBlocks, OfATryWithoutRoomNothingIsRemembered) {
  RenderKnobs knobs;
  knobs.anti_aliasing = AntiAliasing::temporal;
  expect_equal(panes(40, {"glass_white", "ice"}), camera_at({}, {0.5, 0.5, 0.5}, {0.01, 0.02, -1}, 30), knobs, 96, 54,
               "in time");
}

TEST_F(LayerBlocks, AreAbsentWhereTheyAreNotCalledFor) {
  const world::World w = panes(3, {"glass_red", "glass", "ice"});
  const Camera camera = camera_at({}, {3.2, 2.3, 4.5}, {-0.2, -0.1, -1});
  EXPECT_GT(layers_listed(draw(*lists_, w, camera, {}, 160, 90)), 0u);
  RenderKnobs hardware, coarse_depth, sorted, weighted, opaque;
  hardware.face_edges = FaceEdges::hardware;
  coarse_depth.depth_format = DepthFormat::d16;
  sorted.transparency = Transparency::sorted;
  weighted.transparency = Transparency::weighted;
  opaque.transparency = Transparency::opaque;
  for (const RenderKnobs& knobs : {hardware, coarse_depth, sorted, weighted, opaque})
    EXPECT_EQ(layers_listed(draw(*lists_, w, camera, knobs, 160, 90)), 0u);
  world::World stone(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-12, -12, -8}, {12, 12, -6}}, block(stone, "stone"));
  apply(stone, batch);
  EXPECT_EQ(layers_listed(draw(*lists_, stone, camera, {}, 160, 90)), 0u);
  EXPECT_GT(layers_listed(draw(*lists_, w, camera, {}, 160, 90)), 0u);
}

}  // namespace
}  // namespace render
