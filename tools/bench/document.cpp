#include "tools/bench/document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "world/base/text.h"

namespace tools {

namespace {

constexpr std::string_view kBegin = "<!-- bench ", kEnd = "-->", kInlineEnd = "<!-- -->";

// ---- numbers ----

/// So many significant digits, no fewer than those before the point, no exponent from 0.001 on.
std::string digits_text(double value, int digits) {
  if (!std::isfinite(value)) return number_text(value);
  if (value == 0) return "0";
  const double size = std::abs(value);
  if (size >= std::pow(10, digits) - 0.5) {
    const auto whole = static_cast<unsigned long long>(std::llround(size));
    return (value < 0 ? "-" : "") + (whole >= 10000 ? world::with_thousands(whole) : std::to_string(whole));
  }
  std::string text = fmt::format("{:.{}g}", value, digits);  // as 1.2e-05 below 0.0001
  if (const size_t e = text.find("e-0"); e != std::string::npos) text.erase(e + 2, 1);
  return text;
}

struct Scale {
  double factor;
  const char* unit;
};

/// In the largest of the units in which it is `least`; in the last what is smaller.
template <size_t n>
std::string scaled_text(double value, const std::array<Scale, n>& scales, int digits, double least = 0.9995) {
  if (!std::isfinite(value)) return number_text(value);
  if (value == 0) return std::string("0 ") + scales[0].unit;
  for (const Scale& s : scales)
    if (std::abs(value) * s.factor >= least || &s == &scales.back())
      return digits_text(value * s.factor, digits) + " " + s.unit;
  return {};
}

std::string seconds_text(double seconds, int digits) {
  constexpr std::array<Scale, 4> kScales{{{1, "s"}, {1e3, "ms"}, {1e6, "µs"}, {1e9, "ns"}}};
  return scaled_text(seconds, kScales, digits);
}

std::string metres_text(double metres, int digits) {
  constexpr std::array<Scale, 5> kScales{{{1, "m"}, {1e3, "mm"}, {1e6, "µm"}, {1e9, "nm"}, {1e12, "pm"}}};
  return scaled_text(metres, kScales, digits, 0.0995);
}

/// A value of `bench run` in its row's unit.
std::string value_text(double value, const std::string& unit) {
  if (unit == "ms") return seconds_text(1e-3 * value, 3);
  if (unit == "us") return seconds_text(1e-6 * value, 3);
  std::string shown = unit;
  if (const size_t cubed = shown.find("m^3"); cubed != std::string::npos) shown.replace(cubed, 3, "m³");
  if (shown.rfind("B/", 0) == 0) shown.replace(0, 1, "byte");
  return digits_text(value, 3) + " " + shown;
}

/// An error by a metric, whose unit stands in parentheses at its end.
std::string error_text(double value, const std::string& metric) {
  const auto ends = [&](std::string_view unit) {
    return metric.size() >= unit.size() && metric.compare(metric.size() - unit.size(), unit.size(), unit) == 0;
  };
  if (ends("(m)")) return metres_text(value, 2);
  if (ends("(degrees)")) return digits_text(value, 2) + "°";
  return digits_text(value, 2);
}

std::string unit_of(const std::string& text) {
  const size_t space = text.find(' ');
  return space == std::string::npos ? "" : text.substr(space);
}

// ---- Markdown ----

std::string trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t") - first + 1));
}

/// Between the bars of a line that begins and ends with one; "\|" is no bar.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::string cell;
  for (size_t i = 1; i < line.size(); ++i) {
    if (line[i] == '\\' && i + 1 < line.size()) {
      cell += line[i++];
      cell += line[i];
    } else if (line[i] == '|') {
      cells.push_back(trimmed(cell));
      cell.clear();
    } else {
      cell += line[i];
    }
  }
  return cells;
}

/// What stands in backquotes. A name without suite or subject has that of the one before it.
std::vector<std::string> row_names(const std::string& cell) {
  std::vector<std::string> names;
  for (size_t begin = cell.find('`'); begin != std::string::npos;) {
    const size_t end = cell.find('`', begin + 1);
    if (end == std::string::npos) break;
    std::string name = cell.substr(begin + 1, end - begin - 1);
    if (!names.empty() && name.find('/') == std::string::npos) name.insert(0, names[0], 0, names[0].find('/') + 1);
    names.push_back(std::move(name));
    begin = cell.find('`', end + 1);
  }
  return names;
}

std::string replaced(std::string text, const std::string& name) {
  for (size_t star = text.find('*'); star != std::string::npos; star = text.find('*', star + name.size()))
    text.replace(star, 1, name);
  return text;
}

class Writer {
 public:
  Writer(std::string file, const KeptResults& results) : file_(std::move(file)), results_(results) {}

  Result<DocumentResult> write(const std::string& text) {
    std::vector<std::string> lines;
    for (size_t begin = 0; begin <= text.size();) {
      const size_t end = std::min(text.find('\n', begin), text.size());
      lines.push_back(text.substr(begin, end - begin));
      begin = end + 1;
    }
    bool fenced = false;
    for (line_ = 0; line_ < lines.size(); ++line_) {
      std::string& line = lines[line_];
      if (line.rfind("```", 0) == 0) fenced = !fenced;
      if (fenced || line.find(kBegin) == std::string::npos) continue;
      const bool alone = line.find(kBegin) == line.find_first_not_of(" \t");  // where Markdown takes it for a block
      TRY_STATUS(alone ? block(lines) : within(line));
    }
    for (size_t i = 0; i < lines.size(); ++i) result_.text += (i ? "\n" : "") + lines[i];
    return std::move(result_);
  }

 private:
  world::Error error(const std::string& what) const {
    return world::input_error(fmt::format("{}:{}: {}", file_, line_ + 1, what));
  }

  /// A mark on a line of its own: the machine, or the head of a table.
  Status block(std::vector<std::string>& lines) {
    const std::string line = trimmed(lines[line_]);
    const size_t end = line.find(kEnd);
    if (end == std::string::npos || !trimmed(line.substr(end + kEnd.size())).empty())
      return error("a mark that begins a line must fill it, and one within a line stand after a word");
    const std::string words = trimmed(line.substr(kBegin.size(), end - kBegin.size()));
    if (words.rfind("on ", 0) == 0) {
      machine_ = trimmed(words.substr(3));
      if (results_.head(machine_)) return {};
      std::string known;
      for (const std::string& name : results_.machines()) known += (known.empty() ? "" : ", ") + name;
      return error(fmt::format("no results of the machine \"{}\" are kept, those of {} are", machine_, known));
    }
    if (words.rfind('|', 0) != 0)
      return error(fmt::format("the mark \"{}\" begins with neither \"on MACHINE\" nor \"| {{FIELD}} | ...\"", words));
    return table(lines, cells_of(words + " |"));
  }

  Status table(std::vector<std::string>& lines, const std::vector<std::string>& columns) {
    if (line_ + 2 >= lines.size() || lines[line_ + 1].rfind('|', 0) != 0 || lines[line_ + 2].rfind("|-", 0) != 0)
      return error("the head of a table must follow this mark");
    const size_t width = cells_of(lines[line_ + 1]).size();
    if (width < columns.size() + 1)
      return error(fmt::format("the mark has {} columns, and the table {}: one that names rows must stand before them",
                               columns.size(), width));
    const size_t names_column = width - columns.size() - 1;
    for (line_ += 3; line_ < lines.size() && lines[line_].rfind('|', 0) == 0; ++line_) {
      std::vector<std::string> cells = cells_of(lines[line_]);
      if (cells.size() != width) return error(fmt::format("{} cells, expected {}", cells.size(), width));
      const std::vector<std::string> names = row_names(cells[names_column]);
      if (names.empty()) return error(fmt::format("the cell \"{}\" names no row in backquotes", cells[names_column]));
      for (size_t i = 0; i < columns.size(); ++i) {
        TRY(const std::string text, filled(columns[i], names));
        std::string& cell = cells[names_column + 1 + i];
        if (cell == text) continue;
        result_.changes.push_back({line_ + 1, cells[names_column], cell, text});
        cell = text;
      }
      std::string line = "|";
      for (const std::string& cell : cells) line += cell.empty() ? " |" : " " + cell + " |";
      if (line != lines[line_] && cells == cells_of(lines[line_])) continue;  // no cell moved: its spaces are its own
      lines[line_] = line;
    }
    --line_;
    return {};
  }

  /// Marks within a line, each with what it stands for up to an empty comment.
  Status within(std::string& line) {
    std::string written;
    size_t at = 0;
    for (size_t begin = line.find(kBegin); begin != std::string::npos; begin = line.find(kBegin, at)) {
      const size_t end = line.find(kEnd, begin);
      const size_t value = end == std::string::npos ? end : end + kEnd.size();
      const size_t close = value == std::string::npos ? value : line.find(kInlineEnd, value);
      if (close == std::string::npos)
        return error(fmt::format("the mark at column {} does not end on its line with \"{}\" after its value",
                                 begin + 1, kInlineEnd));
      const std::string words = trimmed(line.substr(begin + kBegin.size(), end - begin - kBegin.size()));
      const std::string before = line.substr(value, close - value);
      TRY(const std::string after, filled(words, {}));
      if (before != after) result_.changes.push_back({line_ + 1, words, before, after});
      written += line.substr(at, value - at) + after;
      at = close;
    }
    line = written + line.substr(at);
    return {};
  }

  /// A column's or a mark's text for all rows that are named.
  Result<std::string> filled(const std::string& form, const std::vector<std::string>& names) {
    if (form.find('{') == std::string::npos) return error(fmt::format("\"{}\" holds no {{FIELD}}", form));
    std::vector<std::string> values;
    for (const std::string& name : names.empty() ? std::vector<std::string>{""} : names) {
      TRY(std::string value, filled_once(form, name));
      if (!value.empty()) values.push_back(std::move(value));
    }
    return joined(std::move(values));
  }

  /// What several rows have in common is said once: a rival's name, the unit, or all of it.
  static std::string joined(std::vector<std::string> values) {
    if (values.empty()) return {};
    if (std::all_of(values.begin(), values.end(), [&](const std::string& v) { return v == values[0]; }))
      return values[0];
    std::string text = values[0].substr(0, values[0].find(": ") == std::string::npos ? 0 : values[0].find(": ") + 2);
    if (!std::all_of(values.begin(), values.end(), [&](const std::string& v) { return v.rfind(text, 0) == 0; }))
      text.clear();
    for (std::string& value : values) value.erase(0, text.size());
    const bool commas = std::any_of(values.begin(), values.end(),
                                    [](const std::string& v) { return v.find(", ") != std::string::npos; });
    for (size_t i = 0; i < values.size(); ++i) {
      const std::string unit = unit_of(values[i]);
      const bool again = i + 1 < values.size() && !unit.empty() && unit == unit_of(values[i + 1]);
      text += (i == 0 ? "" : commas ? "; " : ", ") + values[i].substr(0, values[i].size() - (again ? unit.size() : 0));
    }
    return text;
  }

  /// Empty where all its fields are.
  Result<std::string> filled_once(const std::string& form, const std::string& name) {
    std::string text;
    bool any = false;
    for (size_t at = 0; at < form.size();) {
      const size_t open = form.find('{', at), close = form.find('}', at);
      if (open == std::string::npos) {
        text += form.substr(at);
        break;
      }
      if (close == std::string::npos || close < open)
        return error(fmt::format("a brace of \"{}\" has no partner", form));
      TRY(const std::string value, field_text(form.substr(open + 1, close - open - 1), name));
      any |= !value.empty();
      text += form.substr(at, open - at) + value;
      at = close + 1;
    }
    return any ? text : std::string();
  }

  Result<std::string> field_text(const std::string& words, const std::string& name) {
    std::string machine = machine_, rest = trimmed(words);
    if (const size_t colon = rest.find(": "); colon != std::string::npos)
      machine = rest.substr(0, colon), rest = trimmed(rest.substr(colon + 2));
    if (machine.empty()) return error("no machine is named: `<!-- bench on MACHINE -->` must stand before this mark");
    if (rest == "machine") return machine_words(machine);
    // The row begins with the word that has a slash.
    std::string field = rest, row = name;
    if (const size_t slash = rest.find('/'); slash != std::string::npos) {
      const size_t space = rest.rfind(' ', slash);
      if (space == std::string::npos) return error(fmt::format("\"{}\" has no field before its row", rest));
      field = trimmed(rest.substr(0, space)), row = replaced(rest.substr(space + 1), name);
    }
    field = replaced(field, name);
    if (row.empty()) return error(fmt::format("\"{}\" names no row", rest));
    const auto found = results_.find(machine, row);
    if (!found.ok()) return error(found.error().message);
    result_.rows.push_back(row);
    const Json& source = *(*found)->source;
    if (source.value("quick", false)) ++result_.quick;
    if (field == "commit") return source.value("commit", "");
    if (field == "quick") return std::string(source.value("quick", false) ? ", by quick runs" : "");
    if (field == "date") return source["machine"].value("date", "").substr(0, 10);
    const auto text = (*found)->is_point() ? of_point(**found, field, row) : of_row((*found)->item, field, row);
    return text;
  }

  Result<std::string> machine_words(const std::string& machine) const {
    const Json* head = results_.head(machine);
    if (!head) return error(fmt::format("no results of the machine \"{}\" are kept", machine));
    const Json& m = (*head)["machine"];
    std::string text = fmt::format("{}, {} cores, {}", m.value("cpu", "unknown"), m.value("cores", 0),
                                   m["simd"].empty() ? "no SIMD" : m["simd"][0].get<std::string>());
    if (const std::string device = m.value("device", ""); !device.empty()) text += ", " + device;
    return text;
  }

  world::Error no_field(const std::string& field, const std::string& row, const char* known) const {
    return error(fmt::format("{} has no field \"{}\"; known: {}", row, field, known));
  }

  Result<std::string> of_row(const Json& item, const std::string& field, const std::string& row) const {
    if (!item.contains("value") || !item["value"].is_number())
      return error(fmt::format("{} has no value: it failed when it was measured", row));
    const std::string unit = item.value("unit", "");
    const std::string value = value_text(item["value"], unit);
    const auto shown = [&](const Json& number) {
      return number.is_number() ? value_text(number, unit) : std::string("failed");
    };
    if (field == "value") return value;
    if (field == "spread") {
      const std::string low = shown(item["spread"]["q1"]), high = shown(item["spread"]["q3"]);
      if (low == high) return low;
      return (unit_of(low) == unit_of(high) ? low.substr(0, low.size() - unit_of(low).size()) : low) + " to " + high;
    }
    if (field == "ratio") return item["ratio"].is_number() ? digits_text(item["ratio"], 2) + " ×" : std::string();
    if (field == "reach") {
      std::string text;
      if (const Json times = item.value("reach_times_rival", Json()); times.is_number())
        text = digits_text(times, 3) + " × the best";
      else if (item["reach"].is_number())
        text = value_text(item["reach"], unit);
      return text.empty() || item["met"].is_null() || item["met"].get<bool>() ? text : text + ", missed";
    }
    if (field.rfind("counter ", 0) == 0) return counter(item, field.substr(8), row);
    if (field.rfind("rival", 0) == 0) return rivals(item, field, row, shown);
    return no_field(field, row, "value, spread, rival, rival NAME, rivals, ratio, reach, counter NAME, machine, date");
  }

  Result<std::string> counter(const Json& item, const std::string& name, const std::string& row) const {
    const Json counters = item.value("counters", Json::object());
    if (!counters.contains(name) || !counters[name].is_number()) {
      std::vector<std::string> known;
      for (const auto& [key, value] : counters.items()) known.push_back(key);
      const std::string nearest = world::nearest_text(name, known);
      return error(fmt::format("{} has no counter \"{}\"{}", row, name,
                               nearest.empty() ? std::string() : ", did you mean \"" + nearest + "\"?"));
    }
    const double value = counters[name];
    const auto ends = [&](std::string_view unit) {
      return name.size() > unit.size() && name.compare(name.size() - unit.size(), unit.size(), unit) == 0;
    };
    if (ends("_ms")) return seconds_text(1e-3 * value, 3);
    if (ends("_MiB")) return digits_text(value, 3) + " MiB";
    return digits_text(value, 3);
  }

  template <class Shown>
  Result<std::string> rivals(const Json& item, const std::string& field, const std::string& row, Shown shown) const {
    const Json all = item.value("rivals", Json::array());
    // The row's unit isn't said again; times have units of their own.
    const std::string kept_unit = item.value("unit", "");
    const std::string unit = kept_unit == "ms" || kept_unit == "us" ? "" : unit_of(shown(item["value"]));
    const auto value_of = [&](const Json& rival) {
      const std::string value = shown(rival["spread"]["median"]);
      return !unit.empty() && unit == unit_of(value) ? value.substr(0, value.size() - unit.size()) : value;
    };
    if (field == "rival" || field == "rivals") {
      std::string text;
      for (size_t i = 0; i < (field == "rival" ? std::min<size_t>(1, all.size()) : all.size()); ++i)
        text += (i ? "; " : "") + all[i].value("name", "") + ": " + value_of(all[i]);
      return text;
    }
    const std::string name = trimmed(field.substr(5));
    std::vector<std::string> known;
    for (const Json& rival : all) {
      known.push_back(rival.value("name", ""));
      if (known.back() == name) return value_of(rival);
    }
    const std::string nearest = world::nearest_text(name, known);
    return error(fmt::format("{} has no rival \"{}\"{}", row, name,
                             nearest.empty() ? std::string() : ", did you mean \"" + nearest + "\"?"));
  }

  Result<std::string> of_point(const KeptNumber& point, const std::string& field, const std::string& row) const {
    const Json& item = point.item;
    if (item.value("failed", false)) return std::string("failed");
    if (field.rfind("error", 0) == 0) {
      const std::string which = trimmed(field.substr(5));
      const size_t metric = which.empty()                         ? 1
                            : which.size() == 1 && which[0] > '0' ? static_cast<size_t>(which[0] - '0')
                                                                  : 0;
      if (metric == 0 || metric > point.metrics.size() || metric > item.value("errors", Json::array()).size())
        return error(fmt::format("{} has {} errors, not \"{}\"", row, point.metrics.size(), field));
      const Json& median = item["errors"][metric - 1]["median"];
      return median.is_number() ? error_text(median, point.metrics[metric - 1]) : std::string("failed");
    }
    if (field == "bias") return error_text(item.value("bias", NAN), point.metrics[0]);
    if (field == "ms") return seconds_text(1e-3 * item.value("ms", NAN), 2);
    if (field == "work") return digits_text(item.value("work", NAN), 3);
    return no_field(field, row, "error, error 2, ..., bias, ms, work, machine, date");
  }

  std::string file_;
  const KeptResults& results_;
  std::string machine_;
  size_t line_ = 0;
  DocumentResult result_;
};

}  // namespace

Result<DocumentResult> document(const std::string& text, const std::string& file, const KeptResults& results) {
  return Writer(file, results).write(text);
}

}  // namespace tools
