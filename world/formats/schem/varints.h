/// Varints: 7 bits a byte, lowest first, the top bit says that more follow.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "world/formats/nbt/large_arrays.h"

namespace world {

class VarintReader {
 public:
  explicit VarintReader(nbt::ArrayStream bytes) : bytes_(std::move(bytes)) {}
  /// UINT32_MAX, and failed(), at the end of the bytes or where a number has more than 32 bits.
  uint32_t next() {
    if (at_ != end_ && *at_ < 128) return *at_++;
    uint64_t value = 0;
    for (int shift = 0; shift < 35; shift += 7) {
      if (at_ == end_ && !refill()) return fail();
      const uint8_t byte = *at_++;
      value |= uint64_t{byte & 127u} << shift;
      if (byte < 128) return value <= UINT32_MAX - 1 ? static_cast<uint32_t>(value) : fail();
    }
    return fail();
  }
  bool failed() const { return failed_; }

 private:
  bool refill() {
    if (failed_) return false;
    const auto piece = bytes_.next();
    at_ = piece.data();
    end_ = at_ + piece.size();
    return !piece.empty();
  }
  uint32_t fail() {
    failed_ = true;
    at_ = end_;
    return UINT32_MAX;
  }
  nbt::ArrayStream bytes_;
  const uint8_t* at_ = nullptr;
  const uint8_t* end_ = nullptr;
  bool failed_ = false;
};

inline uint64_t varint_bytes(uint32_t value) {
  uint64_t n = 1;
  for (; value >= 128; value >>= 7) ++n;
  return n;
}

inline void append_varint(std::string& out, uint32_t value) {
  for (; value >= 128; value >>= 7) out += static_cast<char>(128 | (value & 127));
  out += static_cast<char>(value);
}

}  // namespace world
