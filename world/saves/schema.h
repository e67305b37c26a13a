/// The tables of each version of a save. Internal to world/saves.
#pragma once

#include <span>

#include "world/saves/database.h"

namespace world {

constexpr int kApplicationId = 0x4c4f414d;  // "LOAM"
constexpr int kSaveVersion = 5;
// Every table and index has at least one page: of a .mca with 1.3 M blocks they were 130 of 230 kB beside the regions.
constexpr int kSavePageBytes = 1024;
constexpr int kPageBytesBefore4 = 16384;

/// CREATE TABLE statements, in the order of the schema table.
std::span<const char* const> tables_of_version(int version);

/// The version of the file, where its application id, version and tables are those of a Loam save.
Result<int> check_schema(const Database& db);

/// The digest over meta, palette and census, which the save keeps in meta as "save.digest".
Result<std::string> digest_of(const Database& db);

int64_t hash_of_palette_row(int64_t id, std::string_view name, std::string_view properties);

}  // namespace world
