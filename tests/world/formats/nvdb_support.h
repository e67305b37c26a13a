/// What tests and fuzz targets of .nvdb share.
#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

#include <zlib.h>

namespace world {

/// nvdb/derived_torus01_zip.nvdb with its grid as it lies in memory, so that damage reaches the tree; empty where it
/// does not inflate.
inline std::vector<uint8_t> plain_torus(const std::vector<uint8_t>& zipped) {
  uint64_t size = 0, packed = 0;
  uint32_t name = 0;
  std::memcpy(&size, &zipped[16], 8);
  std::memcpy(&name, &zipped[16 + 136], 4);
  const size_t at = 16 + 176 + name;
  std::memcpy(&packed, &zipped[at], 8);
  std::vector<uint8_t> plain(zipped.begin(), zipped.begin() + static_cast<std::ptrdiff_t>(at));
  plain.resize(at + size);
  uLongf got = size;
  if (uncompress(&plain[at], &got, &zipped[at + 8], packed) != Z_OK) return {};
  std::memcpy(&plain[16 + 8], &size, 8);
  plain[14] = 0, plain[16 + 168] = 0;
  return plain;
}

}  // namespace world
