/// Whole files in.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "world/base/errors.h"

namespace world {

/// The bytes of a file; the error names the file and the reason. `limit` bounds the size.
Result<std::vector<uint8_t>> read_file(const std::filesystem::path& path, uint64_t limit = uint64_t{1} << 36);

}  // namespace world
