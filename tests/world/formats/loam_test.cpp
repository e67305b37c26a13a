#include <fstream>
#include <random>

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "tests/support.h"
#include "world/formats/format.h"

namespace world {
namespace {

World sample_world() {
  World world(standard_blocks());
  std::mt19937 rng(5);
  EditBatch batch;
  batch.fill({{-200, 0, -200}, {200, 9, 200}}, *world.palette->find("stone"));
  for (int i = 0; i < 3000; ++i)
    batch.set({int(rng() % 400) - 200, int(rng() % 60), int(rng() % 400) - 200},
              static_cast<BlockId>(rng() % world.palette->size()));
  batch.set({10'000'000, -5'000'000, 123}, 1);
  EXPECT_TRUE(world.store.apply(batch).ok());
  world.environment.sky_zenith = {1.25f, 0.1f, 3.0f};
  world.metadata["seed"] = "17";
  Block imported;
  imported.name = "vox:#a1b2c3";
  imported.ignition = Kelvin{500.5};
  EXPECT_TRUE(world.palette->add(imported).ok());
  return world;
}

Result<World> load(const std::filesystem::path& path) {
  ImportReport report;
  return read_world(path, {}, report);
}

void sql(const std::filesystem::path& path, const char* text) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  char* error = nullptr;
  EXPECT_EQ(sqlite3_exec(db, text, nullptr, nullptr, &error), SQLITE_OK) << (error ? error : "");
  sqlite3_close(db);
}

TEST(LoamSave, RoundTripKeepsBlocksPaletteSurroundingsAndMetadata) {
  TemporaryFolder folder;
  const World world = sample_world();
  ASSERT_TRUE(write_world(world, folder / "a.loam").ok());
  const auto again = load(folder / "a.loam");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->store.content_hash(), world.store.content_hash());
  EXPECT_EQ(again->store.census(), world.store.census());
  EXPECT_EQ(again->store.bounds(), world.store.bounds());
  EXPECT_EQ(again->metadata, world.metadata);
  EXPECT_EQ(again->environment.sky_zenith, world.environment.sky_zenith);
  EXPECT_EQ(again->palette->size(), world.palette->size());
  const Block& imported = (*again->palette)[*again->palette->find("vox:#a1b2c3")];
  EXPECT_EQ(imported.ignition, Kelvin{500.5});
}

TEST(LoamSave, LayersExistOnlyWhereMadeAndComeBackEqual) {
  TemporaryFolder folder;
  World world = sample_world();
  EXPECT_EQ(world.store.find_layer(Layer::density), nullptr);
  FloatLayer& density = world.store.make_layer(Layer::density);
  std::mt19937 rng(2);
  for (int i = 0; i < 500; ++i)
    density.set({int(rng() % 300) - 150, int(rng() % 300) - 150, int(rng() % 9)}, static_cast<float>(rng() % 1000) / 7);
  density.set({0, 0, 0}, 0.0f);  // active, though equal to the background
  ASSERT_TRUE(write_world(world, folder / "a.loam").ok());
  const auto again = load(folder / "a.loam");
  ASSERT_TRUE(again.ok()) << again.error().message;
  const FloatLayer* loaded = again->store.find_layer(Layer::density);
  ASSERT_NE(loaded, nullptr);
  EXPECT_EQ(loaded->active_voxels(), density.active_voxels());
  EXPECT_EQ(loaded->bounds(), density.bounds());
  for (int x = -150; x < 150; ++x)
    for (int y = -150; y < 150; ++y)
      for (int z = 0; z < 9; ++z) {
        ASSERT_EQ(loaded->get({x, y, z}), density.get({x, y, z}));
        ASSERT_EQ(loaded->active({x, y, z}), density.active({x, y, z}));
      }
  world.store.drop_layer(Layer::density);
  EXPECT_EQ(world.store.find_layer(Layer::density), nullptr);
}

TEST(HardCaseIO19, SaveLoadSaveGivesTheSameBytes) {
  TemporaryFolder folder;
  ASSERT_TRUE(write_world(sample_world(), folder / "a.loam").ok());
  const auto again = load(folder / "a.loam");
  ASSERT_TRUE(again.ok());
  ASSERT_TRUE(write_world(*again, folder / "b.loam").ok());
  EXPECT_EQ(*read_file(folder / "a.loam"), *read_file(folder / "b.loam"));
}

TEST(HardCaseIO6, AFlippedPayloadIsFoundAndItsRegionNamed) {
  TemporaryFolder folder;
  ASSERT_TRUE(write_world(sample_world(), folder / "a.loam").ok());
  sql(folder / "a.loam",
      "UPDATE region SET bytes = CAST(substr(bytes, 1, 300) || x'5a' || substr(bytes, 302) AS BLOB) WHERE x = 0 AND z "
      "= 0");
  const auto broken = load(folder / "a.loam");
  ASSERT_FALSE(broken.ok());
  EXPECT_NE(broken.error().message.find("region (0, 0, 0)"), std::string::npos) << broken.error().message;
  EXPECT_NE(broken.error().message.find("a.loam"), std::string::npos);
}

TEST(HardCaseIO6, EveryFlippedByteIsReportedOrHarmless) {
  TemporaryFolder folder;
  const World world = sample_world();
  ASSERT_TRUE(write_world(world, folder / "a.loam").ok());
  const auto bytes = *read_file(folder / "a.loam");
  std::mt19937 rng(1);
  int reported = 0;
  for (int i = 0; i < 150; ++i) {
    auto flipped = bytes;
    flipped[rng() % flipped.size()] ^= static_cast<uint8_t>(1u << rng() % 8);
    std::ofstream(folder / "b.loam", std::ios::binary)
        .write(reinterpret_cast<const char*>(flipped.data()), static_cast<std::streamsize>(flipped.size()));
    const auto read = load(folder / "b.loam");
    if (!read.ok())
      ++reported;
    else
      EXPECT_EQ(read->store.content_hash(), world.store.content_hash()) << "a flip changed the world silently";
  }
  EXPECT_GT(reported, 30);  // the control: flips in payloads are the larger part of the file
}

TEST(HardCaseIO7, EveryTruncationIsAnErrorOrTheWholeWorld) {
  TemporaryFolder folder;
  const World world = sample_world();
  ASSERT_TRUE(write_world(world, folder / "a.loam").ok());
  const auto bytes = *read_file(folder / "a.loam");
  for (size_t length = 0; length < bytes.size(); length += bytes.size() / 60 + 1) {
    std::ofstream(folder / "b.loam", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(length));
    const auto read = load(folder / "b.loam");
    if (read.ok()) {
      EXPECT_EQ(read->store.content_hash(), world.store.content_hash());
    }
  }
}

TEST(HardCaseIO14, ForeignTablesAndTriggersAreRefused) {
  TemporaryFolder folder;
  ASSERT_TRUE(write_world(sample_world(), folder / "a.loam").ok());
  sql(folder / "a.loam", "CREATE TRIGGER evil AFTER INSERT ON meta BEGIN DELETE FROM region; END");
  const auto refused = load(folder / "a.loam");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("trigger"), std::string::npos) << refused.error().message;
}

TEST(HardCaseIO16, ANewerVersionIsRefusedWithASentence) {
  TemporaryFolder folder;
  ASSERT_TRUE(write_world(sample_world(), folder / "a.loam").ok());
  sql(folder / "a.loam", "PRAGMA user_version = 2");
  const auto refused = load(folder / "a.loam");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("newer Loam"), std::string::npos);
}

TEST(LoamSave, AnIdOutsideThePaletteIsRefused) {
  TemporaryFolder folder;
  ASSERT_TRUE(write_world(sample_world(), folder / "a.loam").ok());
  sql(folder / "a.loam", "DELETE FROM palette WHERE id > 5");
  EXPECT_FALSE(load(folder / "a.loam").ok());
}

TEST(HardCaseIO21, AWriteProtectedTargetIsSaidAndLeavesNothing) {
  TemporaryFolder folder;
  const auto status = write_world(sample_world(), folder / "no-such-folder/a.loam");
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("no-such-folder"), std::string::npos) << status.error().message;
  EXPECT_FALSE(std::filesystem::exists(folder / "no-such-folder"));
}

}  // namespace
}  // namespace world
