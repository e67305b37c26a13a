#include "world/base/toml_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <tuple>

// Its assertions also look at the text, which may be anything ("[|" fails one): what follows them reports an error.
#define TOML_ASSERT(expression) static_assert(true)
#define TOML_EXCEPTIONS 0
#define TOML_HEADER_ONLY 1
#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>

#include "world/base/text.h"

namespace world {

std::string number_text(double value) {
  char text[40];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}
std::string number_text(float value) {
  char text[40];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string NumberRange::text() const {
  const NumberRange unbounded;
  const bool has_min = min > unbounded.min, has_max = max < unbounded.max;
  if (has_min && has_max)
    return std::string("in ") + (open_min ? "(" : "[") + number_text(min) + ", " + number_text(max) +
           (open_max ? ")" : "]");
  if (has_min) return (open_min ? "above " : "at least ") + number_text(min);
  if (has_max) return (open_max ? "below " : "at most ") + number_text(max);
  return "a finite number";
}

namespace {

struct Problem {
  bool missing;  // told last: what looks missing is often a key misspelt further down
  uint32_t line, column;
  std::string message;
};

struct Handed {
  const toml::table* table;
  toml::source_position position;  // of the header, or of the file's start
  std::set<std::string, std::less<>> known;
};

std::string type_text(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::integer:
      return "an integer";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "a boolean";
    default:
      return "a date or time";
  }
}

}  // namespace

struct TomlState {
  std::string file;
  toml::table document;
  std::vector<Handed> handed;
  std::vector<Problem> problems;

  TomlTable hand_out(const toml::table& table, toml::source_position position) {
    handed.push_back({&table, position, {}});
    return TomlTable(this, handed.size() - 1);
  }
  std::string at(toml::source_position p) const {
    return file + ':' + std::to_string(p.line) + ':' + std::to_string(p.column) + ": ";
  }
  void fail(toml::source_position p, const std::string& sentence, bool missing = false) {
    problems.push_back({missing, p.line, p.column, at(p) + sentence});
  }

  /// Makes the key known and finds its value.
  const toml::node* take(size_t index, std::string_view key) {
    handed[index].known.emplace(key);
    return handed[index].table->get(key);
  }
  void expected(const toml::node& node, std::string_view key, const std::string& what) {
    fail(node.source().begin, "'" + std::string(key) + "' must be " + what + ", not " + type_text(node));
  }

  /// One number; whole numbers only where T is an integer.
  template <class T>
  bool number(const toml::node& node, const std::string& key, T& out, const NumberRange& range) {
    if constexpr (std::is_integral_v<T>) {
      const std::optional<int64_t> value = node.value_exact<int64_t>();
      if (!value) return expected(node, key, "a whole number"), false;
      const bool fits = std::is_same_v<T, uint64_t> ? *value >= 0 : std::in_range<T>(*value);
      if (!fits || !range.contains(static_cast<double>(*value))) {
        NumberRange shown = range;
        shown.min = std::max(shown.min, static_cast<double>(std::numeric_limits<T>::min()));
        shown.max = std::min(shown.max, static_cast<double>(std::numeric_limits<T>::max()));
        return fail(node.source().begin,
                    "'" + key + "' is " + std::to_string(*value) + ", but must be " + shown.text()),
               false;
      }
      out = static_cast<T>(*value);
    } else {
      const std::optional<double> value = node.is_number() ? node.value<double>() : std::optional<double>();
      if (!value) return expected(node, key, "a number"), false;
      if (!range.contains(*value) || !std::isfinite(static_cast<T>(*value)))
        return fail(node.source().begin,
                    "'" + key + "' is " + number_text(*value) + ", but must be " +
                        (std::isinf(*value) && range.max == NumberRange{}.max ? "finite and " : "") + range.text()),
               false;
      out = static_cast<T>(*value);
    }
    return true;
  }

  template <class T>
  bool read_number(size_t index, std::string_view key, T& out, const NumberRange& range) {
    const toml::node* node = take(index, key);
    return node && number(*node, std::string(key), out, range);
  }

  template <class T>
  bool read_numbers(size_t index, std::string_view key, std::span<T> out, const NumberRange& range) {
    const toml::node* node = take(index, key);
    if (!node) return false;
    const toml::array* array = node->as_array();
    const std::string what = "an array of " + std::to_string(out.size()) + " numbers";
    if (!array) return expected(*node, key, what), false;
    if (array->size() != out.size()) {
      fail(node->source().begin,
           "'" + std::string(key) + "' must be " + what + ", not of " + std::to_string(array->size()));
      return false;
    }
    bool fine = true;
    for (size_t i = 0; i < out.size(); ++i)
      fine &= number(*array->get(i), std::string(key) + '[' + std::to_string(i) + ']', out[i], range);
    return fine;
  }
};

bool TomlTable::has(std::string_view key) const { return state_->handed[index_].table->contains(key); }

bool TomlTable::has_array(std::string_view key) const {
  const toml::node* node = state_->handed[index_].table->get(key);
  return node && node->is_array();
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::tuple<uint32_t, uint32_t, std::string>> found;
  for (const auto& [key, node] : *state_->handed[index_].table)
    found.emplace_back(key.source().begin.line, key.source().begin.column, std::string(key.str()));
  std::sort(found.begin(), found.end());
  std::vector<std::string> names;
  for (auto& [line, column, name] : found) names.push_back(std::move(name));
  return names;
}

bool TomlTable::read(std::string_view key, bool& out) {
  const toml::node* node = state_->take(index_, key);
  if (!node) return false;
  const std::optional<bool> value = node->value_exact<bool>();
  if (!value) return state_->expected(*node, key, "true or false"), false;
  out = *value;
  return true;
}

bool TomlTable::read(std::string_view key, std::string& out) {
  const toml::node* node = state_->take(index_, key);
  if (!node) return false;
  const std::optional<std::string> value = node->value_exact<std::string>();
  if (!value) return state_->expected(*node, key, "a string"), false;
  out = *value;
  return true;
}

bool TomlTable::read(std::string_view key, double& out, NumberRange range) {
  return state_->read_number(index_, key, out, range);
}
bool TomlTable::read(std::string_view key, float& out, NumberRange range) {
  return state_->read_number(index_, key, out, range);
}
bool TomlTable::read(std::string_view key, int32_t& out, NumberRange range) {
  return state_->read_number(index_, key, out, range);
}
bool TomlTable::read(std::string_view key, int64_t& out, NumberRange range) {
  return state_->read_number(index_, key, out, range);
}
bool TomlTable::read(std::string_view key, uint64_t& out, NumberRange range) {
  return state_->read_number(index_, key, out, range);
}
bool TomlTable::read(std::string_view key, std::span<double> out, NumberRange range) {
  return state_->read_numbers(index_, key, out, range);
}
bool TomlTable::read(std::string_view key, std::span<float> out, NumberRange range) {
  return state_->read_numbers(index_, key, out, range);
}
bool TomlTable::read(std::string_view key, std::span<int32_t> out, NumberRange range) {
  return state_->read_numbers(index_, key, out, range);
}

bool TomlTable::read(std::string_view key, std::vector<std::string>& out) {
  const toml::node* node = state_->take(index_, key);
  if (!node) return false;
  const toml::array* array = node->as_array();
  if (!array) return state_->expected(*node, key, "an array of strings"), false;
  std::vector<std::string> values;
  for (const toml::node& element : *array) {
    const std::optional<std::string> value = element.value_exact<std::string>();
    if (!value) return state_->expected(element, key, "an array of strings"), false;
    values.push_back(*value);
  }
  out = std::move(values);
  return true;
}

bool TomlTable::read(std::string_view key, std::vector<double>& out, NumberRange range) {
  const toml::node* node = state_->take(index_, key);
  if (!node) return false;
  const toml::array* array = node->as_array();
  if (!array) return state_->expected(*node, key, "an array of numbers"), false;
  std::vector<double> values(array->size());
  if (!state_->read_numbers(index_, key, std::span<double>(values), range)) return false;
  out = std::move(values);
  return true;
}

bool TomlTable::read_choice(std::string_view key, int& out, std::span<const std::string_view> choices) {
  std::string text;
  if (!read(key, text)) return false;
  std::vector<std::string> names;
  for (size_t i = 0; i < choices.size(); ++i) {
    if (choices[i] == text) return out = static_cast<int>(i), true;
    names.emplace_back(choices[i]);
  }
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  const toml::node& node = *state_->handed[index_].table->get(key);
  const std::string near = nearest_text(text, names);
  state_->fail(node.source().begin, "'" + std::string(key) + "' is '" + text + "', but must be one of " + list +
                                        (near.empty() ? "" : " (did you mean '" + near + "'?)"));
  return false;
}

std::vector<TomlTable> TomlTable::table(std::string_view key) {
  const toml::node* node = state_->take(index_, key);
  if (!node) return {};
  if (const toml::table* table = node->as_table()) return {state_->hand_out(*table, node->source().begin)};
  state_->expected(*node, key, "a table");
  return {};
}

std::vector<TomlTable> TomlTable::array_of_tables(std::string_view key) {
  const toml::node* node = state_->take(index_, key);
  if (!node) return {};
  std::vector<TomlTable> tables;
  const toml::array* array = node->as_array();
  if (!array) return state_->expected(*node, key, "an array of tables, [[" + std::string(key) + "]]"), tables;
  for (const toml::node& element : *array) {
    if (const toml::table* table = element.as_table())
      tables.push_back(state_->hand_out(*table, element.source().begin));
    else
      state_->expected(element, key, "an array of tables, [[" + std::string(key) + "]]");
  }
  return tables;
}

std::vector<std::pair<std::string, TomlTable>> TomlTable::tables() {
  std::vector<std::pair<std::string, TomlTable>> found;
  for (const auto& [key, node] : *state_->handed[index_].table) {
    const std::string name(key.str());
    state_->handed[index_].known.insert(name);
    if (const toml::table* table = node.as_table())
      found.emplace_back(name, state_->hand_out(*table, node.source().begin));
    else
      state_->expected(node, name, "a table, [" + name + "]");
  }
  return found;
}

void TomlTable::need(std::string_view key) {
  if (!has(key)) state_->fail(state_->handed[index_].position, "the key '" + std::string(key) + "' is missing", true);
}

void TomlTable::fail(std::string_view key, const std::string& sentence) {
  const Handed& handed = state_->handed[index_];
  const toml::node* node = key.empty() ? nullptr : handed.table->get(key);
  state_->fail(node ? node->source().begin : handed.position, sentence);
}

std::string TomlTable::where(std::string_view key) const {
  const Handed& handed = state_->handed[index_];
  const toml::node* node = key.empty() ? nullptr : handed.table->get(key);
  std::string text = state_->at(node ? node->source().begin : handed.position);
  text.resize(text.size() - 2);
  return text;
}

TomlDocument::TomlDocument(std::unique_ptr<TomlState> state) : state_(std::move(state)) {}
TomlDocument::TomlDocument(TomlDocument&&) noexcept = default;
TomlDocument& TomlDocument::operator=(TomlDocument&&) noexcept = default;
TomlDocument::~TomlDocument() = default;

Result<TomlDocument> TomlDocument::parse(std::string_view text, const std::string& file_name) {
  toml::parse_result parsed = toml::parse(text, file_name);
  auto state = std::make_unique<TomlState>();
  state->file = file_name;
  if (!parsed) {
    const toml::parse_error& error = parsed.error();
    return input_error(state->at(error.source().begin) + std::string(error.description()));
  }
  state->document = std::move(parsed).table();
  return TomlDocument(std::move(state));
}

TomlTable TomlDocument::root() { return state_->hand_out(state_->document, {1, 1}); }

Status TomlDocument::finish() {
  for (const Handed& handed : state_->handed) {
    const std::vector<std::string> known(handed.known.begin(), handed.known.end());
    for (const auto& [key, node] : *handed.table) {
      if (handed.known.contains(key.str())) continue;
      const std::string near = nearest_text(key.str(), known);
      state_->fail(key.source().begin, "unknown key '" + std::string(key.str()) + "'" +
                                           (near.empty() ? "" : " (did you mean '" + near + "'?)"));
    }
  }
  if (state_->problems.empty()) return {};
  const auto first =
      std::min_element(state_->problems.begin(), state_->problems.end(), [](const Problem& a, const Problem& b) {
        return std::tuple(a.missing, a.line, a.column) < std::tuple(b.missing, b.line, b.column);
      });
  return input_error(first->message);
}

}  // namespace world
