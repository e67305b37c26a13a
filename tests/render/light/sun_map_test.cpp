#include "render/light/sun_map.h"

#include <gtest/gtest.h>

#include "render/raycast/raycast.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/lit_worlds.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

Camera above() {
  Camera camera;
  camera.position = world::WorldPoint::from(-45.3, 41.7, -48.2);
  camera.forward = glm::normalize(world::Vec3d(0.7, -0.5, 0.6));
  return camera;
}

RenderKnobs map_of(float texel) {
  RenderKnobs knobs;
  knobs.sun_shadow = SunShadow::map;
  knobs.sun_map_texel = texel;
  knobs.transparency = Transparency::opaque;  // shadows on what is seen, not on layers before it
  return knobs;
}

Image drawn(Backend& backend, const world::World& w, const RenderKnobs& knobs) {
  return draw(backend, w, above(), knobs, 320, 180).image;
}

/// What differs from rays are the edges of shadows, a texel wide: half of it, half as many pixels.
TEST(SunMap, TendsToTheShadowsOfRaysAsItsTexelsShrink) {
  const world::World w = hills();
  auto raycast = make_raycast_backend();
  RenderKnobs by_rays = map_of(1);
  by_rays.sun_shadow = SunShadow::ray;
  const Image exact = drawn(**raycast, w, by_rays);
  double before = 1;
  for (const float texel : {1.0f, 0.5f, 0.25f, 0.125f, 0.0625f}) {
    const double now = differing(drawn(**raycast, w, map_of(texel)), exact);
    EXPECT_LT(now, 0.7 * before) << texel;
    before = now;
  }
  EXPECT_LT(before, 0.01);
}

/// Where luminaires shine, pictures are traced.
TEST(SunMap, OfATracedPictureIsRays) {
  world::World w = hills();
  w.luminaires.push_back(luminaire("omni"));
  auto raycast = make_raycast_backend();
  RenderKnobs knobs = map_of(1);
  const Image by_map = drawn(**raycast, w, knobs);
  knobs.sun_shadow = SunShadow::ray;
  const Image by_rays = drawn(**raycast, w, knobs);
  EXPECT_TRUE(same(by_map, by_rays));
  knobs.sun_shadow = SunShadow::none;
  EXPECT_GT(differing(drawn(**raycast, w, knobs), by_rays), 0.01);
}

TEST(SunMap, IsMadeOnceAndAgainAfterAnEditAndGoesWhereNobodyAsks) {
  world::World w = hills();
  SunMap map;
  world::StoreRays rays;
  const auto follow = [&](float texel) {
    const world::WorldView view(w);
    return map.follow(view, rays.stream(w.store, world::MaskKind::opaque), texel, w.environment.sun_direction);
  };
  ASSERT_TRUE(follow(0.5f).ok());
  const uint64_t first = map.version();
  ASSERT_TRUE(follow(0.5f).ok());
  EXPECT_EQ(map.version(), first);
  world::EditBatch batch;
  batch.fill({{0, 50, 0}, {9, 50, 9}}, block(w, "stone"));
  const world::WorldPoint below = world::WorldPoint::from(5.0, 49.9, 5.0);
  EXPECT_EQ(map.lit(below, 0.7f), 1.0f);
  apply(w, batch);
  ASSERT_TRUE(follow(0.5f).ok());
  EXPECT_GT(map.version(), first);
  EXPECT_EQ(map.lit(below, 0.7f), 0.0f);
  EXPECT_EQ(map.lit(world::WorldPoint::from(5.0, 51.0, 5.0), 0.7f), 1.0f) << "on top of it";
  EXPECT_EQ(map.lit(world::WorldPoint::from(5e6, 51.0, 5.0), 0.7f), 1.0f) << "far outside the map";
  map.clear();
  EXPECT_EQ(map.bytes(), 0u);
}

TEST(SunMap, TexelsThatCantBeAreUsageErrors) {
  const world::World w = hills();
  auto raycast = make_raycast_backend();
  for (const float texel : {0.0f, -1.0f, 1e-3f, 1e9f, std::nanf("")}) {
    const auto frame = (*raycast)->render(world::WorldView(w), above(), map_of(texel), 8, 8);
    ASSERT_FALSE(frame.ok()) << texel;
    EXPECT_NE(frame.error().message.find("sun_map_texel"), std::string::npos);
    EXPECT_EQ(frame.error().kind, world::ErrorKind::usage);
  }
}

}  // namespace
}  // namespace render
