#include <cmath>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "world/formats/format.h"

namespace world {
namespace {

TEST(VdbDensity, TheNumbersOfAFogVolumeBecomeALayerAndSurviveASave) {
  const auto file = shared_data("vdb/dragon.vdb");
  if (!file) GTEST_SKIP();
  TemporaryFolder folder;
  ImportReport report;
  const auto world = read_world(*file, {}, report);
  ASSERT_TRUE(world.ok()) << world.error().message;
  ASSERT_TRUE(write_world(*world, folder / "a.loam").ok());
  const auto again = read_world(folder / "a.loam", {}, report);
  ASSERT_TRUE(again.ok()) << again.error().message;
  for (const World* w : {&*world, &*again}) {
    const FloatLayer* density = w->store.find_layer(Layer::density);
    ASSERT_NE(density, nullptr);
    EXPECT_EQ(density->active_voxels(), 19660u);  // FACTS.md
    EXPECT_EQ(density->bounds(), (VoxelBox{{16, 1, 35}, {85, 49, 65}}));
    double sum = 0;
    for (int x = 16; x <= 85; ++x)
      for (int y = 1; y <= 49; ++y)
        for (int z = 35; z <= 65; ++z) sum += density->get({x, y, z});
    EXPECT_NEAR(sum, 10186.8611597, 1e-3);
  }
}

TEST(VdbDensity, ALevelSetMakesALayerOfDistancesInVoxelsThatItsBlocksAgreeWith) {
  const auto file = shared_data("vdb/sphere.vdb");
  if (!file) GTEST_SKIP();
  ImportReport report;
  const auto world = read_world(*file, {}, report);
  ASSERT_TRUE(world.ok()) << world.error().message;
  EXPECT_EQ(world->store.find_layer(Layer::density), nullptr);
  const FloatLayer* distance = world->store.find_layer(Layer::distance);
  ASSERT_NE(distance, nullptr);
  // Half the band is 3 voxels wide, and a unit steep in voxels: its active values reach that far.
  float largest = 0;
  uint64_t active = 0;
  std::vector<float> values(kLeafVoxels);
  for (const LeafPos& leaf : distance->leaves()) {
    distance->read_cube(voxel_from_leaf(leaf), kLeafSize, NAN, values);
    for (int i = 0; i < kLeafVoxels; ++i) {
      const float value = values[static_cast<size_t>(i)];
      if (std::isnan(value)) continue;
      ++active;
      largest = std::max(largest, std::abs(value));
      ASSERT_EQ(world->store.get(voxel_from_leaf(leaf) + offset_in_leaf(i)) != kAir, value <= 0);
    }
  }
  EXPECT_EQ(active, distance->active_voxels());
  EXPECT_GT(largest, 2.9f);
  EXPECT_LE(largest, 3);
}

}  // namespace
}  // namespace world
