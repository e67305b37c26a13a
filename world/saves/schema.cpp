#include "world/saves/schema.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <xxhash.h>

namespace world {

namespace {

constexpr const char* kMeta = "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL)";

constexpr const char* kVersion1[] = {
    kMeta,
    "CREATE TABLE palette (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, properties TEXT NOT NULL)",
    "CREATE TABLE region (layer TEXT NOT NULL, x INTEGER NOT NULL, y INTEGER NOT NULL, z INTEGER NOT NULL, "
    "voxels INTEGER NOT NULL, hash INTEGER NOT NULL, bytes BLOB NOT NULL, PRIMARY KEY (layer, x, y, z))",
};

constexpr const char* kVersion2[] = {
    kMeta,
    "CREATE TABLE palette (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, properties TEXT NOT NULL, "
    "hash INTEGER NOT NULL)",
    "CREATE TABLE census (block INTEGER PRIMARY KEY, voxels INTEGER NOT NULL)",
    "CREATE TABLE region (layer TEXT NOT NULL, x INTEGER NOT NULL, y INTEGER NOT NULL, z INTEGER NOT NULL, "
    "save INTEGER NOT NULL, voxels INTEGER NOT NULL, census TEXT NOT NULL, codec TEXT NOT NULL, "
    "hash INTEGER NOT NULL, bytes BLOB NOT NULL, PRIMARY KEY (layer, x, y, z))",
};

constexpr const char* kVersion3[] = {
    kVersion2[0],
    kVersion2[1],
    kVersion2[2],
    kVersion2[3],
    "CREATE TABLE asset (key INTEGER PRIMARY KEY, codec TEXT NOT NULL, bytes BLOB NOT NULL)",
};

// Version 5 has the tables of version 4, and more that rows may say.
constexpr const char* kVersion4[] = {
    kVersion3[0],
    "CREATE TABLE palette (id INTEGER PRIMARY KEY, blocks INTEGER NOT NULL, hash INTEGER NOT NULL, "
    "bytes BLOB NOT NULL)",
    kVersion3[2],
    kVersion3[3],
    kVersion3[4],
};

}  // namespace

std::span<const char* const> tables_of_version(int version) {
  if (version == 1) return kVersion1;
  if (version == 2) return kVersion2;
  if (version == 3) return kVersion3;
  return kVersion4;
}

Result<int> check_schema(const Database& db) {
  TRY(const int64_t id, db.integer("PRAGMA application_id"));
  if (id != kApplicationId)
    return db.broken("is an SQLite file, but not a Loam save: its application id is " + std::to_string(id));
  TRY(const int64_t version, db.integer("PRAGMA user_version"));
  if (version < 1 || version > kSaveVersion)
    return db.broken(fmt::format("has save version {}, this program reads versions 1 to {}: open it with a newer Loam",
                                 version, kSaveVersion));
  std::vector<std::string> expected;
  for (const char* table : tables_of_version(static_cast<int>(version))) expected.push_back(table);
  TRY(Statement s, Statement::prepare(db, "SELECT sql FROM sqlite_schema WHERE sql IS NOT NULL"));
  while (true) {
    TRY(const bool row, s.next());
    if (!row) break;
    const auto known = std::find(expected.begin(), expected.end(), s.text(0));
    if (known == expected.end())
      return db.broken("holds a table, trigger or view that no Loam save has: \"" + s.text(0).substr(0, 80) + "\"");
    expected.erase(known);
  }
  if (!expected.empty()) return db.broken("lacks a table of a Loam save: " + expected.front().substr(0, 40));
  return static_cast<int>(version);
}

Result<std::string> digest_of(const Database& db) {
  std::string all;
  for (const char* sql :
       {"SELECT key, value FROM meta WHERE key <> 'save.digest' ORDER BY key",
        "SELECT id, hash FROM palette ORDER BY id", "SELECT block, voxels FROM census ORDER BY block"}) {
    TRY(Statement s, Statement::prepare(db, sql));
    while (true) {
      TRY(const bool row, s.next());
      if (!row) break;
      const std::string a = s.text(0), b = s.text(1);
      all += fmt::format("{}:{}{}:{}\n", a.size(), a, b.size(), b);
    }
    all += '\n';
  }
  return fmt::format("{:016x}", XXH3_64bits(all.data(), all.size()));
}

int64_t hash_of_palette_row(int64_t id, std::string_view name, std::string_view properties) {
  const std::string all = fmt::format("{} {}\n{}", id, name, properties);
  return static_cast<int64_t>(XXH3_64bits(all.data(), all.size()));
}

}  // namespace world
