/// Reads TOML into checked values: every error names file, line and column, what was expected, and the nearest known
/// key. The only file that sees the TOML library is toml_reader.cpp.
///
///   TRY(TomlDocument document, TomlDocument::parse(text, "lamps.toml"));
///   for (auto& [name, table] : document.root().tables()) {
///     table.require("power_w", power, {.min = 0});   // an error where it is missing or out of range
///     table.read("radius_m", radius);                // keeps its value where the key is missing
///   }
///   TRY_STATUS(document.finish());                   // the first problem in file order, unknown keys included
///
/// Reads never stop: they note problems, and finish() reports the first, missing keys after all others. A key that
/// nobody asked for is unknown.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "world/base/errors.h"

namespace world {

/// The numbers a key may have. NaN lies in no range.
struct NumberRange {
  double min = -std::numeric_limits<double>::max(), max = std::numeric_limits<double>::max();
  bool open_min = false, open_max = false;  // the end itself is not allowed

  bool contains(double v) const { return (open_min ? v > min : v >= min) && (open_max ? v < max : v <= max); }
  /// "in (0, 1)", "at least 0", "a number": follows "must be".
  std::string text() const;
};

/// The shortest decimal text that reads back as the same number.
std::string number_text(double value);
std::string number_text(float value);

struct TomlState;

/// A handle to one table of a TomlDocument, which must outlive it.
class TomlTable {
 public:
  bool has(std::string_view key) const;
  /// Whether the key holds an array: for keys that take one number or several.
  bool has_array(std::string_view key) const;
  /// Keys in file order, known or not.
  std::vector<std::string> keys() const;

  // Each fills `out` where the key is present and right, and makes the key known. Returns whether `out` was filled.
  bool read(std::string_view key, bool& out);
  bool read(std::string_view key, std::string& out);
  bool read(std::string_view key, double& out, NumberRange range = {});
  bool read(std::string_view key, float& out, NumberRange range = {});
  bool read(std::string_view key, int32_t& out, NumberRange range = {});
  bool read(std::string_view key, int64_t& out, NumberRange range = {});
  bool read(std::string_view key, uint64_t& out, NumberRange range = {});  // 0..2^63-1, TOML's own limit
  /// Exactly out.size() numbers, as `[1, 2, 3]`.
  bool read(std::string_view key, std::span<double> out, NumberRange range = {});
  bool read(std::string_view key, std::span<float> out, NumberRange range = {});
  bool read(std::string_view key, std::span<int32_t> out, NumberRange range = {});
  bool read(std::string_view key, std::vector<std::string>& out);
  /// Any number of numbers.
  bool read(std::string_view key, std::vector<double>& out, NumberRange range = {});
  /// One of the choices, as its index.
  bool read_choice(std::string_view key, int& out, std::span<const std::string_view> choices);
  /// read(), and a problem where the key is missing.
  template <class... Arguments>
  bool require(std::string_view key, Arguments&&... arguments) {
    need(key);
    return read(key, std::forward<Arguments>(arguments)...);
  }

  /// The table [key]; none where it is missing.
  std::vector<TomlTable> table(std::string_view key);
  /// The tables of [[key]], in file order.
  std::vector<TomlTable> array_of_tables(std::string_view key);
  /// All keys, each of which must be a table, in alphabetical order.
  std::vector<std::pair<std::string, TomlTable>> tables();

  /// Notes a problem at this key (or the table itself where it is empty or missing).
  void fail(std::string_view key, const std::string& sentence);
  /// "file:line:col" of the key, or of the table.
  std::string where(std::string_view key = {}) const;

 private:
  friend class TomlDocument;
  friend struct TomlState;
  TomlTable(TomlState* state, size_t index) : state_(state), index_(index) {}
  void need(std::string_view key);

  TomlState* state_;
  size_t index_;
};

class TomlDocument {
 public:
  /// `file_name` is what errors show. Syntax errors and keys defined twice fail here.
  static Result<TomlDocument> parse(std::string_view text, const std::string& file_name);
  TomlDocument(TomlDocument&&) noexcept;
  TomlDocument& operator=(TomlDocument&&) noexcept;
  ~TomlDocument();

  TomlTable root();
  /// The first problem in file order; unknown keys of all tables that were handed out are problems too.
  Status finish();

 private:
  explicit TomlDocument(std::unique_ptr<TomlState> state);
  std::unique_ptr<TomlState> state_;
};

}  // namespace world
