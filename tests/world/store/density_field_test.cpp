// The density layer of a world as a field that rays sample.
#include "world/store/density_field.h"

#include <fstream>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "world/scenes/scene.h"

namespace world {
namespace {

TEST(DensityFieldOfALayer, HasTheValuesOfTheLayer) {
  FloatLayer layer;
  for (int i = 0; i < 3000; ++i) {
    const VoxelPos v{i * 37 % 101 - 50, i * 53 % 97 - 40, i * 29 % 89 - 30};
    layer.set(v, static_cast<float>(i % 7));
  }
  const auto field = density_field(layer, FieldSampling::nearest, "test");
  ASSERT_TRUE(field.ok()) << field.error().message;
  EXPECT_EQ((*field)->max(), 6);
  for (int x = -55; x < 55; ++x)
    for (int y = -45; y < 60; y += 3)
      for (int z = -35; z < 60; ++z)
        ASSERT_EQ((*field)->density({x + 0.5, y + 0.5, z + 0.5}), layer.get({x, y, z})) << x << ' ' << y << ' ' << z;
}

TEST(DensityFieldOfALayer, NegativeValuesAreRefusedByVoxel) {
  FloatLayer layer;
  layer.set({1, -2, 3}, -0.25f);
  const auto field = density_field(layer, FieldSampling::nearest, "s.toml:3:1");
  ASSERT_FALSE(field.ok());
  EXPECT_EQ(field.error().message,
            "s.toml:3:1: the density at voxel (1, -2, 3) is -0.25, but must be finite and at least 0");
}

/// A scene of an imported file and a medium of its density.
Result<World> fog_scene(const TemporaryFolder& folder, const std::filesystem::path& file,
                        const std::string& more = "") {
  std::ofstream(folder / "s.toml") << "[world]\nfile = \"" << file.string() << "\"\n"
                                   << more
                                   << "[[medium]]\nname = \"smoke\"\nkind = \"density_grid\"\nlayer = \"density\"\n"
                                      "scattering_per_m = 1\nvoxel_size_m = 0.5\n";
  TRY(const Scene scene, load_scene((folder / "s.toml").string()));
  ImportReport report;
  return build_world(scene, report);
}

TEST(DensityFieldOfALayer, AnImportedFogVolumeIsTheMediumOfItsScene) {
  const auto path = shared_data("vdb/smoke.vdb");
  if (!path) return;
  const TemporaryFolder folder;
  const auto world = fog_scene(folder, std::filesystem::absolute(*path), "offset = [128, 0, 0]\n");
  ASSERT_TRUE(world.ok()) << world.error().message;
  ASSERT_EQ(world->media.size(), 1u);
  const Medium& medium = world->media[0];
  ASSERT_NE(medium.field, nullptr);
  EXPECT_EQ(medium.field->max(), 5.71484375f);  // facts
  EXPECT_EQ(medium.position.voxel, (VoxelPos{128, 0, 0}));
  // The layer comes along with the blocks.
  const FloatLayer* layer = world->store.find_layer(Layer::density);
  ASSERT_NE(layer, nullptr);
  EXPECT_EQ(layer->active_voxels(), 1049275u);
  EXPECT_EQ(layer->bounds().min, (VoxelPos{129, 2, 1}));
  EXPECT_EQ(layer->get({128 + 40, 60, 50}), medium.field->density({40.5, 60.5, 50.5}));
  // All columns of voxels, each 1 m^2 of the field's own: the sum of active values that facts say, 171499.695521.
  double sum = 0;
  for (int x = 0; x < 120; ++x)
    for (int z = 0; z < 120; ++z) sum += medium.field->depth({x + 0.5, -10, z + 0.5}, {0, 1, 0}, 0, 300);
  EXPECT_NEAR(sum, 171499.695521, 0.1);
  // Half a metre a voxel: half of the depth in metres.
  const double depth = medium_depth(medium, {28, -5, 28}, {0, 1, 0}, 0, 150);
  EXPECT_NEAR(depth, 0.5 * medium.field->depth({56, -10, 56}, {0, 1, 0}, 0, 300), 1e-9 * depth);
  EXPECT_GT(depth, 1);
}

TEST(DensityFieldOfALayer, AFileWithoutFogIsAnErrorThatNamesTheMedium) {
  const auto path = shared_data("vox/T-Rex.vox");
  if (!path) return;
  const TemporaryFolder folder;
  const auto world = fog_scene(folder, std::filesystem::absolute(*path));
  ASSERT_FALSE(world.ok());
  EXPECT_NE(world.error().message.find("s.toml:3:1: the world has no density layer"), std::string::npos)
      << world.error().message;
}

}  // namespace
}  // namespace world
