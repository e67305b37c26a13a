/// What must be known of a PNG file before libpng may see it: libpng takes the memory that a chunk claims, 2 GiB at
/// most, before it reads it; its own limit only warns.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "world/base/errors.h"

namespace world {

/// Every chunk behind the signature ends within the file, and the last is IEND. The message begins with `name`.
Status check_png_chunks(std::span<const uint8_t> bytes, std::string_view name);

}  // namespace world
