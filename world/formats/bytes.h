/// Bounded reading of binary files: no read leaves the bytes, and every error says the file and the byte offset.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "world/base/errors.h"

namespace world {

/// "castle.vox: byte 1234: ...", the form of every error about the content of a binary file.
inline Error byte_error(std::string_view file, uint64_t offset, std::string_view what) {
  return input_error(fmt::format("{}: byte {}: {}", file, offset, what));
}

/// A cursor over a part of a file. A read past the end gives zeros and sets failed(), so a caller checks once after a
/// group of reads; sizes taken from the file are compared with remaining() before anything is allocated.
class ByteReader {
 public:
  ByteReader(std::span<const uint8_t> bytes, std::string_view file, uint64_t base = 0)
      : bytes_(bytes), file_(file), base_(base) {}

  uint64_t offset() const { return base_ + at_; }  // in the file
  size_t remaining() const { return bytes_.size() - at_; }
  bool failed() const { return failed_; }
  std::string_view file() const { return file_; }
  Error error(std::string_view what) const { return byte_error(file_, offset(), what); }
  /// What to return where failed(): names where the missing bytes should have been.
  Error end_error(std::string_view what) const {
    return byte_error(file_, failed_at_, fmt::format("the file ends inside {}; it is damaged or cut off", what));
  }

  uint8_t u8() { return take(1) ? bytes_[at_ - 1] : 0; }
  uint32_t u32_le() { return little<uint32_t>(); }
  int32_t i32_le() { return static_cast<int32_t>(little<uint32_t>()); }
  uint16_t u16_le() { return little<uint16_t>(); }
  std::span<const uint8_t> bytes(size_t count) {
    return take(count) ? bytes_.subspan(at_ - count, count) : std::span<const uint8_t>();
  }
  /// The next `count` bytes as a reader of their own.
  ByteReader part(size_t count) {
    const uint64_t start = offset();
    return ByteReader(bytes(count), file_, start);
  }

 private:
  bool take(size_t count) {
    if (count > remaining()) {
      if (!failed_) failed_at_ = base_ + bytes_.size();
      failed_ = true;
      at_ = bytes_.size();
      return false;
    }
    at_ += count;
    return true;
  }
  template <class T>
  T little() {
    static_assert(std::endian::native == std::endian::little);
    T value = 0;
    if (take(sizeof(T))) std::memcpy(&value, bytes_.data() + at_ - sizeof(T), sizeof(T));
    return value;
  }

  std::span<const uint8_t> bytes_;
  std::string_view file_;
  uint64_t base_ = 0, failed_at_ = 0;
  size_t at_ = 0;
  bool failed_ = false;
};

}  // namespace world
