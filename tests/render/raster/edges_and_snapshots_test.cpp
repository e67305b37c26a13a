/// Hard cases G10 and S9: rays through exact edges of shapes, and pictures of a world that moves between them.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/small_worlds.h"
#include "world/proxies/proxy.h"

namespace render {
namespace {

class HardCases : public BothBackends {};

/// Odd, so that the middle pixel looks along the camera's axis.
constexpr int kSide = 33;

/// A shape in a voxel on a floor before a wall, each of its own colour.
world::World one_shape(const std::string& proxy) {
  world::World w(world::standard_blocks());
  // A pixel tells the block that it shows and no more: faces of all directions are as bright.
  w.environment.sun_irradiance = {};
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {4, 4, 4};
  world::EditBatch batch;
  batch.fill({{-8, -8, -4}, {8, 8, -4}}, block(w, "brick_red"));
  batch.fill({{-8, -1, -4}, {8, -1, 8}}, block(w, "grass"));
  batch.set({0, 0, 0}, shaped(w, proxy, {0.1f, 0.3f, 0.8f}));
  apply(w, batch);
  return w;
}

bool near_in(const Image& image, int x, int y, const Rgb& colour) {
  for (int row = std::max(y - 1, 0); row <= std::min(y + 1, kSide - 1); ++row)
    for (int column = std::max(x - 1, 0); column <= std::min(x + 1, kSide - 1); ++column) {
      const Rgb& p = image.at(column, row);
      if (std::abs(p.r - colour.r) + std::abs(p.g - colour.g) + std::abs(p.b - colour.b) <
          0.01f * (colour.r + colour.g + colour.b))
        return true;
    }
  return false;
}

/// The axis of each camera lies in a plane of the voxel, or in one of those where posts end.
TEST_F(HardCases, G10_RaysThroughExactEdgesOfShapesMeetOneOfTheBlocksThere) {
  RenderKnobs knobs;
  knobs.textures = TextureFilter::off, knobs.sun_shadow = SunShadow::none, knobs.lod_error_px = 0;
  size_t differ = 0;
  for (const world::Proxy& proxy : world::proxies()) {
    const world::World w = one_shape(proxy.name);
    for (const double sixteenths : {0.0, 6.0}) {
      const double edge = sixteenths / 16;
      for (const Camera& camera : {camera_at({}, {edge, edge, 3}, {0, 0, -1}, 30),
                                   camera_at({}, {edge - 3, edge + 3, edge + 3}, {1, -1, -1}, 30)}) {
        const Image a = draw(*raster_, w, camera, knobs, kSide, kSide).image;
        const Image b = draw(*raycast_, w, camera, knobs, kSide, kSide).image;
        for (int y = 0; y < kSide; ++y)
          for (int x = 0; x < kSide; ++x) {
            if (a.at(x, y) == b.at(x, y)) continue;
            ++differ;
            EXPECT_TRUE(near_in(b, x, y, a.at(x, y)) && near_in(a, x, y, b.at(x, y)))
                << proxy.name << " at " << edge << ", pixel " << x << " " << y;
          }
      }
    }
  }
  EXPECT_GT(differ, 0u) << "no ray met an edge";
}

/// While a picture is made the store refuses edits (tests/world/store/store_test.cpp), so that its shadows are of what
/// its first rays meet. Here: nothing of a body's or a wall's last place is in the next picture.
TEST_F(HardCases, S9_ShadowsAreOfTheMomentThatIsSeen) {
  const auto world_at = [](int wall_x) {
    world::World w(world::standard_blocks());
    w.environment.sun_direction = glm::normalize(Vec3d(0.8, 1, 0.1));
    world::EditBatch batch;
    batch.fill({{-12, -1, -12}, {12, -1, 12}}, block(w, "plaster"));
    batch.fill({{wall_x, 0, -6}, {wall_x, 5, 6}}, block(w, "stone"));
    apply(w, batch);
    return w;
  };
  const auto move_wall = [](world::World& w, int from, int to) {
    world::EditBatch batch;
    batch.fill({{from, 0, -6}, {from, 5, 6}}, world::kAir);
    batch.fill({{to, 0, -6}, {to, 5, 6}}, block(w, "stone"));
    return w.store.apply(batch).ok();
  };
  const Camera camera = camera_at({}, {-9.3, 9.2, 10.4}, {0.8, -0.9, -0.9});
  const BodyRecord before{-3, 0.6f, 0, 0.5f, 0.5f, 0.5f, {0.7f, 0.3f, 0.2f}};
  BodyRecord after = before;
  after.x = 3.5f, after.y = 1.1f;  // from the wall's shadow into the sun, in a step longer than itself
  for (Backend* moving : {static_cast<Backend*>(raster_.get()), raycast_.get()}) {
    world::World w = world_at(0);
    moving->inhabitants = {{0, 0, 0}, {}, {&before, 1}};
    const Image first = draw(*moving, w, camera, {}, 160, 90).image;
    ASSERT_TRUE(move_wall(w, 0, 2));
    moving->inhabitants = {{0, 0, 0}, {}, {&after, 1}};
    const Image second = draw(*moving, w, camera, {}, 160, 90).image;
    EXPECT_LT(share_within(first, second, 2), 0.97);
    // As a backend has it that knows nothing of the moment before.
    const world::World fresh_world = world_at(2);
    auto fresh = moving == raycast_.get() ? make_raycast_backend() : make_raster_backend();
    ASSERT_TRUE(fresh.ok());
    (*fresh)->inhabitants = moving->inhabitants;
    EXPECT_TRUE(same(draw(**fresh, fresh_world, camera, {}, 160, 90).image, second));
    moving->inhabitants = {};
  }
}

}  // namespace
}  // namespace render
