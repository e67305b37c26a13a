/// Mirrored and bent rays of the rasterizer meet shapes of blocks and bodies, as those of the ray caster that follows
/// them (light_transport=whitted) do. Each picture with the validation layer on.
#include <cstdio>

#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 320, kHeight = 180;

/// A row of things along x: a torch, a fence of three, a flower, stairs, a slab, a pane of two, a ladder.
void set_row(world::World& w, world::EditBatch& batch, world::VoxelPos first) {
  const std::vector<std::pair<int, world::BlockId>> row = {{0, block(w, "torch")},
                                                           {2, block(w, "shaped_fence")},
                                                           {3, block(w, "shaped_fence")},
                                                           {4, block(w, "shaped_fence")},
                                                           {6, block(w, "flower_red")},
                                                           {8, block(w, "shaped_stairs_south_bottom")},
                                                           {10, block(w, "shaped_slab_bottom")},
                                                           {12, block(w, "shaped_pane")},
                                                           {13, block(w, "shaped_pane")},
                                                           {15, block(w, "shaped_ladder_north")}};
  for (const auto& [x, id] : row) batch.set(first + world::VoxelPos{x, 0, 0}, id);
}

void set_rows(world::World& w, std::initializer_list<world::VoxelPos> rows) {
  world::EditBatch batch;
  for (const world::VoxelPos& first : rows) set_row(w, batch, first);
  apply(w, batch);
}

world::World ground() {
  world::World w(world::standard_blocks());
  for (const char* proxy : {"fence", "stairs_south_bottom", "slab_bottom", "pane", "ladder_north"})
    shaped(w, proxy, {0.6f, 0.35f, 0.2f});
  world::EditBatch batch;
  batch.fill({{-24, -4, -20}, {24, -1, 20}}, block(w, "plaster"));
  apply(w, batch);
  return w;
}
/// A wall of mercury.
world::World mirror() {
  world::World w = ground();
  world::EditBatch batch;
  batch.fill({{-10, 0, -16}, {10, 7, -16}}, block(w, "mercury"));
  apply(w, batch);
  return w;
}
void fill_pool(world::World& w, const char* liquid) {
  world::EditBatch batch;
  batch.fill({{-10, -3, -8}, {10, -1, 4}}, block(w, liquid));
  apply(w, batch);
}
world::World pool() {
  world::World w = ground();
  fill_pool(w, "water");
  return w;
}
constexpr world::VoxelPos kBeforeTheMirror{-8, 0, -13}, kBeyondThePool{-8, 0, -9}, kUnderWater{-8, -3, -2};

/// Before the mirror, above the pool, on its bottom, and half in it.
const std::vector<BodyRecord> kBodies = {{-3.5f, 1.2f, -13.4f, 0.4f, 0.9f, 0.4f, {0.2f, 0.5f, 0.7f}},
                                         {3.5f, 1.6f, -6.4f, 0.6f, 0.5f, 0.6f, {0.7f, 0.2f, 0.3f}},
                                         {-4.3f, -2.2f, 1.4f, 0.7f, 0.7f, 0.7f, {0.2f, 0.7f, 0.2f}},
                                         {5.2f, 0.1f, 0.3f, 0.5f, 0.8f, 0.5f, {0.6f, 0.6f, 0.1f}}};

RenderKnobs traced_knobs() {
  RenderKnobs knobs;
  knobs.textures = TextureFilter::off, knobs.lod_error_px = 0;
  knobs.transparency = Transparency::lists;
  knobs.reflection = Reflection::traced, knobs.refraction = Refraction::traced;
  knobs.tinted_shadows = true;
  return knobs;
}

const std::vector<NamedCamera> kMirrorViews = {
    {"in the mirror", camera_at({}, {-1.3, 3.2, -8.4}, {0.05, -0.1, -1}, 80)},
    {"along the mirror", camera_at({}, {8.4, 2.3, -10.2}, {-1, -0.15, -0.35}, 70)}};
const std::vector<NamedCamera> kPoolViews = {
    {"over the pool", camera_at({}, {0.4, 5.2, 12.3}, {0.02, -0.5, -1}, 70)},
    {"into the pool", camera_at({}, {-3.4, 7.3, 2.2}, {0.1, -1, -0.4}, 70)},
    {"along the water", camera_at({}, {1.2, 0.7, 9.3}, {-0.05, -0.12, -1}, 60)}};

class FollowedRays : public BothBackends {
 protected:
  Image drawn(const world::World& w, const Camera& camera, const RenderKnobs& knobs) {
    return draw(*raster_, w, camera, knobs, kWidth, kHeight).image;
  }
  /// The bound of the project: 99.9 % of pixels within 2/255.
  void expect_agreement(const world::World& w, const std::vector<NamedCamera>& views) {
    raster_->inhabitants = raycast_->inhabitants = {{0, 0, 0}, {}, kBodies};
    for (const NamedCamera& view : views) {
      RenderKnobs knobs = traced_knobs();
      const Image by_raster = drawn(w, view.camera, knobs);
      knobs.light_transport = LightTransport::whitted;
      const Image cast = draw(*raycast_, w, view.camera, knobs, kWidth, kHeight).image;
      const double share = share_within(by_raster, cast, 2);
      std::printf("  %-16s %.4f %% within 2/255 of the tracer\n", view.name.c_str(), 100 * share);
      EXPECT_GE(share, 0.999) << view.name;
    }
  }
};

TEST_F(FollowedRays, MirroredMeetShapesAndBodiesAsThoseOfTheTracerDo) {
  world::World w = mirror();
  set_rows(w, {kBeforeTheMirror});
  expect_agreement(w, kMirrorViews);
}

TEST_F(FollowedRays, OfWaterMeetShapesAndBodiesAsThoseOfTheTracerDo) {
  world::World w = pool();
  set_rows(w, {kBeyondThePool});
  expect_agreement(w, kPoolViews);
}

/// Around a shape under water there is air. What its sides mirror is the sky, by the tracer what is there: this water
/// bends rays and mirrors little.
TEST_F(FollowedRays, BentMeetShapesAndBodiesUnderWaterAsThoseOfTheTracerDo) {
  world::World w = ground();
  world::Block thin = (*w.palette)[block(w, "water")];
  thin.name = "thin_water", thin.index_of_refraction = 1.005f;
  CHECK(w.palette->add(thin).ok());
  fill_pool(w, "thin_water");
  set_rows(w, {kUnderWater});
  expect_agreement(w, kPoolViews);
}

TEST_F(FollowedRays, MeetShapesAfterEditsAsAfresh) {
  world::World w = pool();
  const Camera& camera = kPoolViews[0].camera;
  const Image none = drawn(w, camera, traced_knobs());
  set_rows(w, {kBeyondThePool, kUnderWater});
  const Image shapes = drawn(w, camera, traced_knobs());
  // The fences join it.
  world::EditBatch more;
  for (const world::VoxelPos& first : {kBeyondThePool, kUnderWater})
    more.set(first + world::VoxelPos{5, 0, 0}, block(w, "shaped_fence"));
  apply(w, more);
  const Image joined = drawn(w, camera, traced_knobs());
  EXPECT_FALSE(same(joined, shapes));
  auto fresh = make_raster({.validation = true});
  ASSERT_TRUE(fresh.ok());
  EXPECT_TRUE(same(joined, draw(**fresh, w, camera, traced_knobs(), kWidth, kHeight).image));
  world::EditBatch gone;
  gone.fill({kBeyondThePool, kBeyondThePool + world::VoxelPos{15, 0, 0}}, world::kAir);
  gone.fill({kUnderWater, kUnderWater + world::VoxelPos{15, 0, 0}}, block(w, "water"));
  apply(w, gone);
  EXPECT_TRUE(same(drawn(w, camera, traced_knobs()), none));
}

TEST_F(FollowedRays, MeetCubesWhereShapesAreDrawnAsThose) {
  RenderKnobs knobs = traced_knobs();
  knobs.proxy_shapes = ProxyShapes::cube;
  const auto with_row = [&](bool shape) {
    world::World w = mirror();
    world::Block plain = (*w.palette)[block(w, "shaped_fence")];
    plain.name = "plain", plain.proxy.clear();
    CHECK(w.palette->add(plain).ok());
    world::EditBatch batch;
    batch.fill({{-4, 0, -13}, {4, 0, -13}}, block(w, shape ? "shaped_fence" : "plain"));
    apply(w, batch);
    return drawn(w, kMirrorViews[0].camera, knobs);
  };
  EXPECT_TRUE(same(with_row(true), with_row(false)));
}

/// A body and a particle behind the eye, which are seen in the mirror alone.
TEST_F(FollowedRays, OfAPlanarPictureMeetWhatStandsBehindTheEye) {
  const world::World w = mirror();
  const Camera camera = camera_at({}, {0.3, 2.2, -13.2}, {0.05, -0.1, -1}, 70);
  RenderKnobs planar = traced_knobs();
  planar.reflection = Reflection::planar;
  const Image nobody = drawn(w, camera, planar);
  const std::vector<BodyRecord> body = {{0.8f, 1.7f, -11.2f, 0.8f, 1.2f, 0.5f, {0.2f, 0.5f, 0.7f}}};
  raster_->inhabitants.bodies = body;
  const Image seen = drawn(w, camera, planar), traced = drawn(w, camera, traced_knobs());
  EXPECT_GT(differing(seen, nobody), 0.02);
  // Its pixels aren't those that mirrored rays lead to, which tells at edges.
  EXPECT_GT(share_within(seen, traced, 2), 0.99);
  ParticleRecord ball;
  ball.x = 0.8f, ball.y = 1.7f, ball.z = -11.2f, ball.radius = 1, ball.opacity = 1, ball.albedo = {0.9f, 0.1f, 0.1f};
  raster_->inhabitants = {{0, 0, 0}, {&ball, 1}, {}};
  EXPECT_GT(differing(drawn(w, camera, planar), nobody), 0.02);
}

}  // namespace
}  // namespace render
