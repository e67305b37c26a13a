/// Knobs: named settings with a ladder from fast to exact, declared once in a *.def file with rows
///   KNOB(name, type, fast, usual, exact, unit, what)
/// From a row come the field, its flag (--set name=value), its presets (--accuracy), and a sweep in the benchmark.
/// Types: bool, int, float, and enums with a constexpr knob_choices(Enum) that lists their names.
#pragma once

#include <charconv>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "world/base/errors.h"

namespace world {

enum class Accuracy { fast, usual, exact };
Result<Accuracy> accuracy_from_name(std::string_view name);

Result<bool> parse_knob_bool(std::string_view knob, std::string_view text);
Result<double> parse_knob_number(std::string_view knob, std::string_view text, bool whole);
Error knob_out_of_range(std::string_view knob, std::string_view text, const std::string& low, const std::string& high);
Error unknown_knob(std::string_view name, const std::vector<std::string>& known);
Error bad_choice(std::string_view knob, std::string_view text, const std::vector<std::string>& choices);

template <class Knobs>
struct KnobRow {
  std::string name, unit, what;
  std::vector<std::string> choices;  // of an enum or bool; empty for numbers
  std::string fast, usual, exact;    // as text
  std::function<Status(Knobs&, std::string_view)> set;
  std::function<std::string(const Knobs&)> get;
};

template <class Knobs>
class KnobTable {
 public:
  template <class T>
  void add(std::string name, T Knobs::*field, T fast, T usual, T exact, std::string unit, std::string what) {
    KnobRow<Knobs> row{
        name, std::move(unit), std::move(what), choices_of<T>(), print(fast), print(usual), print(exact), {}, {}};
    row.set = [field, name, choices = row.choices](Knobs& knobs, std::string_view text) -> Status {
      if constexpr (std::is_same_v<T, bool>) {
        TRY(knobs.*field, parse_knob_bool(name, text));
      } else if constexpr (std::is_enum_v<T>) {
        for (size_t i = 0; i < choices.size(); ++i)
          if (choices[i] == text) {
            knobs.*field = static_cast<T>(i);
            return {};
          }
        return bad_choice(name, text, choices);
      } else {
        TRY(const double number, parse_knob_number(name, text, std::is_integral_v<T>));
        using Limits = std::numeric_limits<T>;
        static_assert(std::is_floating_point_v<T> || sizeof(T) <= 4, "a double does not hold the limits exactly");
        if (number < Limits::lowest() || number > Limits::max())
          return knob_out_of_range(name, text, print(Limits::lowest()), print(Limits::max()));
        knobs.*field = static_cast<T>(number);
      }
      return {};
    };
    row.get = [field](const Knobs& knobs) { return print(knobs.*field); };
    rows_.push_back(std::move(row));
  }

  /// Refuses numbers outside of [low, high] for a knob that was added before. T: its type.
  template <class T>
  void limit(std::string_view name, T low, T high) {
    for (KnobRow<Knobs>& row : rows_) {
      if (row.name != name) continue;
      row.set = [set = std::move(row.set), name = row.name, low, high](Knobs& knobs, std::string_view text) -> Status {
        TRY(const double number, parse_knob_number(name, text, std::is_integral_v<T>));
        if (!(number >= double(low) && number <= double(high)))
          return knob_out_of_range(name, text, print(low), print(high));
        return set(knobs, text);
      };
    }
  }

  const std::vector<KnobRow<Knobs>>& rows() const { return rows_; }

  Status set(Knobs& knobs, std::string_view name, std::string_view value) const {
    std::vector<std::string> known;
    for (const auto& row : rows_) {
      if (row.name == name) return row.set(knobs, value);
      known.push_back(row.name);
    }
    return unknown_knob(name, known);
  }

  Knobs preset(Accuracy accuracy) const {
    Knobs knobs;
    for (const auto& row : rows_) {
      const std::string& text = accuracy == Accuracy::fast    ? row.fast
                                : accuracy == Accuracy::usual ? row.usual
                                                              : row.exact;
      if (!row.set(knobs, text).ok()) std::abort();  // a row's own text always parses
    }
    return knobs;
  }

 private:
  template <class T>
  static std::vector<std::string> choices_of() {
    std::vector<std::string> names;
    if constexpr (std::is_same_v<T, bool>) names = {"false", "true"};
    if constexpr (std::is_enum_v<T>)
      for (std::string_view name : knob_choices(T{})) names.emplace_back(name);
    return names;
  }
  template <class T>
  static std::string print(T value) {
    if constexpr (std::is_same_v<T, bool>)
      return value ? "true" : "false";
    else if constexpr (std::is_enum_v<T>)
      return std::string(knob_choices(T{})[static_cast<size_t>(value)]);
    else if constexpr (std::is_integral_v<T>)
      return std::to_string(value);
    else {
      char text[40];
      const auto end = std::to_chars(text, text + sizeof text, value);
      return std::string(text, end.ptr);
    }
  }
  std::vector<KnobRow<Knobs>> rows_;
};

}  // namespace world
