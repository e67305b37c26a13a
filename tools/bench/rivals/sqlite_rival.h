/// SQLite alone: the same bytes as blobs in one table, with the same guarantees. The floor of any save in that format.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "world/base/errors.h"

namespace tools {

/// Replaces the file: one transaction, rollback journal, synchronous=FULL.
world::Status sqlite_write_blobs(const std::filesystem::path& path, const std::vector<std::string>& blobs);
/// All blobs of the column `bytes` of the table `region`, as it is in our saves too.
world::Result<std::vector<std::string>> sqlite_read_blobs(const std::filesystem::path& path);

}  // namespace tools
