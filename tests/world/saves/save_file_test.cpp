#include "world/saves/save_file.h"

#include <xxhash.h>

#include "tests/world/saves/saves_support.h"
#include "world/saves/check.h"
#include "world/store/region_stream.h"

namespace world {
namespace {

void expect_equal_palettes(const BlockPalette& a, const BlockPalette& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t id = 0; id < a.size(); ++id)
    EXPECT_EQ(toml_from_block(a[static_cast<BlockId>(id)]), toml_from_block(b[static_cast<BlockId>(id)]));
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

TEST(LoamSave, LayersOfIntegersComeBackEqualToTheLastBit) {
  TemporaryFolder folder;
  World world = sample_world();
  std::mt19937 rng(3);
  for (const Layer layer : {Layer::liquid, Layer::gas, Layer::heat, Layer::growth}) {
    IntLayer& values = world.store.make_int_layer(layer);
    for (int i = 0; i < 500; ++i)
      values.set({int(rng() % 300) - 150, int(rng() % 300) - 150, int(rng() % 9)}, static_cast<int32_t>(rng()));
    for (const int32_t value : {0, INT32_MIN, INT32_MAX}) values.set({value & 7, 500, 1}, value);
  }
  ASSERT_TRUE(write_world(world, folder / "a.loam").ok());
  EXPECT_TRUE(check_save(folder / "a.loam")->clean());
  const auto again = load(folder / "a.loam");
  ASSERT_TRUE(again.ok()) << again.error().message;
  for (const Layer layer : {Layer::liquid, Layer::gas, Layer::heat, Layer::growth}) {
    const IntLayer &a = *world.store.find_int_layer(layer), &b = *again->store.find_int_layer(layer);
    ASSERT_EQ(a.leaves(), b.leaves());
    for (const LeafPos& l : a.leaves()) {
      std::array<int32_t, kLeafVoxels> x, y;
      LeafMask active_x, active_y;
      ASSERT_TRUE(a.read_leaf(l, x, active_x) && b.read_leaf(l, y, active_y));
      ASSERT_EQ(x, y);
      ASSERT_EQ(active_x, active_y);
    }
  }
  EXPECT_EQ(again->store.find_layer(Layer::density), nullptr);
  // A value that was damaged is found, and its layer named; a repair keeps the rest.
  sql(folder / "a.loam", "UPDATE region SET bytes = zeroblob(length(bytes)) WHERE layer = 'heat' AND x = 0 AND y = 0");
  const auto broken = load(folder / "a.loam");
  ASSERT_FALSE(broken.ok());
  EXPECT_NE(broken.error().message.find("layer heat, region (0, 0, 0)"), std::string::npos) << broken.error().message;
  ASSERT_TRUE(repair_save(folder / "a.loam").ok());
  const auto repaired = load(folder / "a.loam");
  ASSERT_TRUE(repaired.ok()) << repaired.error().message;
  EXPECT_EQ(repaired->store.find_int_layer(Layer::liquid)->active_voxels(),
            world.store.find_int_layer(Layer::liquid)->active_voxels());
  EXPECT_LT(repaired->store.find_int_layer(Layer::heat)->active_voxels(),
            world.store.find_int_layer(Layer::heat)->active_voxels());
}

TEST(LoamSave, ALayerOfAnotherTypeIsRefused) {
  TemporaryFolder folder;
  World world = sample_world();
  world.store.make_int_layer(Layer::heat).set({1, 2, 3}, 4);
  ASSERT_TRUE(write_world(world, folder / "a.loam").ok());
  auto file = SaveFile::open(folder / "a.loam", SaveFile::Access::edit);
  ASSERT_TRUE(file.ok());
  auto row = (*file)->read_row(Layer::heat, {0, 0, 0});
  ASSERT_TRUE(row.ok() && *row);
  (*row)->layer = Layer::density;  // whose values are floats; its hash is right all the same
  auto transaction = SaveFile::Transaction::begin(**file);
  ASSERT_TRUE((*transaction)->put(std::move(**row)).ok());
  ASSERT_TRUE((*transaction)->commit().ok());
  transaction = input_error("done");
  file = input_error("closed");
  const auto refused = load(folder / "a.loam");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("does not hold exactly one grid of floats"), std::string::npos)
      << refused.error().message;
  EXPECT_FALSE(check_save(folder / "a.loam")->clean());
}

TEST(HardCaseIO19, SaveLoadSaveGivesTheSameBytes) {
  TemporaryFolder folder;
  World world = sample_world();
  for (int i = 0; i < 200; ++i) world.store.make_int_layer(Layer::liquid).set({i * 7, 3, i % 5}, i - 100);
  ASSERT_TRUE(write_world(world, folder / "a.loam").ok());
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
  for (int i = 0; i < 100; ++i) {
    auto flipped = bytes;
    flipped[rng() % flipped.size()] ^= static_cast<uint8_t>(1u << rng() % 8);
    std::ofstream(folder / "b.loam", std::ios::binary)
        .write(reinterpret_cast<const char*>(flipped.data()), static_cast<std::streamsize>(flipped.size()));
    const auto read = load(folder / "b.loam");
    if (!read.ok()) {
      ++reported;
      continue;
    }
    EXPECT_EQ(read->store.content_hash(), world.store.content_hash()) << "a flip changed the world silently";
    EXPECT_EQ(read->metadata, world.metadata);
    EXPECT_EQ(read->environment.sky_zenith, world.environment.sky_zenith);
    ASSERT_EQ(read->palette->size(), world.palette->size());
    for (size_t id = 0; id < world.palette->size(); ++id)
      EXPECT_EQ(toml_from_block((*read->palette)[static_cast<BlockId>(id)]),
                toml_from_block((*world.palette)[static_cast<BlockId>(id)]));
  }
  EXPECT_GT(reported, 20);  // the control: flips in payloads are the larger part of the file
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
  sql(folder / "a.loam", "PRAGMA user_version = 6");
  const auto refused = load(folder / "a.loam");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("newer Loam"), std::string::npos);
}

TEST(LoamSave, AnIdOutsideThePaletteIsRefused) {
  TemporaryFolder folder;
  ASSERT_TRUE(write_world(sample_world(), folder / "a.loam").ok());
  sql(folder / "a.loam", "DELETE FROM palette WHERE id > 128");
  EXPECT_FALSE(load(folder / "a.loam").ok());
}

TEST(HardCaseIO21, AWriteProtectedTargetIsSaidAndLeavesNothing) {
  TemporaryFolder folder;
  const auto status = write_world(sample_world(), folder / "no-such-folder/a.loam");
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("no-such-folder"), std::string::npos) << status.error().message;
  EXPECT_FALSE(std::filesystem::exists(folder / "no-such-folder"));
}

// ---- version 1 -------------------------------------------------------------------------------------------------

/// A file as programs before version 2 wrote it.
void write_version_1(const World& world, const std::filesystem::path& path) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  const auto run = [&](const char* text) {
    char* error = nullptr;
    ASSERT_EQ(sqlite3_exec(db, text, nullptr, nullptr, &error), SQLITE_OK) << error;
  };
  run("PRAGMA page_size=16384; PRAGMA application_id=0x4c4f414d; PRAGMA user_version=1; BEGIN;"
      "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);"
      "CREATE TABLE palette (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, properties TEXT NOT NULL);"
      "CREATE TABLE region (layer TEXT NOT NULL, x INTEGER NOT NULL, y INTEGER NOT NULL, z INTEGER NOT NULL, "
      "voxels INTEGER NOT NULL, hash INTEGER NOT NULL, bytes BLOB NOT NULL, PRIMARY KEY (layer, x, y, z));"
      "INSERT INTO meta VALUES ('metadata.seed', '17'), ('environment.sky_zenith', '1.25 0.1 3')");
  const auto insert = [&](const char* text, auto bind) {
    sqlite3_stmt* s = nullptr;
    ASSERT_EQ(sqlite3_prepare_v2(db, text, -1, &s, nullptr), SQLITE_OK);
    bind(s);
    ASSERT_EQ(sqlite3_step(s), SQLITE_DONE);
    sqlite3_finalize(s);
  };
  for (size_t id = 1; id < world.palette->size(); ++id)
    insert("INSERT INTO palette VALUES (?1, ?2, ?3)", [&](sqlite3_stmt* s) {
      const Block& block = (*world.palette)[static_cast<BlockId>(id)];
      sqlite3_bind_int64(s, 1, static_cast<sqlite3_int64>(id));
      sqlite3_bind_text(s, 2, block.name.c_str(), -1, SQLITE_TRANSIENT);
      sqlite3_bind_text(s, 3, toml_from_block(block).c_str(), -1, SQLITE_TRANSIENT);
    });
  for (const RegionPos& r : world.store.regions())
    insert("INSERT INTO region VALUES ('block', ?1, ?2, ?3, ?4, ?5, ?6)", [&](sqlite3_stmt* s) {
      const std::string bytes = *encode_region(world.store, r, StreamCompression::blosc);
      int64_t voxels = 0;
      for (const auto& [block, n] : world.store.region_census(r)) voxels += static_cast<int64_t>(n);
      for (int axis = 0; axis < 3; ++axis) sqlite3_bind_int64(s, 1 + axis, r[axis]);
      sqlite3_bind_int64(s, 4, voxels);
      sqlite3_bind_int64(s, 5, static_cast<sqlite3_int64>(XXH3_64bits(bytes.data(), bytes.size())));
      sqlite3_bind_blob(s, 6, bytes.data(), static_cast<int>(bytes.size()), SQLITE_TRANSIENT);
    });
  run("COMMIT");
  sqlite3_close(db);
}

TEST(LoamSave, VersionOneIsReadAsItIs) {
  const TemporaryFolder folder;
  const World world = sample_world();
  write_version_1(world, folder / "old.loam");
  const auto before = *read_file(folder / "old.loam");
  const auto read = load(folder / "old.loam");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->store.content_hash(), world.store.content_hash());
  EXPECT_EQ(read->metadata, world.metadata);
  EXPECT_EQ(read->environment.sky_zenith, world.environment.sky_zenith);
  EXPECT_EQ(*read_file(folder / "old.loam"), before) << "reading must not write";
}

TEST(LoamSave, VersionOneBecomesTheNewestWhereItIsEdited) {
  const TemporaryFolder folder;
  World world = sample_world();
  write_version_1(world, folder / "old.loam");
  {
    auto session = SaveSession::open(folder / "old.loam", {});
    ASSERT_TRUE(session.ok()) << session.error().message;
    EXPECT_EQ((*session)->world().store.content_hash(), world.store.content_hash());
    ASSERT_TRUE((*session)->world().store.apply(edit_number(1)).ok());
    const Status closed = (*session)->close();
    ASSERT_TRUE(closed.ok()) << closed.error().message;
  }
  ASSERT_TRUE(world.store.apply(edit_number(1)).ok());
  const auto file = SaveFile::open(folder / "old.loam", SaveFile::Access::read);
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ((*file)->version(), kSaveVersion);
  EXPECT_EQ(*(*file)->census(), world.store.census());
  const auto read = (*file)->read_all();
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->store.content_hash(), world.store.content_hash());
}

// ---- version 3 -------------------------------------------------------------------------------------------------

TEST(LoamSave, VersionThreeIsReadAsItIsAndBecomesTheNewestWhereItIsEdited) {
  const TemporaryFolder folder;
  const auto path = folder / "old.loam";
  World world = sample_world();
  write_older_save(world, path, 3);
  const auto before = *read_file(path);
  {
    const auto read = load(path);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->store.content_hash(), world.store.content_hash());
    EXPECT_EQ(*read_file(path), before) << "reading must not write";
    EXPECT_EQ(check_save(path)->version, 3);
    EXPECT_TRUE(check_save(path)->clean());
  }
  {
    auto session = SaveSession::open(path, {});
    ASSERT_TRUE(session.ok()) << session.error().message;
    ASSERT_TRUE((*session)->world().store.apply(edit_number(1)).ok());
    ASSERT_TRUE((*session)->close().ok());
  }
  ASSERT_TRUE(world.store.apply(edit_number(1)).ok());
  EXPECT_EQ(check_save(path)->version, kSaveVersion);
  EXPECT_TRUE(check_save(path)->clean());
  const auto read = load(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->store.content_hash(), world.store.content_hash());
  expect_equal_palettes(*read->palette, *world.palette);
}

TEST(LoamSave, ADamagedOlderPaletteIsNotGivenANewDigest) {
  const TemporaryFolder folder;
  const auto path = folder / "old.loam";
  write_older_save(sample_world(), path, 3);
  sql(path, "UPDATE census SET voxels = voxels + 1 WHERE block = 1");
  EXPECT_FALSE(SaveSession::open(path, {}).ok());
  EXPECT_EQ(check_save(path)->version, 3);
  EXPECT_FALSE(check_save(path)->clean());
}

// ---- version 4 -------------------------------------------------------------------------------------------------

TEST(LoamSave, VersionFourIsReadAsItIsAndBecomesTheNewestWhereItIsEdited) {
  const TemporaryFolder folder;
  const auto path = folder / "old.loam";
  World world = sample_world();
  world.store.make_layer(Layer::density).set({1, 2, 3}, 0.25f);
  write_older_save(world, path, 4);
  const auto before = *read_file(path);
  {
    const auto read = load(path);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->store.content_hash(), world.store.content_hash());
    EXPECT_EQ(read->environment, world.environment) << "with the usual temperature";
    EXPECT_EQ(read->simulation, SimulationRequest{});
    expect_equal_palettes(*read->palette, *world.palette);
    EXPECT_EQ(*read_file(path), before) << "reading must not write";
    EXPECT_EQ(check_save(path)->version, 4);
    EXPECT_TRUE(check_save(path)->clean());
  }
  {
    auto session = SaveSession::open(path, {});
    ASSERT_TRUE(session.ok()) << session.error().message;
    ASSERT_TRUE((*session)->world().store.apply(edit_number(1)).ok());
    (*session)->world().store.make_int_layer(Layer::liquid).set({1, 2, 3}, 77);
    (*session)->world().environment.temperature = Kelvin{250.1};
    ASSERT_TRUE((*session)->close().ok());
  }
  ASSERT_TRUE(world.store.apply(edit_number(1)).ok());
  EXPECT_EQ(check_save(path)->version, kSaveVersion);
  EXPECT_TRUE(check_save(path)->clean());
  const auto read = load(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->store.content_hash(), world.store.content_hash());
  EXPECT_EQ(read->store.find_layer(Layer::density)->get({1, 2, 3}), 0.25f);
  EXPECT_EQ(read->store.find_int_layer(Layer::liquid)->get({1, 2, 3}), 77);
  EXPECT_EQ(read->environment.temperature, Kelvin{250.1});
  expect_equal_palettes(*read->palette, *world.palette);
}

TEST(LoamSave, OlderBlocksRestAndFlowAsTheStandardBlockThatTheyAre) {
  const Block lava = standard_blocks()[*standard_blocks().find("lava")];
  BlockPalette older, changed, newer;
  ASSERT_TRUE(add_saved_block(older, toml_before_5(lava), 4, "here").ok());
  EXPECT_EQ(older[1].viscosity_pa_s, lava.viscosity_pa_s);
  Block cold = lava;
  cold.emission = {};
  ASSERT_TRUE(add_saved_block(changed, toml_before_5(cold), 4, "here").ok());
  EXPECT_EQ(changed[1].viscosity_pa_s, Block{}.viscosity_pa_s) << "another block of that name";
  ASSERT_TRUE(add_saved_block(newer, toml_before_5(lava), 5, "here").ok());
  EXPECT_EQ(newer[1].viscosity_pa_s, Block{}.viscosity_pa_s) << "it says so";
  EXPECT_FALSE(add_saved_block(newer, "", 5, "here").ok());
  EXPECT_FALSE(add_saved_block(newer, toml_from_block(cold), 4, "here").ok()) << "the name is taken";
}

// ---- how large it is -------------------------------------------------------------------------------------------

TEST(LoamSave, ThreeHundredBlocksAndATreeTakeLittleRoom) {
  const TemporaryFolder folder;
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {3, 9, 3}}, *world.palette->find("stone"));
  ASSERT_TRUE(world.store.apply(batch).ok());
  ASSERT_TRUE(write_world(world, folder / "a.loam").ok());
  EXPECT_LE(std::filesystem::file_size(folder / "a.loam"), 24 << 10);  // 224 KiB in version 3
}

}  // namespace
}  // namespace world
