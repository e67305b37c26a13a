#include "world/formats/translation/numeric_ids.h"

#include <algorithm>
#include <bit>
#include <charconv>

#include "world/base/toml_reader.h"

namespace world {
namespace {

std::optional<int> whole(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0) return {};
  return value;
}

/// The bits of `data` under the mask, moved down.
size_t bits_under(int data, int mask) {
  return mask == 0 ? 0 : static_cast<size_t>((data & mask) >> std::countr_zero(static_cast<unsigned>(mask)));
}

}  // namespace

std::optional<NumericId> parse_numeric(std::string_view text) {
  const size_t colon = text.find(':');
  if (colon == std::string_view::npos) return {};
  const auto id = whole(text.substr(0, colon)), data = whole(text.substr(colon + 1));
  if (!id || !data) return {};
  return NumericId{*id, *data};
}

void NumericIds::read(TomlTable& root) {
  for (TomlTable table : root.table("ids"))
    for (const std::string& key : table.keys()) {
      const auto id = whole(key);
      if (!id) table.fail(key, "the key of a numeric id must be a number");
      Id& made = ids_[id.value_or(0)];
      if (!table.has_array(key))
        table.read(key, made.names.emplace_back());
      else
        table.read(key, made.names);
    }
  for (TomlTable all : root.table("id"))
    for (auto& [key, table] : all.tables()) {
      const auto id = whole(key);
      if (!id) table.fail({}, "the key of a numeric id must be a number");
      Id& made = ids_[id.value_or(0)];
      made.mask = 0;
      table.require("names", made.names);
      table.read("mask", made.mask);
      table.read("set", made.set);
    }
  for (TomlTable all : root.table("property_set"))
    for (auto& [set, table] : all.tables())
      for (auto& [name, property] : table.tables()) {
        Property& made = sets_[set][name];
        property.require("mask", made.mask);
        property.require("values", made.values);
      }
}

std::string NumericIds::state(int id, int data) const {
  const auto found = ids_.find(id);
  if (found == ids_.end() || found->second.names.empty()) return {};
  const Id& known = found->second;
  std::string text = known.names[std::min(bits_under(data, known.mask), known.names.size() - 1)];
  const auto set = sets_.find(known.set);
  if (set == sets_.end()) return text;
  char before = '[';
  for (const auto& [name, property] : set->second) {
    text += before;
    text += name + "=" + property.values[std::min(bits_under(data, property.mask), property.values.size() - 1)];
    before = ',';
  }
  return text + "]";
}

}  // namespace world
