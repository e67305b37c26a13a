/// Whole files in and out. Writing is all or nothing: a reader sees the old file or the new one, never a part.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "world/base/errors.h"

namespace world {

/// The bytes of a file; the error names the file and the reason. `limit` bounds the size.
Result<std::vector<uint8_t>> read_file(const std::filesystem::path& path, uint64_t limit = uint64_t{1} << 36);

/// Calls write(temporary path), then syncs and renames to `path`; removes the temporary file on any failure.
Status write_file_atomically(const std::filesystem::path& path,
                             const std::function<Status(const std::filesystem::path&)>& write);
Status write_bytes_atomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace world
