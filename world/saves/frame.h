/// Zstandard frames that say their size and carry a checksum. Internal to world/saves.
#pragma once

#include <string>
#include <string_view>

#include "world/base/errors.h"

namespace world {

/// `level`: Zstandard's, -7..19.
Result<std::string> to_frame(std::string_view bytes, int level);
/// Fails, with a reason that names no file, where the frame is damaged or claims more than `most_bytes`, which bounds
/// the memory that it takes.
Result<std::string> from_frame(std::string_view frame, size_t most_bytes);

}  // namespace world
