// Worlds written and read again: what the format can hold comes back voxel by voxel and block by block.
#include <gtest/gtest.h>

#include "tests/world/formats/formats_support.h"
#include "world/formats/translation/translation.h"
#include "world/formats/vox.h"

namespace world {
namespace {

/// A world of boxes and specks of the given blocks, anywhere within `reach`.
World random_world(uint32_t seed, const std::vector<BlockId>& blocks, const BlockPalette& palette, int reach) {
  std::mt19937 random(seed);
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<uint32_t>(n)); };
  World world(palette);
  EditBatch batch;
  for (int box = 0; box < 6; ++box) {
    const VoxelPos corner{below(2 * reach) - reach, below(2 * reach) - reach, below(2 * reach) - reach};
    const VoxelPos size{1 + below(20), 1 + below(20), 1 + below(20)};
    const BlockId block = blocks[static_cast<size_t>(below(static_cast<int>(blocks.size())))];
    const bool mixed = below(2);
    for (int x = 0; x < size.x; ++x)
      for (int y = 0; y < size.y; ++y)
        for (int z = 0; z < size.z; ++z)
          batch.set(corner + VoxelPos{x, y, z},
                    mixed ? blocks[static_cast<size_t>(below(static_cast<int>(blocks.size())))] : block);
  }
  EXPECT_TRUE(world.store.apply(batch));
  return world;
}

void expect_same(const World& a, const World& b) {
  EXPECT_EQ(a.store.content_hash(), b.store.content_hash());
  EXPECT_EQ(a.store.voxel_count(), b.store.voxel_count());
  EXPECT_EQ(a.store.bounds(), b.store.bounds());
  for (const auto& [id, count] : a.store.census()) {
    const Block& block = (*a.palette)[id];
    const auto there = b.palette->find(block.name);
    ASSERT_TRUE(there) << block.name;
    EXPECT_EQ(toml_from_block((*b.palette)[*there]), toml_from_block(block));
  }
}

void expect_round_trip(const World& world, const std::string& file) {
  TemporaryFolder folder;
  const Status written = write_world(world, folder / file);
  ASSERT_TRUE(written) << written.error().message;
  ImportReport report;
  const auto read = read_world(folder / file, {.strict = true}, report);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(report.unmapped.empty());
  expect_same(world, *read);
}

/// Loam's blocks, blocks of other games, and colours of .vox files.
BlockPalette many_blocks() {
  BlockPalette palette = standard_blocks();
  Translator minecraft(translation_table("minecraft"), palette);
  for (const char* state : {"minecraft:oak_slab[type=top]", "minecraft:chest[facing=east]", "minecraft:water[level=5]",
                            "minecraft:spruce_stairs[facing=west,half=top]", "somemod:unknown"})
    minecraft.block(state);
  std::mt19937 random(7);
  for (int i = 1; i < 40; ++i) {
    const auto byte = [&] { return static_cast<uint8_t>(random()); };
    static const std::vector<vox::Dictionary> kMaterials = {
        {},
        {{"_type", "_metal"}, {"_rough", "0.25"}, {"_metal", "0.5"}},
        {{"_type", "_glass"}, {"_ri", "1.52"}},
        {{"_type", "_media"}, {"_d", "0.3"}},
        {{"_type", "_emit"}, {"_emit", "0.5"}, {"_flux", "2"}}};
    EXPECT_TRUE(palette.add(block_of_colour(i * 6, {byte(), byte(), byte(), 255}, kMaterials[i % 5u])));
  }
  return palette;
}

std::vector<BlockId> some_of(const BlockPalette& palette, uint32_t seed, size_t count) {
  std::mt19937 random(seed);
  std::vector<BlockId> some;
  while (some.size() < count) some.push_back(static_cast<BlockId>(1 + random() % (palette.size() - 1)));
  return some;
}

TEST(RoundTrip, AnyWorldOfUpTo255KindsOfBlockComesBackFromVox) {
  const BlockPalette palette = many_blocks();
  for (uint32_t seed = 0; seed < 24; ++seed) {
    SCOPED_TRACE(seed);
    expect_round_trip(random_world(seed, some_of(palette, seed, 1 + seed * 8), palette, seed < 12 ? 40 : 700), "a.vox");
  }
}

TEST(RoundTrip, AnyWorldComesBackFromSchem) {
  const BlockPalette palette = many_blocks();
  for (uint32_t seed = 0; seed < 24; ++seed) {
    SCOPED_TRACE(seed);
    expect_round_trip(random_world(seed, some_of(palette, seed, 1 + seed * 12), palette, seed < 20 ? 40 : 150),
                      "a.schem");
  }
}

TEST(RoundTrip, AnEmptyWorldComesBack) {
  for (const char* file : {"a.vox", "a.schem"}) {
    SCOPED_TRACE(file);
    expect_round_trip(World(standard_blocks()), file);
  }
}

TEST(RoundTrip, RealFilesComeBack) {
  for (const char* name : {"vox/test-transform.vox", "vox/test_multiple_model_scene.vox",
                           "vox/placeholder-with-materials.vox", "schem/smallhouse1.schem", "schem/mansion.litematic",
                           "schem/9383.schematic", "qb/robo.qb", "luanti/apple_tree.mts"}) {
    SCOPED_TRACE(name);
    const auto path = shared_data(name);
    if (!path) GTEST_SKIP();
    ImportReport report;
    const auto world = read_world(*path, {}, report);
    ASSERT_TRUE(world) << world.error().message;
    expect_round_trip(*world, "a.vox");
    expect_round_trip(*world, "a.schem");
  }
}

TEST(VoxWriter, MoreLooksThanColoursIsAnErrorThatSaysWhatToDo) {
  BlockPalette palette;
  EditBatch batch;
  for (int i = 0; i < 300; ++i) {
    Block block;
    block.name = "test:" + std::to_string(i);
    block.albedo = {0.1f + 0.8f * static_cast<float>(i % 20) / 20, 0.1f + 0.8f * static_cast<float>(i / 20) / 20, 0.5f};
    batch.set({i, 0, 0}, palette.add(block).value());
  }
  World world(palette);
  ASSERT_TRUE(world.store.apply(batch));
  TemporaryFolder folder;
  const Status written = write_world(world, folder / "a.vox");
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().message.find(".loam"), std::string::npos) << written.error().message;
}

TEST(VoxWriter, BlocksThatLookAlikeShareAColourAndItIsSaid) {
  BlockPalette palette;
  EditBatch batch;
  for (int i = 0; i < 300; ++i) {
    Block block;
    block.name = "test:" + std::to_string(i);
    block.albedo = {0.1f + 0.8f * static_cast<float>(i % 20) / 20, 0.3f, 0.5f};
    batch.set({i, 0, 0}, palette.add(block).value());
  }
  World world(palette);
  ASSERT_TRUE(world.store.apply(batch));
  EXPECT_EQ(vox_losses(world).size(), 1u);
  TemporaryFolder folder;
  ASSERT_TRUE(write_world(world, folder / "a.vox"));
  ImportReport report;
  EXPECT_EQ(read_world(folder / "a.vox", {}, report)->store.voxel_count(), 300u);
}

TEST(SchemWriter, LoamsBlocksBearMinecraftsNames) {
  World world(standard_blocks());
  EditBatch batch;
  batch.set({0, 0, 0}, world.palette->find("wool_light_grey").value());
  batch.set({1, 0, 0}, world.palette->find("granite").value());
  batch.set({2, 0, 0}, world.palette->find("lamp_warm").value());
  ASSERT_TRUE(world.store.apply(batch));
  TemporaryFolder folder;
  ASSERT_TRUE(write_world(world, folder / "a.schem"));
  ImportReport report;
  ASSERT_TRUE(read_world(folder / "a.schem", {.count_states = true}, report));
  EXPECT_EQ(report.states, (std::map<std::string, uint64_t>{
                               {"minecraft:light_gray_wool", 1}, {"minecraft:granite", 1}, {"loam:lamp_warm", 1}}));
}

}  // namespace
}  // namespace world
