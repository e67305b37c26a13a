/// What the tests of saves share: a varied world, a deterministic series of edits, and raw access to the file.
#pragma once

#include <fstream>
#include <iostream>
#include <random>

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "tests/support.h"
#include "world/formats/format.h"
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

inline void write_bytes(const std::filesystem::path& path, std::span<const uint8_t> bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace world
