/// A fog volume by itself is shown as fog.
#include "world/scenes/fog.h"

#include <gtest/gtest.h>

#include "tests/support.h"
#include "world/scenes/scene.h"

namespace world {
namespace {

Result<World> world_of(const std::filesystem::path& path) {
  TRY(const Scene scene, load_scene(path.string()));
  ImportReport report;
  return build_world(scene, report);
}

TEST(Fog, AFileOfAFogVolumeBecomesAMediumOverItsLayerWithNoBlocks) {
  for (const char* file : {"vdb/smoke.vdb", "vdb/wdas_cloud_sixteenth.vdb", "nvdb/smoke-blosc.nvdb"}) {
    SCOPED_TRACE(file);
    const auto path = shared_data(file);
    if (!path) GTEST_SKIP();
    auto world = world_of(*path);
    ASSERT_TRUE(world.ok()) << world.error().message;
    ASSERT_TRUE(is_fog(*world));
    const VoxelBox bounds = world->store.bounds();
    ASSERT_TRUE(show_fog(*world).ok());
    EXPECT_EQ(world->store.voxel_count(), 0u);
    ASSERT_EQ(world->media.size(), 1u);
    const Medium& fog = world->media[0];
    ASSERT_TRUE(fog.field);
    EXPECT_EQ(fog.field->density({10.5, 40.5, 30.5}), world->store.find_layer(Layer::density)->get({10, 40, 30}));
    // Seen through the middle it is thick, and past its side there is none.
    const Vec3d low(bounds.min.x, bounds.min.y, bounds.min.z), high(bounds.max.x, bounds.max.y, bounds.max.z);
    double deepest = 0;
    for (int i = 1; i < 10; ++i)
      for (int j = 1; j < 10; ++j) {
        const Vec3d from(low.x + (high.x - low.x) * i / 10, low.y + (high.y - low.y) * j / 10, low.z - 1);
        deepest = std::max(
            deepest, (fog.scattering.g + fog.absorption.g) * medium_depth(fog, from, {0, 0, 1}, 0, high.z - low.z + 2));
      }
    EXPECT_GT(deepest, 3);
    EXPECT_LT(deepest, 300);
    EXPECT_EQ(medium_depth(fog, low - Vec3d(5), {0, 0, 1}, 0, 1000), 0);
    const auto camera = camera_of(*world, "");
    ASSERT_TRUE(camera.ok());
    const Vec3d middle = WorldPoint{bounds.min, Vec3d(0.0)} - camera->position + 0.5 * (high - low);
    EXPECT_GT(glm::dot(glm::normalize(middle), camera->forward), 0.9);
  }
}

TEST(Fog, OtherFilesAreLeftAsTheyAre) {
  for (const char* file : {"vdb/sphere.vdb", "vdb/sphere_points.vdb"}) {
    const auto path = shared_data(file);
    if (!path) GTEST_SKIP();
    auto world = world_of(*path);
    ASSERT_TRUE(world.ok()) << world.error().message;
    EXPECT_FALSE(is_fog(*world));
    const auto hash = world->store.content_hash();
    ASSERT_TRUE(show_fog(*world).ok());
    EXPECT_EQ(world->store.content_hash(), hash);
    EXPECT_TRUE(world->media.empty());
  }
}

}  // namespace
}  // namespace world
