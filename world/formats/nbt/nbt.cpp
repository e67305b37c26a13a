#include "world/formats/nbt/nbt.h"

#include <array>

#include <fmt/format.h>

#include "world/formats/bytes.h"

namespace world::nbt {
namespace {

constexpr std::string_view kTypeNames[] = {"an end tag", "a byte",       "a short",      "an int", "a long",
                                           "a float",    "a double",     "a byte array", "a text", "a list",
                                           "a compound", "an int array", "a long array"};
static_assert(std::size(kTypeNames) == static_cast<size_t>(Type::count));

/// Bytes that one value of a type takes at least; exactly, for numbers.
constexpr std::array<size_t, static_cast<size_t>(Type::count)> kLeastBytes = {1, 1, 2, 4, 8, 4, 8, 4, 2, 5, 1, 4, 4};

constexpr bool is_number(Type type) { return type >= Type::byte_number && type <= Type::double_number; }

}  // namespace

std::string_view Reader::root() {
  Entry entry;
  if (!next(entry)) {
    wrong("expected a compound at the root");
    return {};
  }
  expect(entry, entry.type == Type::compound, "a compound at the root");
  return entry.name;
}

void Reader::skip(Type type) {
  struct Level {
    Type element;  // of a list; compound is marked by in_compound
    bool in_compound;
    uint32_t left;  // elements of the list that are still to come
  };
  std::array<Level, kMaxDepth> levels;
  int depth = 0;
  while (!failed_) {
    switch (type) {
      case Type::byte_array:
        take(array_count(1));
        break;
      case Type::int_array:
        take(size_t{array_count(4)} * 4);
        break;
      case Type::long_array:
        take(size_t{array_count(8)} * 8);
        break;
      case Type::text:
        take(big<uint16_t>());
        break;
      case Type::list: {
        const auto [element, count] = list_head();
        if (is_number(element)) {
          take(size_t{count} * kLeastBytes[static_cast<size_t>(element)]);
        } else if (count > 0) {
          if (depth == kMaxDepth) return void(wrong("more than 512 levels of nesting"));
          levels[static_cast<size_t>(depth++)] = {element, false, count};
        }
        break;
      }
      case Type::compound:
        if (depth == kMaxDepth) return void(wrong("more than 512 levels of nesting"));
        levels[static_cast<size_t>(depth++)] = {Type::end, true, 0};
        break;
      default:
        if (!is_number(type)) return void(wrong("a tag of an impossible type"));
        take(kLeastBytes[static_cast<size_t>(type)]);
    }
    // Find the next value that belongs to what is skipped.
    for (;;) {
      if (depth == 0 || failed_) return;
      Level& top = levels[static_cast<size_t>(depth - 1)];
      if (top.in_compound) {
        Entry entry;
        if (next(entry)) {
          type = entry.type;
          break;
        }
        --depth;
      } else if (top.left > 0) {
        --top.left;
        type = top.element;
        break;
      } else {
        --depth;
      }
    }
  }
}

int64_t Reader::integer(const Entry& entry) {
  switch (entry.type) {
    case Type::byte_number:
      return static_cast<int8_t>(big<uint8_t>());
    case Type::short_number:
      return static_cast<int16_t>(big<uint16_t>());
    case Type::int_number:
      return static_cast<int32_t>(big<uint32_t>());
    case Type::long_number:
      return static_cast<int64_t>(big<uint64_t>());
    default:
      return expect(entry, false, "a whole number");
  }
}

double Reader::number(const Entry& entry) {
  if (entry.type == Type::float_number) return std::bit_cast<float>(big<uint32_t>());
  if (entry.type == Type::double_number) return std::bit_cast<double>(big<uint64_t>());
  return static_cast<double>(integer(entry));
}

std::string_view Reader::text(const Entry& entry) {
  if (!expect(entry, entry.type == Type::text, "a text")) return {};
  return short_text();
}

std::pair<Type, uint32_t> Reader::list_head() {
  const auto type = static_cast<Type>(big<uint8_t>());
  const auto count = static_cast<int32_t>(big<uint32_t>());
  if (failed_ || count <= 0) return {Type::end, 0};
  if (type >= Type::count || type == Type::end) {
    wrong("a list of an impossible type");
    return {Type::end, 0};
  }
  if (static_cast<size_t>(count) > remaining() / kLeastBytes[static_cast<size_t>(type)]) {
    wrong(fmt::format("a list of {} elements was announced, but {} bytes are left", count, remaining()));
    return {Type::end, 0};
  }
  return {type, static_cast<uint32_t>(count)};
}

uint32_t Reader::list(const Entry& entry, Type element) {
  const auto [type, count] = list(entry);
  if (count > 0 && type != element) {
    wrong(fmt::format("expected a list of {} in '{}', found one of {}", kTypeNames[static_cast<size_t>(element)],
                      entry.name.substr(0, 64), kTypeNames[static_cast<size_t>(type)]));
    return 0;
  }
  return count;
}

std::pair<Type, uint32_t> Reader::list(const Entry& entry) {
  if (!expect(entry, entry.type == Type::list, "a list")) return {Type::end, 0};
  return list_head();
}

uint32_t Reader::array_count(size_t element_bytes) {
  const auto count = static_cast<int32_t>(big<uint32_t>());
  if (failed_) return 0;
  if (count < 0 || static_cast<size_t>(count) > remaining() / element_bytes) {
    wrong(fmt::format("an array of {} elements was announced, but {} bytes are left", count, remaining()));
    return 0;
  }
  return static_cast<uint32_t>(count);
}

std::span<const uint8_t> Reader::array(const Entry& entry, Type type) {
  if (!expect(entry, entry.type == type, kTypeNames[static_cast<size_t>(type)])) return {};
  const size_t element = type == Type::byte_array ? 1 : type == Type::int_array ? 4 : 8;
  const size_t bytes = array_count(element) * element;
  const uint8_t* const from = take(bytes);
  return from ? std::span<const uint8_t>(from, bytes) : std::span<const uint8_t>();
}

bool Reader::compound(const Entry& entry) { return expect(entry, entry.type == Type::compound, "a compound"); }

bool Reader::expect(const Entry& entry, bool right, std::string_view expected) {
  if (failed_) return false;
  if (right) return true;
  return wrong(fmt::format("expected {} in '{}', found {}", expected, entry.name.substr(0, 64),
                           kTypeNames[static_cast<size_t>(entry.type)]));
}

bool Reader::ended(std::string_view inside) {
  return wrong(fmt::format("the data ends inside {}; it is damaged or cut off", inside));
}

bool Reader::wrong(std::string_view what) {
  if (!failed_) {
    failed_ = true;
    problem_ = what;
    problem_offset_ = offset();
  }
  at_ = end_;
  return false;
}

Error Reader::error() const {
  std::string printable = problem_;  // names of entries may hold any bytes
  for (char& c : printable)
    if (c < ' ' || c > '~') c = '?';
  return byte_error(file_, problem_offset_, printable + " (offset in the inflated NBT)");
}

void Writer::byte_array(std::string_view name, std::span<const uint8_t> v) {
  array_head(name, Type::byte_array, static_cast<uint32_t>(v.size()));
  bytes.append(reinterpret_cast<const char*>(v.data()), v.size());
}

void Writer::int_array(std::string_view name, std::span<const int32_t> v) {
  array_head(name, Type::int_array, static_cast<uint32_t>(v.size()));
  for (const int32_t n : v) put(static_cast<uint32_t>(n));
}

void Writer::long_array(std::string_view name, std::span<const uint64_t> v) {
  array_head(name, Type::long_array, static_cast<uint32_t>(v.size()));
  for (const uint64_t n : v) put(n);
}

void Writer::list(std::string_view name, Type element, uint32_t count) {
  head(Type::list, name);
  put(static_cast<uint8_t>(element));
  put(count);
}

}  // namespace world::nbt
