/// A small reader of .zip archives in memory: stored and deflated entries, no encryption, no zip64, one disk.
/// Never allocates more than the caller's limit, whatever an entry claims.
/// source PKWARE, APPNOTE.TXT - .ZIP File Format Specification 6.3
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "world/base/errors.h"

namespace world {

struct ZipEntry {
  std::string name;
  uint16_t flags = 0, method = 0;
  uint32_t crc = 0, packed_size = 0, size = 0, header_offset = 0;
};

/// What the central directory lists. `file` is for errors.
Result<std::vector<ZipEntry>> list_zip(std::span<const uint8_t> bytes, std::string_view file);
/// The content of one entry, checked against its size and CRC; fails where its size is above `limit`.
Result<std::vector<uint8_t>> extract_zip(std::span<const uint8_t> bytes, const ZipEntry& entry, uint64_t limit,
                                         std::string_view file);

}  // namespace world
