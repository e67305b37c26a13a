#include "world/base/png_chunks.h"

#include <cstring>

#include <fmt/format.h>

namespace world {

Status check_png_chunks(std::span<const uint8_t> bytes, std::string_view name) {
  constexpr size_t kSignature = 8, kAround = 12;  // a chunk's length, type and checksum
  size_t at = kSignature;
  for (bool end = false; !end;) {
    if (bytes.size() < at + kAround)
      return input_error(fmt::format("{}: byte {}: the file ends without its IEND chunk; expected a whole PNG picture",
                                     name, bytes.size()));
    const uint64_t length = uint64_t{bytes[at]} << 24 | uint64_t{bytes[at + 1]} << 16 | uint64_t{bytes[at + 2]} << 8 |
                            uint64_t{bytes[at + 3]};
    const size_t left = bytes.size() - at - kAround;
    if (length > left)
      return input_error(fmt::format("{}: byte {}: a chunk claims {} bytes, {} are left; expected a whole PNG picture",
                                     name, at, length, left));
    end = std::memcmp(&bytes[at + 4], "IEND", 4) == 0;
    at += kAround + static_cast<size_t>(length);
  }
  return {};
}

}  // namespace world
