/// NBT, the tree format of Minecraft's files: a reader that walks the bytes and builds nothing, and a writer.
///
/// A compound is a run of entries (type, name, value) up to an end tag; a list says its element type and count; numbers
/// are big-endian. The reader stands before a value or an entry; who reads decides what to look at and skips the rest:
///
///   nbt::Reader in(bytes, "castle.schem");
///   in.root();
///   for (nbt::Entry e; in.next(e);) {
///     if (e.name == "Width") width = in.integer(e);
///     else if (e.name == "Palette") read_palette(in, e);
///     else in.skip(e);
///   }
///   if (in.failed()) return in.error();
///
/// Counts are compared with the bytes that are left, and depth with kMaxDepth, before anything happens; the first
/// problem is kept, and after it every read gives zeros and every loop ends.
/// source  minecraft.wiki, NBT format
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "world/base/errors.h"

namespace world::nbt {

enum class Type : uint8_t {
  end = 0,
  byte_number,
  short_number,
  int_number,
  long_number,
  float_number,
  double_number,
  byte_array,
  text,
  list,
  compound,
  int_array,
  long_array,
  count
};

constexpr int kMaxDepth = 512;

struct Entry {
  Type type = Type::end;
  std::string_view name;  // in the bytes; modified UTF-8
};

template <class T>
T big_endian(const uint8_t* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  if constexpr (sizeof(T) == 2) return static_cast<T>(__builtin_bswap16(static_cast<uint16_t>(value)));
  if constexpr (sizeof(T) == 4) return static_cast<T>(__builtin_bswap32(static_cast<uint32_t>(value)));
  if constexpr (sizeof(T) == 8) return static_cast<T>(__builtin_bswap64(static_cast<uint64_t>(value)));
  return value;
}

class Reader {
 public:
  Reader(std::span<const uint8_t> bytes, std::string_view file)
      : begin_(bytes.data()), at_(bytes.data()), end_(bytes.data() + bytes.size()), file_(file) {}

  /// Enters the root, which must be a compound. Its name, mostly empty.
  std::string_view root();
  /// The next entry of the compound that reading is in; false at its end.
  bool next(Entry& entry) {
    if (failed_) return false;
    if (at_ == end_) return ended("a compound");
    entry.type = static_cast<Type>(*at_++);
    if (entry.type == Type::end) return false;
    if (entry.type >= Type::count) return wrong("an unknown tag type");
    entry.name = short_text();
    return !failed_;
  }
  void skip(const Entry& entry) { skip(entry.type); }
  void skip(Type type);

  /// Of any integer type.
  int64_t integer(const Entry& entry);
  /// Of any number type.
  double number(const Entry& entry);
  std::string_view text(const Entry& entry);
  /// The element count of a list whose elements must be of this type (lists of none may say anything).
  uint32_t list(const Entry& entry, Type element);
  /// Element type and count of any list.
  std::pair<Type, uint32_t> list(const Entry& entry);
  /// The big-endian bytes of an array: count times 1, 4 or 8.
  std::span<const uint8_t> array(const Entry& entry, Type type);
  /// What must be a compound: true, and next() walks it.
  bool compound(const Entry& entry);
  /// Values inside a list, where there is no entry.
  std::string_view text() { return short_text(); }
  double number(Type type) { return number(Entry{type, "a list"}); }

  bool failed() const { return failed_; }
  Error error() const;
  /// Where reading stands, for who wants the bytes of a value as they are: from here before skip() to here after.
  const uint8_t* cursor() const { return at_; }
  size_t offset() const { return static_cast<size_t>(at_ - begin_); }
  size_t remaining() const { return static_cast<size_t>(end_ - at_); }
  /// Notes a problem at this place; always false.
  bool wrong(std::string_view what);

 private:
  bool ended(std::string_view inside);
  bool expect(const Entry& entry, bool right, std::string_view expected);
  const uint8_t* take(size_t count) {
    if (count > remaining()) {
      ended("a value");
      return nullptr;
    }
    const uint8_t* const from = at_;
    at_ += count;
    return from;
  }
  template <class T>
  T big() {
    const uint8_t* const from = take(sizeof(T));
    return from ? big_endian<T>(from) : T{};
  }
  std::string_view short_text() {
    const size_t length = big<uint16_t>();
    const uint8_t* const from = take(length);
    return from ? std::string_view(reinterpret_cast<const char*>(from), length) : std::string_view();
  }
  std::pair<Type, uint32_t> list_head();
  uint32_t array_count(size_t element_bytes);

  const uint8_t* begin_;
  const uint8_t* at_;
  const uint8_t* end_;
  std::string file_;
  bool failed_ = false;
  std::string problem_;
  size_t problem_offset_ = 0;
};

/// Appends to bytes. Compounds are opened and closed by the caller.
class Writer {
 public:
  std::string bytes;

  void open(std::string_view name) { head(Type::compound, name); }
  void close() { bytes += '\0'; }
  void byte_number(std::string_view name, int8_t v) { head(Type::byte_number, name), put(static_cast<uint8_t>(v)); }
  void short_number(std::string_view name, uint16_t v) { head(Type::short_number, name), put(v); }
  void int_number(std::string_view name, int32_t v) { head(Type::int_number, name), put(static_cast<uint32_t>(v)); }
  void long_number(std::string_view name, int64_t v) { head(Type::long_number, name), put(static_cast<uint64_t>(v)); }
  void text(std::string_view name, std::string_view v) { head(Type::text, name), put_text(v); }
  void byte_array(std::string_view name, std::span<const uint8_t> v);
  void int_array(std::string_view name, std::span<const int32_t> v);
  void long_array(std::string_view name, std::span<const uint64_t> v);
  /// The head of a list; its elements follow, as values without names.
  void list(std::string_view name, Type element, uint32_t count);
  /// The head of an array whose content the caller appends.
  void array_head(std::string_view name, Type type, uint32_t count) { head(type, name), put(count); }
  void put_text(std::string_view v) {
    v = v.substr(0, UINT16_MAX);
    put(static_cast<uint16_t>(v.size()));
    bytes += v;
  }

 private:
  void head(Type type, std::string_view name) { put(static_cast<uint8_t>(type)), put_text(name); }
  template <class T>
  void put(T value) {
    for (int shift = static_cast<int>(sizeof(T)) * 8 - 8; shift >= 0; shift -= 8)
      bytes += static_cast<char>(value >> shift & 0xff);
  }
};

}  // namespace world::nbt
