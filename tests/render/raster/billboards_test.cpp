/// Billboard clouds of trees: as near to the faces' picture as the knob says, shared, up to date, and absent where none
/// is asked for or far enough.
#include <algorithm>

#include <gtest/gtest.h>

#include "render/image/error_metrics.h"
#include "render/raster/raster.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/far_pictures.h"
#include "tests/render/raster/small_worlds.h"
#include "world/base/random.h"

namespace render {
namespace {

constexpr int kWidth = 320, kHeight = 180;

void plant(world::World& w, world::EditBatch& batch, world::VoxelPos foot, int kind) {
  const int radius = 2 + kind % 2, height = 4 + kind;
  for (int x = -radius; x <= radius; ++x)
    for (int y = -radius; y <= radius; ++y)
      for (int z = -radius; z <= radius; ++z) {
        const uint64_t h = world::mix64(static_cast<uint64_t>(((kind * 16 + x + 8) * 16 + y + 8) * 16 + z + 8));
        if (x * x + y * y + z * z <= radius * radius + static_cast<int>(h % 3))
          batch.set(foot + world::VoxelPos{x, height + y, z}, block(w, kind % 2 ? "oak_leaves" : "birch_leaves"));
      }
  batch.fill({foot, foot + world::VoxelPos{0, height, 0}}, block(w, "oak_log"));
}

/// A meadow of 256 x 256 voxels with 16 x 16 trees of three shapes. None crosses the side of a chunk.
world::World orchard(world::VoxelPos offset = {}) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill(box_at(offset, {-128, 0, -128}, {127, 3, 127}), block(w, "grass"));
  for (int x = -120, n = 0; x < 124; x += 16)
    for (int z = -120; z < 124; z += 16, ++n) plant(w, batch, offset + world::VoxelPos{x, 4, z}, n % 3);
  apply(w, batch);
  return w;
}

RenderKnobs with_clouds(float error_px) {
  RenderKnobs knobs;
  knobs.billboard_error_px = error_px;
  knobs.lod_error_px = 0;
  knobs.sun_shadow = SunShadow::none;
  knobs.transparency = Transparency::opaque;
  return knobs;
}

Frame frame(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs) {
  return draw(backend, w, camera, knobs, kWidth, kHeight);
}

/// Once its clouds are made.
Frame settled_frame(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs) {
  for (int i = 0; i < 8; ++i) frame(backend, w, camera, knobs);
  return frame(backend, w, camera, knobs);
}

Camera over_the_orchard(world::VoxelPos offset = {}) {
  return camera_at(offset, Vec3d(-190.3, 40.2, 3.4), {1, -0.2, 0.1});
}

TEST(Billboards, ComeNearerToTheFacesPictureWithTheKnobAndMeetIt) {
  auto raster = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok());
  const world::World w = orchard();
  const Camera camera = over_the_orchard();
  const Image faces = frame(**raster, w, camera, with_clouds(0)).image;
  double last = 1;
  uint64_t planes = 0;
  for (const float knob : {8.0f, 4.0f, 2.0f, 1.0f, 0.5f, 0.25f}) {
    const Frame drawn = settled_frame(**raster, w, camera, with_clouds(knob));
    const double flip = compare_images(drawn.image, faces).metrics.flip;
    std::printf("  %.2f px: FLIP %.4f; %llu trees, %llu planes, %llu clouds\n", double{knob}, flip,
                static_cast<unsigned long long>(work(drawn, "billboard_trees")),
                static_cast<unsigned long long>(work(drawn, "billboard_planes")),
                static_cast<unsigned long long>(work(drawn, "billboard_clouds")));
    EXPECT_LE(flip, last);
    last = flip;
    planes = std::max(planes, work(drawn, "billboard_planes"));
  }
  EXPECT_GT(planes, 100u);
  EXPECT_EQ(last, 0);  // no tree is far enough
  EXPECT_EQ((*raster)->messages(), std::vector<std::string>{});
}

TEST(Billboards, AreAbsentWhereTheKnobIsZeroOrNoTreeIsFarEnough) {
  auto raster = make_raster({.validation = true}), fresh = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok() && fresh.ok());
  const world::World w = orchard();
  const Camera camera = over_the_orchard();
  const Frame with = settled_frame(**raster, w, camera, with_clouds(4));
  EXPECT_TRUE(has_row(with, "billboards"));
  EXPECT_GT(work(with, "faces_in_billboards"), 0u);
  const Image faces = frame(**fresh, w, camera, with_clouds(0)).image;
  for (const float knob : {0.0f, 0.05f}) {
    const Frame without = settled_frame(**raster, w, camera, with_clouds(knob));
    EXPECT_FALSE(has_row(without, "billboards"));
    for (const char* name : {"billboard_trees", "billboard_planes", "billboard_clouds", "billboard_texels",
                             "billboards_made", "faces_in_billboards"})
      EXPECT_EQ(work(without, name), 0u);
    EXPECT_TRUE(same(without.image, faces));
  }
}

TEST(Billboards, AreSharedByTreesOfOneShapeAndMadeOnce) {
  auto raster = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok());
  const world::World w = orchard();
  const Frame drawn = settled_frame(**raster, w, over_the_orchard(), with_clouds(20));
  EXPECT_GT(work(drawn, "billboard_trees"), 100u);
  EXPECT_LE(work(drawn, "billboard_clouds"), 9u);  // three shapes, three errors
  EXPECT_EQ(work(drawn, "billboards_made"), 0u);
}

TEST(Billboards, FollowEdits) {
  auto raster = make_raster({.validation = true}), fresh = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok() && fresh.ok());
  world::World w = orchard();
  const Camera camera = over_the_orchard();
  const Frame before = settled_frame(**raster, w, camera, with_clouds(4));
  const uint64_t clouds = work(before, "billboard_clouds");
  world::EditBatch batch;
  plant(w, batch, {0, 4, 0}, 5);  // a shape that no other tree has
  batch.fill({{30, 4, -60}, {60, 20, 20}}, world::kAir);
  apply(w, batch);
  const Frame after = settled_frame(**raster, w, camera, with_clouds(4));
  EXPECT_FALSE(same(after.image, before.image));
  EXPECT_TRUE(same(after.image, settled_frame(**fresh, w, camera, with_clouds(4)).image));
  EXPECT_GT(work(after, "billboard_clouds"), clouds);
  batch = {};
  batch.fill({{-128, 4, -128}, {127, 30, 127}}, world::kAir);
  apply(w, batch);
  const Frame bare = settled_frame(**raster, w, camera, with_clouds(4));
  EXPECT_FALSE(has_row(bare, "billboards"));
  EXPECT_TRUE(same(bare.image, frame(**fresh, w, camera, with_clouds(0)).image));
}

TEST(Billboards, AreTheSameFarFromTheOrigin) {
  const world::VoxelPos far{1 << 29, 0, -(1 << 29)};
  auto one = make_raster({.validation = true}), other = make_raster({.validation = true});
  ASSERT_TRUE(one.ok() && other.ok());
  const Frame here = settled_frame(**one, orchard(), over_the_orchard(), with_clouds(4));
  const Frame there = settled_frame(**other, orchard(far), over_the_orchard(far), with_clouds(4));
  EXPECT_TRUE(has_row(here, "billboards"));
  EXPECT_TRUE(same(here.image, there.image));
}

}  // namespace
}  // namespace render
