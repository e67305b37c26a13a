/// What the tests of saves share: a varied world, a deterministic series of edits, and raw access to the file.
#pragma once

#include <fstream>
#include <iostream>
#include <random>

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "tests/support.h"
#include "world/formats/format.h"
#include "world/saves/palette_rows.h"
#include "world/saves/schema.h"
#include "world/saves/session.h"

namespace world {

/// Harnesses that kill processes or go through every page take many minutes under sanitizers, and look at files, not at
/// memory.
#if defined(__SANITIZE_ADDRESS__)
#define SKIP_UNDER_SANITIZERS()                                                     \
  do {                                                                              \
    std::cout << "skipped: harnesses of whole saves, in a build with sanitizers\n"; \
    GTEST_SKIP();                                                                   \
  } while (false)
#else
#define SKIP_UNDER_SANITIZERS() static_cast<void>(0)
#endif

inline World sample_world() {
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

/// The n-th of a fixed series of edits over nine regions.
inline EditBatch edit_number(int n) {
  EditBatch batch;
  std::mt19937 rng(static_cast<unsigned>(n) * 7919 + 1);
  for (int i = 0; i < 60; ++i) {
    const VoxelPos v{int(rng() % 380) - 190, int(rng() % 100), int(rng() % 380) - 190};
    const auto block = static_cast<BlockId>(rng() % 100);
    batch.fill({v, v + VoxelPos{int(rng() % 12), int(rng() % 12), int(rng() % 12)}}, block);
  }
  return batch;
}

inline Result<World> load(const std::filesystem::path& path) {
  ImportReport report;
  return read_world(path, {}, report);
}

inline void sql(const std::filesystem::path& path, const char* text) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  char* error = nullptr;
  EXPECT_EQ(sqlite3_exec(db, text, nullptr, nullptr, &error), SQLITE_OK) << (error ? error : "");
  sqlite3_close(db);
}

/// The text of a block that programs before version 5 wrote: nothing of how it rests or flows.
inline std::string toml_before_5(Block block) {
  block.repose_deg = Block{}.repose_deg, block.viscosity_pa_s = Block{}.viscosity_pa_s;
  return toml_from_block(block);
}

/// A save as programs of versions 2 to 4 wrote it: before version 4 each block a row of text; before version 3 no
/// assets. Not of layers of integers.
inline void write_older_save(const World& world, const std::filesystem::path& path, int version) {
  ASSERT_TRUE(write_new_save(world, path).ok());
  auto db = Database::open(path, Database::Access::edit);
  ASSERT_TRUE(db.ok());
  ASSERT_TRUE(db->run("DELETE FROM meta WHERE key IN ('environment.temperature', 'scene.simulation')").ok());
  ASSERT_TRUE(db->run(std::string("DROP TABLE palette;") + tables_of_version(version)[1]).ok());
  auto row = Statement::prepare(*db, "INSERT INTO palette VALUES (?1, ?2, ?3, ?4)");
  ASSERT_TRUE(row.ok());
  std::vector<std::string> texts;
  for (size_t id = 1; id < world.palette->size(); ++id) {
    const Block& block = (*world.palette)[static_cast<BlockId>(id)];
    const auto key = static_cast<int64_t>(id);
    texts.push_back(toml_before_5(block));
    if (version >= 4) {
      if (texts.size() < kPaletteRowBlocks && id + 1 < world.palette->size()) continue;
      const auto packed = make_palette_row(id + 1 - texts.size(), texts);
      ASSERT_TRUE(packed.ok());
      row->bind(1, packed->id), row->bind(2, packed->blocks), row->bind(3, packed->hash);
      row->bind_blob(4, packed->bytes);
      ASSERT_TRUE(row->finish().ok());
    } else {
      row->bind(1, key), row->bind(2, block.name), row->bind(3, texts.back());
      row->bind(4, hash_of_palette_row(key, block.name, texts.back()));
      ASSERT_TRUE(row->finish().ok());
    }
    texts.clear();
  }
  if (version == 2) {
    ASSERT_TRUE(db->run("DROP TABLE asset").ok());
  }
  ASSERT_TRUE(db->run("PRAGMA user_version=" + std::to_string(version)).ok());
  ASSERT_TRUE(db->run("UPDATE meta SET value = '" + *digest_of(*db) + "' WHERE key = 'save.digest'").ok());
}

inline void write_bytes(const std::filesystem::path& path, std::span<const uint8_t> bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace world
