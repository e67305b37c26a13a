/// zlib and gzip streams in memory -> bytes, bounded by a budget and not by what a header claims.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "world/base/errors.h"
#include "world/formats/archive/budget.h"

namespace world {

/// Inflates one stream after another into a buffer of its own that grows as needed and is used again. Sound streams go
/// through libdeflate, which is given the whole and is four times as fast; what it refuses goes through zlib, a piece
/// at a time, whose words say what is wrong and where.
class Inflater {
 public:
  explicit Inflater(MemoryBudget& budget);
  ~Inflater();
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// The bytes of a zlib or gzip stream, valid until the next call; trailing bytes are left alone. At most `limit`
  /// bytes. `used`: the packed bytes that the stream took. The error's words go after the name of the file.
  Result<std::span<const uint8_t>> inflate(std::span<const uint8_t> packed, uint64_t limit = UINT64_MAX,
                                           size_t* used = nullptr);

 private:
  bool grow(size_t wanted);
  bool grow_for(size_t packed, uint64_t limit);
  std::optional<size_t> inflate_whole(std::span<const uint8_t> packed, uint64_t limit, size_t* used);
  Result<std::span<const uint8_t>> inflate_by_pieces(std::span<const uint8_t> packed, uint64_t limit, size_t* used);
  struct Stream;
  MemoryBudget& budget_;
  std::unique_ptr<Stream> stream_;
  uint8_t* bytes_ = nullptr;  // from malloc: realloc of big blocks moves pages instead of copying them
  size_t capacity_ = 0;
};

/// Whether the bytes begin as gzip does, or as zlib does.
bool looks_like_gzip(std::span<const uint8_t> bytes);
bool looks_like_zlib(std::span<const uint8_t> bytes);

}  // namespace world
