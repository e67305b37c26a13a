#include <algorithm>

#include <gtest/gtest.h>

#include "world/base/jobs.h"
#include "world/gen/generator.h"
#include "world/world.h"

namespace world {
namespace {

World made(const std::string& generator, const VoxelBox& box, uint64_t seed = 1,
           const std::map<std::string, double>& parameters = {}) {
  World world(standard_blocks());
  auto maker = make_generator(generator, seed, parameters, *world.palette);
  EXPECT_TRUE(maker.ok());
  EXPECT_TRUE(generate(world.store, **maker, box).ok());
  return world;
}

TEST(Generators, AreFoundByNameAndRefuseWhatTheyDoNotKnow) {
  const auto error = [](const std::string& name, const std::map<std::string, double>& parameters) {
    return make_generator(name, 1, parameters, standard_blocks()).error().message;
  };
  EXPECT_EQ(error("vally", {}),
            "unknown generator 'vally' (did you mean 'valley'?); there are checkerboard, empty, flat, random, valley");
  EXPECT_EQ(error("flat", {{"grund_m", 3}}), "generator 'flat' has no parameter 'grund_m' (did you mean 'ground_m'?)");
  EXPECT_EQ(error("random", {{"density", 2}}), "generator 'random': density must be in [0, 1]");
  const BlockPalette empty;
  const auto missing = make_generator("flat", 1, {}, empty);
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().message,
            "the generator needs the block 'stone', which the palette lacks; start from the standard blocks");
}

TEST(Generate, CutsTheWorldAtTheBox) {
  const VoxelBox box{{-3, 2, 5}, {130, 9, 20}};
  const World world = made("flat", box, 1, {{"ground_m", 100}});
  EXPECT_EQ(world.store.bounds(), box);
  EXPECT_EQ(world.store.voxel_count(), box.volume());
}

TEST(Generate, RefusesABoxPastTheBorderOfTheWorld) {
  World world(standard_blocks());
  const auto flat = make_generator("flat", 1, {}, *world.palette);
  ASSERT_TRUE(flat.ok());
  EXPECT_FALSE(generate(world.store, **flat, {{0, 0, 0}, {kWorldBorder, 1, 1}}).ok());
  EXPECT_TRUE(generate(world.store, **flat, {{0, 0, 0}, {-1, -1, -1}}).ok());
  EXPECT_EQ(world.store.voxel_count(), 0u);
}

TEST(Generate, TheBorderOfTheWorldCanBeReached) {
  const VoxelPos last{kWorldBorder - 1, 15, kWorldBorder - 1};
  const World world = made("valley", {last - VoxelPos{9, 9, 9}, last});
  EXPECT_EQ(world.store.voxel_count(), 1000u);
}

TEST(Flat, LaysGroundSoilAndTurf) {
  const World world = made("flat", {{0, 0, 0}, {15, 31, 15}}, 1, {{"ground_m", 10}});
  const BlockPalette& blocks = *world.palette;
  EXPECT_EQ(blocks[world.store.get({3, 10, 3})].name, "air");
  EXPECT_EQ(blocks[world.store.get({3, 9, 3})].name, "grass");
  EXPECT_EQ(blocks[world.store.get({3, 8, 3})].name, "dirt");
  EXPECT_EQ(blocks[world.store.get({3, 5, 3})].name, "stone");
  const World pond = made("flat", {{0, 0, 0}, {15, 31, 15}}, 1, {{"ground_m", 10}, {"water_depth_m", 3}});
  EXPECT_EQ(blocks[pond.store.get({3, 12, 3})].name, "water");
  EXPECT_EQ(blocks[pond.store.get({3, 13, 3})].name, "air");
  EXPECT_EQ(blocks[pond.store.get({3, 9, 3})].name, "dirt");
}

TEST(Checkerboard, FillsHalfOfSpaceWithNoTwoNeighbours) {
  const World world = made("checkerboard", {{-8, -8, -8}, {7, 7, 7}});
  EXPECT_EQ(world.store.voxel_count(), 2048u);
  for (int x = -8; x < 7; ++x)
    EXPECT_NE(world.store.get({x, 0, 0}) == kAir, world.store.get({x + 1, 0, 0}) == kAir) << x;
}

TEST(Random, FillsTheShareAskedFor) {
  const double voxels = 64.0 * 64 * 64;
  for (const double density : {0.0, 0.1, 0.5, 1.0}) {
    const World world = made("random", {{0, 0, 0}, {63, 63, 63}}, 3, {{"density", density}});
    const double sigma = std::sqrt(voxels * density * (1 - density));
    EXPECT_NEAR(static_cast<double>(world.store.voxel_count()), voxels * density, 4 * sigma);
  }
}

TEST(EveryGenerator, MakesARegionAloneAsItIsInTheWhole) {
  for (const GeneratorInfo& info : generators()) {
    const World whole = made(info.name, {{-128, 0, -128}, {127, 127, 127}});
    for (const RegionPos r : {RegionPos{-1, 0, -1}, RegionPos{0, 0, -1}, RegionPos{0, 0, 0}}) {
      const VoxelPos low = voxel_from_region(r);
      const World alone = made(info.name, {low, low + VoxelPos{127, 127, 127}});
      EXPECT_EQ(alone.store.region_census(r), whole.store.region_census(r)) << info.name;
      uint64_t different = 0;
      for (int x = 0; x < kRegionLeaves; ++x)
        for (int y = 0; y < kRegionLeaves; ++y)
          for (int z = 0; z < kRegionLeaves; ++z) {
            const LeafPos l = leaf_from_region(r) + LeafPos{x, y, z};
            const LeafBlocks a = alone.store.leaf(l), b = whole.store.leaf(l);
            for (int v = 0; v < kLeafVoxels; ++v) different += a[v] != b[v];
          }
      EXPECT_EQ(different, 0u) << info.name << ' ' << r.x << ' ' << r.z;
    }
  }
}

TEST(EveryGenerator, GivesTheSameWorldForAnyNumberOfThreads) {
  for (const GeneratorInfo& info : generators()) {
    const VoxelBox box{{-64, 32, -64}, {63, 95, 191}};
    const uint64_t many = made(info.name, box).store.content_hash();
    const ThreadLimit one(1);
    EXPECT_EQ(made(info.name, box).store.content_hash(), many) << info.name;
  }
}

}  // namespace
}  // namespace world
