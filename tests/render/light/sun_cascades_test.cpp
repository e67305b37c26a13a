#include "render/light/sun_cascades.h"

#include <gtest/gtest.h>

#include "render/light/sun_maps.h"
#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

using world::Vec3d;
using world::WorldPoint;

RenderKnobs cascades_of(int count, int side) {
  RenderKnobs knobs;
  knobs.sun_shadow = SunShadow::map;
  knobs.sun_map_cascades = count, knobs.sun_cascade_texels = side;
  knobs.transparency = Transparency::opaque;  // shadows on what is seen, not on layers before it
  return knobs;
}

Camera above(const Vec3d& moved = Vec3d(0.0)) {
  Camera camera;
  camera.position = WorldPoint::from(-45.3, 41.7, -48.2) + moved;
  camera.forward = glm::normalize(Vec3d(0.7, -0.5, 0.6));
  return camera;
}

struct Maps {
  world::StoreRays rays;
  SunCascades cascades;
  world::Status follow(const world::World& w, const WorldPoint& eye, const RenderKnobs& knobs) {
    const world::WorldView view(w);
    return cascades.follow(view, rays.stream(w.store, world::MaskKind::opaque), eye, knobs,
                           w.environment.sun_direction);
  }
};

/// Points on and around the hills, at all distances that cascades differ at.
std::vector<WorldPoint> some_points() {
  std::vector<WorldPoint> points;
  for (int x = -60; x <= 60; x += 3)
    for (int z = -60; z <= 60; z += 3)
      for (const double y : {3.2, 11.7, 24.4}) points.push_back(WorldPoint::from(x + 0.31, y, z + 0.67));
  return points;
}

TEST(SunCascades, EndsAreAMeanOfEqualRatiosAndEqualSteps) {
  for (const double split : {0.0, 0.3, 1.0}) {
    const std::vector<double> ends = sun_cascade_ends(4, 2, 512, split);
    ASSERT_EQ(ends.size(), 4u);
    for (int i = 1; i <= 4; ++i)
      EXPECT_NEAR(ends[static_cast<size_t>(i) - 1], split * 2 * std::pow(4.0, i) + (1 - split) * (2 + 510 * i / 4.0),
                  1e-9);
    EXPECT_NEAR(ends.back(), 512, 1e-9);
  }
}

TEST(SunCascades, AMovingEyeFindsTheMapsThatAFreshStartMakes) {
  const world::World w = hills();
  const RenderKnobs knobs = cascades_of(3, 128);
  Maps moving;
  uint64_t first = 0, later = 0;
  for (const Vec3d& moved :
       {Vec3d(0.0), Vec3d(0.4, 0, 0.2), Vec3d(3, 1, -2), Vec3d(3, 1, 9), Vec3d(-30, 0, 40), Vec3d(-29, 2, 40)}) {
    const WorldPoint eye = above(moved).position;
    ASSERT_TRUE(moving.follow(w, eye, knobs).ok());
    (moved == Vec3d(0.0) ? first : later) += moving.cascades.cast();
    Maps fresh;
    ASSERT_TRUE(fresh.follow(w, eye, knobs).ok());
    ASSERT_EQ(moving.cascades.words().size(), fresh.cascades.words().size());
    EXPECT_TRUE(
        std::equal(moving.cascades.words().begin(), moving.cascades.words().end(), fresh.cascades.words().begin()));
  }
  EXPECT_EQ(first, 3u * 128 * 128);
  EXPECT_LT(later, 5 * first / 2) << "five moves kept more than half of the texels";
  const uint64_t version = moving.cascades.version();
  ASSERT_TRUE(moving.follow(w, above(Vec3d(-29, 2, 40)).position, knobs).ok());
  EXPECT_EQ(moving.cascades.cast(), 0u);
  EXPECT_EQ(moving.cascades.version(), version);
}

/// Texels stay where they are in the world, so what lies in the same cascade before and after is lit as it was.
TEST(SunCascades, EdgesOfShadowsStandStillWhileTheEyeMoves) {
  const world::World w = hills();
  const RenderKnobs knobs = cascades_of(3, 256);
  Maps a, b;
  const WorldPoint eye = WorldPoint::from(2.2, 30, 1.4), next = WorldPoint::from(2.37, 30.1, 1.59);
  ASSERT_TRUE(a.follow(w, eye, knobs).ok());
  ASSERT_TRUE(b.follow(w, next, knobs).ok());
  size_t partly = 0, compared = 0;
  for (const WorldPoint& p : some_points()) {
    if (glm::length(p - eye) > 0.85 * a.cascades.reach(0)) continue;
    const float before = a.cascades.lit(p, 0.7f), after = b.cascades.lit(p, 0.7f);
    EXPECT_EQ(before, after);
    partly += before > 0 && before < 1;
    ++compared;
  }
  EXPECT_GT(compared, 100u);
  EXPECT_GT(partly, 2u) << "some lie on edges";
}

/// Where one cascade ends and the next begins, neither a plain in the sun nor one in the shadow shows a line, and an
/// edge goes over from one map's place to the other's by the blend alone.
TEST(SunCascades, NoSeamShowsWhereTwoMeet) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-200, 0, -200}, {199, 0, 199}}, block(w, "stone"));
  batch.fill({{-200, 60, -200}, {-1, 60, 199}}, block(w, "stone"));
  apply(w, batch);
  w.environment.sun_direction = glm::normalize(Vec3d(0.1, 1, 0.2));
  Maps maps;
  const WorldPoint eye = WorldPoint::from(0.3, 20, 0.4);
  ASSERT_TRUE(maps.follow(w, eye, cascades_of(4, 256)).ok());
  const float cosine = static_cast<float>(w.environment.sun_direction.y);
  for (double along = -180; along < 180; along += 0.13) {
    EXPECT_EQ(maps.cascades.lit(WorldPoint::from(60, 1.0, along), cosine), 1.0f) << along;
    EXPECT_EQ(maps.cascades.lit(WorldPoint::from(-60, 1.0, along), cosine), 0.0f) << along;
  }
  for (float d = 0; d <= 1; d += 0.01f) {
    const float now = shared::sun_cascade_blend(d, 1), then = shared::sun_cascade_blend(d + 0.01f, 1);
    EXPECT_GE(then, now);
    EXPECT_LE(then - now, 0.1f + 1e-4f);
  }
  EXPECT_EQ(shared::sun_cascade_blend(0.9f, 1), 0.0f);
  EXPECT_EQ(shared::sun_cascade_blend(1.0f, 1), 1.0f);
}

TEST(SunCascades, AnEditCastsOnlyTheTexelsThatItsLeavesLieBefore) {
  world::World w = hills();
  const RenderKnobs knobs = cascades_of(3, 256);
  const WorldPoint eye = WorldPoint::from(2.2, 30, 1.4);
  Maps followed;
  ASSERT_TRUE(followed.follow(w, eye, knobs).ok());
  world::EditBatch batch;
  batch.fill({{0, 28, 0}, {1, 28, 1}}, block(w, "stone"));
  apply(w, batch);
  ASSERT_TRUE(followed.follow(w, eye, knobs).ok());
  EXPECT_GT(followed.cascades.cast(), 0u);
  EXPECT_LT(followed.cascades.cast(), 3u * 256 * 256 / 2);
  Maps fresh;
  ASSERT_TRUE(fresh.follow(w, eye, knobs).ok());
  for (const WorldPoint& p : some_points()) EXPECT_EQ(followed.cascades.lit(p, 0.7f), fresh.cascades.lit(p, 0.7f));
}

Image drawn(Backend& backend, const world::World& w, const RenderKnobs& knobs) {
  return draw(backend, w, above(), knobs, 320, 180).image;
}

/// What differs from rays are the edges of shadows, a texel wide: half of it, half as many pixels. The finest ones here
/// are 0.03 to 0.3 m wide.
TEST(SunCascades, TendToTheShadowsOfRaysAsTheirTexelsShrink) {
  const world::World w = hills();
  auto raycast = make_raycast_backend();
  RenderKnobs by_rays = cascades_of(0, 128);
  by_rays.sun_shadow = SunShadow::ray;
  const Image exact = drawn(**raycast, w, by_rays);
  double before = 1;
  for (const int side : {128, 256, 512, 1024, 2048}) {
    const double now = differing(drawn(**raycast, w, cascades_of(4, side)), exact);
    EXPECT_LT(now, 0.7 * before) << side;
    before = now;
  }
  EXPECT_LT(before, 0.015);
}

TEST(SunCascades, BothBackendsShowTheSameShadowsAfterAnEdit) {
  auto raster = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok()) << raster.error().message;
  auto raycast = make_raycast_backend();
  world::World w = hills();
  RenderKnobs knobs = cascades_of(3, 512);
  knobs.sun_map_filter = 3;
  drawn(**raster, w, knobs), drawn(**raycast, w, knobs);
  // A part of the map that is sent, and the whole one in its place.
  world::EditBatch batch;
  batch.fill({{0, 28, 0}, {9, 28, 9}}, block(w, "stone"));
  apply(w, batch);
  // Pixels on edges between faces, and on a texel's last bit, differ.
  EXPECT_LE(differing(drawn(**raster, w, knobs), drawn(**raycast, w, knobs)), 1e-3);
  knobs.sun_map_cascades = 0;
  EXPECT_LE(differing(drawn(**raster, w, knobs), drawn(**raycast, w, knobs)), 1e-3);
  EXPECT_EQ((*raster)->messages(), std::vector<std::string>{});
}

uint64_t rays_for_maps(const Frame& frame) {
  uint64_t sum = 0;
  for (const EffectWork& work : frame.report.work) sum += work.name == "sun_map" ? work.work : 0;
  return sum;
}

TEST(SunCascades, NoRayIsCastForMapsThatNobodyAsksForOrThatAreThere) {
  const world::World w = hills();
  auto raster = make_raster({});
  ASSERT_TRUE(raster.ok()) << raster.error().message;
  auto raycast = make_raycast_backend();
  for (Backend* backend : {static_cast<Backend*>(raster->get()), raycast->get()}) {
    RenderKnobs knobs = cascades_of(4, 256);
    const auto cast = [&] {
      auto frame = backend->render(world::WorldView(w), above(), knobs, 64, 36);
      EXPECT_TRUE(frame.ok());
      return frame.ok() ? rays_for_maps(*frame) : 0;
    };
    EXPECT_EQ(cast(), 4u * 256 * 256);
    EXPECT_EQ(cast(), 0u);
    knobs.sun_shadow = SunShadow::ray;
    EXPECT_EQ(cast(), 0u);
  }
}

TEST(SunCascades, KnobsThatCantBeAreUsageErrors) {
  const world::World w = hills();
  auto raycast = make_raycast_backend();
  const auto expect_refused = [&](const char* knob, const RenderKnobs& knobs) {
    const auto frame = (*raycast)->render(world::WorldView(w), above(), knobs, 8, 8);
    ASSERT_FALSE(frame.ok()) << knob;
    EXPECT_NE(frame.error().message.find(knob), std::string::npos);
    EXPECT_EQ(frame.error().kind, world::ErrorKind::usage);
  };
  for (const int count : {-1, 9}) expect_refused("sun_map_cascades", cascades_of(count, 256));
  for (const int side : {0, 64, 1000, 8192}) expect_refused("sun_cascade_texels", cascades_of(2, side));
  for (const float split : {-0.1f, 1.1f, std::nanf("")}) {
    RenderKnobs knobs = cascades_of(2, 256);
    knobs.sun_map_split = split;
    expect_refused("sun_map_split", knobs);
  }
}

}  // namespace
}  // namespace render
