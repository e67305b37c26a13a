#include <cmath>

#include <gtest/gtest.h>

#include "world/base/simd.h"
#include "world/gen/generator.h"
#include "world/world.h"

namespace world {
namespace {

World valley(const VoxelBox& box, uint64_t seed, const std::map<std::string, double>& parameters = {}) {
  World world(standard_blocks());
  auto generator = make_generator("valley", seed, parameters, *world.palette);
  EXPECT_TRUE(generator.ok());
  EXPECT_TRUE(generate(world.store, **generator, box).ok());
  return world;
}

/// The part of the default scene around its lake; made once.
const World& scene() {
  static const World world = valley({{-256, 0, -256}, {255, 255, 255}}, 1);
  return world;
}
uint64_t count(const World& world, const char* block) {
  const Census census = world.store.census();
  const auto found = census.find(*world.palette->find(block));
  return found == census.end() ? 0 : found->second;
}
bool is(const World& world, VoxelPos v, const char* block) { return world.store.get(v) == *world.palette->find(block); }

TEST(Valley, HoldsEachFeatureThatItPromises) {
  for (const char* block :
       {"stone",      "granite",    "coal_ore",   "iron_ore",     "copper_ore", "gold_ore",     "water",
        "sand",       "gravel",     "mud",        "clay",         "dirt",       "grass",        "snow",
        "glowstone",  "oak_log",    "oak_leaves", "birch_leaves", "pine_log",   "pine_needles", "reed",
        "tall_grass", "flower_red", "fence_oak",  "lamp_warm",    "lantern",    "glass",        "oak_planks"})
    EXPECT_GT(count(scene(), block), 0u) << block;
}

TEST(Valley, TakesAtMostHalfAByteACubicMetre) {
  const double volume = 512.0 * 256 * 512;
  EXPECT_LE(static_cast<double>(scene().store.bytes_memory()), 0.5 * volume);
}

TEST(Valley, StartsWithItsWaterAtRest) {
  const World& world = scene();
  const BlockId water = *world.palette->find("water");
  for (const LeafPos l : world.store.mixed_leaves()) {
    const LeafBlocks blocks = world.store.leaf(l);
    for (int v = 0; v < kLeafVoxels; ++v) {
      if (blocks[v] != water) continue;
      const VoxelPos p = voxel_from_leaf(l) + offset_in_leaf(v);
      ASSERT_LE(p.y, 63);
      for (const int face : {kFaceNegX, kFacePosX, kFaceNegY, kFaceNegZ, kFacePosZ}) {
        const VoxelPos q = p + face_step(face);
        const bool inside = q.x >= -256 && q.x < 256 && q.y >= 0 && q.z >= -256 && q.z < 256;
        ASSERT_TRUE(!inside || world.store.get(q) != kAir) << "water runs out at " << p.x << ' ' << p.y << ' ' << p.z;
      }
    }
  }
}

/// The highest voxel that is rock, soil or snow.
int ground_top(const World& world, int x, int z) {
  for (int y = 255; y >= 0; --y) {
    const Block& block = (*world.palette)[world.store.get({x, y, z})];
    if (block.density.value > 1000 && block.phase != Phase::liquid) return y;
  }
  return -1;
}

TEST(Valley, HasOverhangsAndCaves) {
  const World& world = scene();
  int overhangs = 0, deep_holes = 0;
  for (int x = -256; x < 256; x += 4)
    for (int z = -256; z < 256; z += 4) {
      const int top = ground_top(world, x, z);
      bool under = false;
      for (int y = top; y > 64; --y) {
        if (world.store.get({x, y, z}) != kAir) continue;
        under = true;
        deep_holes += top - y > 16;
      }
      overhangs += under;
    }
  EXPECT_GT(overhangs, 100);
  EXPECT_GT(deep_holes, 100);
}

/// A crown that a region's border cut off would leave a flat wall there: more leaf-to-air steps across borders than
/// across other planes.
TEST(Valley, CrownsCrossTheBordersOfRegions) {
  const World& world = scene();
  const auto steps_across = [&](int x) {
    int steps = 0;
    for (int y = 60; y < 160; ++y)
      for (int z = -256; z < 256; ++z) {
        const auto leaf = [&](int at) {
          const std::string& name = (*world.palette)[world.store.get({at, y, z})].name;
          return name.find("leaves") != std::string::npos || name.find("needles") != std::string::npos;
        };
        steps += leaf(x - 1) != leaf(x);
      }
    return steps;
  };
  // Trees have places of 8 m, so planes at multiples of 8 m are like each other.
  double elsewhere = 0, squares = 0;
  int planes = 0;
  for (int x = -248; x < 256; x += 8) {
    if (x % 128 == 0) continue;
    const double steps = steps_across(x);
    elsewhere += steps, squares += steps * steps, ++planes;
  }
  const double mean = elsewhere / planes, deviation = std::sqrt(squares / planes - mean * mean);
  for (const int border : {-128, 0, 128}) EXPECT_LE(steps_across(border), mean + 3 * deviation) << border;
}

TEST(Valley, EveryTrunkStandsOnGround) {
  const World& world = scene();
  int trunks = 0;
  for (const LeafPos l : world.store.mixed_leaves()) {
    const LeafBlocks blocks = world.store.leaf(l);
    for (int v = 0; v < kLeafVoxels; ++v) {
      const VoxelPos p = voxel_from_leaf(l) + offset_in_leaf(v);
      const auto is_log = [&](VoxelPos q) {
        return (*world.palette)[world.store.get(q)].name.find("_log") != std::string::npos;
      };
      if ((*world.palette)[blocks[v]].name.find("_log") == std::string::npos || p.y == 0) continue;
      if (is_log(p + VoxelPos{0, -1, 0})) continue;
      // Branches of great oaks hang on their trunk: some neighbour, diagonals included, is wood.
      int wood = 0;
      for (int n = 0; n < 27; ++n) wood += n != 13 && is_log(p + VoxelPos{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1});
      ASSERT_TRUE(world.store.get(p + VoxelPos{0, -1, 0}) != kAir || wood > 0) << p.x << ' ' << p.y << ' ' << p.z;
      ++trunks;
    }
  }
  EXPECT_GT(trunks, 200);
}

TEST(Valley, ParametersTakeFeaturesAway) {
  const VoxelBox box{{-128, 0, -128}, {127, 255, 127}};
  const World bare = valley(box, 1, {{"trees", 0}, {"caves", 0}, {"homesteads", 0}});
  EXPECT_EQ(count(bare, "oak_log"), 0u);
  EXPECT_EQ(count(bare, "pine_needles"), 0u);
  EXPECT_EQ(count(bare, "lava"), 0u);
  EXPECT_EQ(count(bare, "fence_oak"), 0u);
}

TEST(Valley, FillsItsDeepestCavesWithWaterOrWithLava) {
  const VoxelBox box{{0, 0, 0}, {127, 127, 127}};
  const World cool = valley(box, 1), hot = valley(box, 1, {{"lava", 1}});
  EXPECT_EQ(count(cool, "lava"), 0u);
  EXPECT_GT(count(hot, "lava"), 0u);
  EXPECT_EQ(count(cool, "water"), count(hot, "water") + count(hot, "lava"));
}

TEST(Valley, IsSolidGraniteBelowItsLowestCavesAndAirAboveItsPeaks) {
  const World deep = valley({{0, -128, 0}, {127, -1, 127}}, 1);
  EXPECT_EQ(deep.store.voxel_count(), 128u * 128 * 128);
  EXPECT_TRUE(is(deep, {5, -1, 5}, "granite"));
  EXPECT_EQ(valley({{-512, 256, 0}, {-385, 383, 127}}, 1).store.voxel_count(), 0u);
}

/// The blocks of a region, hashed by position and name: any other machine, compiler, SIMD level or number of threads
/// gives these bits. A change of the landscape changes them; a change of anything else must not.
TEST(Valley, HasTheSameBitsOnEveryMachineAndSimdLevel) {
  for (const SimdLevel& level : simd_levels()) {
    const SimdChoice choice(level);
    const World region = valley({{0, 0, 0}, {127, 127, 127}}, 1);
    EXPECT_EQ(region.store.content_hash(), 0xf193fe546a630496ull)
        << level.name << std::hex << ' ' << region.store.content_hash();
  }
  const World far = valley({{12550784, 0, -12550912}, {12550911, 127, -12550785}}, 7);
  EXPECT_EQ(far.store.content_hash(), 0x3f6aaaba6151b8f8ull) << std::hex << far.store.content_hash();
}

}  // namespace
}  // namespace world
