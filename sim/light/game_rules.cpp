#include "sim/light/game_rules.h"

#include <algorithm>

#include "world/base/embedded.h"
#include "world/base/toml_reader.h"

#include "light_game_files.h"

namespace sim {

namespace {

/// One * of the pattern stands for any text.
bool fits_pattern(std::string_view pattern, std::string_view text) {
  const size_t star = pattern.find('*');
  if (star == pattern.npos) return pattern == text;
  const std::string_view head = pattern.substr(0, star), tail = pattern.substr(star + 1);
  return text.size() >= head.size() + tail.size() && text.starts_with(head) && text.ends_with(tail);
}

}  // namespace

bool GameRules::Row::fits(const world::BlockState& state, std::string_view name) const {
  if (std::none_of(names.begin(), names.end(), [&](const std::string& n) { return fits_pattern(n, name); }))
    return false;
  if (property.empty()) return true;
  const auto found = state.properties.find(property);
  return (found == state.properties.end() ? "" : found->second) == value;
}

BlockOptics GameRules::optics(const world::BlockState& state) const {
  std::string_view name = state.name;
  if (!namespace_.empty() && name.starts_with(namespace_) && name.substr(namespace_.size()).starts_with(':'))
    name.remove_prefix(namespace_.size() + 1);
  BlockOptics optics{.loss = 0};
  const auto row_of = [&](const std::vector<Row>& rows) {
    return std::find_if(rows.begin(), rows.end(), [&](const Row& row) { return row.fits(state, name); });
  };
  if (const auto row = row_of(blocks_); row != blocks_.end()) optics = row->optics;
  if (const auto row = row_of(sources_); row != sources_.end()) optics.level = row->optics.level;
  if (sources_take_light_ && optics.level > 0 && optics.loss == 0) optics.loss = 1;
  return optics;
}

world::Result<GameRules> read_game_rules(std::string_view text, const std::string& file_name) {
  TRY(world::TomlDocument document, world::TomlDocument::parse(text, file_name));
  GameRules rules;
  world::TomlTable root = document.root();
  constexpr world::NumberRange kLevels{.min = 1, .max = world::kMaxLight};
  root.require("namespace", rules.namespace_);
  root.require("sky_level", rules.sky_level_, kLevels);
  root.read("sources_take_light", rules.sources_take_light_);
  const auto read_row = [&](world::TomlTable& table, GameRules::Row& row) {
    table.require("names", row.names);
    std::string when;
    if (!table.read("when", when)) return;
    const size_t equals = when.find('=');
    if (equals == when.npos || equals == 0) table.fail("when", "'when' must be \"property=value\"");
    row.property = when.substr(0, equals);
    if (equals != when.npos) row.value = when.substr(equals + 1);
  };
  for (world::TomlTable& table : root.array_of_tables("blocks")) {
    GameRules::Row& row = rules.blocks_.emplace_back();
    read_row(table, row);
    int32_t loss = 1;
    table.require("loss", loss, kLevels);
    row.optics.loss = static_cast<uint8_t>(loss);
    table.read("passes_sky", row.optics.passes_sky);
    if (row.optics.passes_sky && loss != 1) table.fail("loss", "what passes the sky must have a 'loss' of 1");
  }
  for (world::TomlTable& table : root.array_of_tables("sources")) {
    GameRules::Row& row = rules.sources_.emplace_back();
    read_row(table, row);
    int32_t level = 0;
    table.require("level", level, kLevels);
    row.optics.level = static_cast<uint8_t>(level);
  }
  TRY_STATUS(document.finish());
  return rules;
}

world::Result<GameRules> game_rules(std::string_view game) {
  std::string known;
  for (const world::EmbeddedText* file = world::light_game_files; file->name; ++file) {
    const std::string_view stem = std::string_view(file->name).substr(0, std::string_view(file->name).rfind('.'));
    const std::string_view name = stem.substr(stem.rfind('/') + 1);
    if (name == game) return read_game_rules(file->text, file->name);
    known += (known.empty() ? "" : ", ") + std::string(name);
  }
  return world::usage_error("no rules of light are known for '" + std::string(game) + "'; there are " + known);
}

}  // namespace sim
