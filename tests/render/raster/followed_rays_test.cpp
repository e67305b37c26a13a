/// Mirrored and bent rays of the rasterizer meet shapes of blocks and bodies after edits, and as the knobs say. Each
/// picture with the validation layer on. That they meet them as those of the ray caster do is claimed in
/// tests/tools/agreement/rows.cpp.
#include <gtest/gtest.h>

#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/shape_worlds.h"

namespace render {
namespace {

constexpr int kWidth = 320, kHeight = 180;

RenderKnobs traced_knobs() {
  RenderKnobs knobs;
  knobs.textures = TextureFilter::off, knobs.lod_error_px = 0;
  knobs.transparency = Transparency::lists;
  knobs.reflection = Reflection::traced, knobs.refraction = Refraction::traced;
  knobs.tinted_shadows = true;
  return knobs;
}

class FollowedRays : public BothBackends {
 protected:
  Image drawn(const world::World& w, const Camera& camera, const RenderKnobs& knobs) {
    return draw(*raster_, w, camera, knobs, kWidth, kHeight).image;
  }
};

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
