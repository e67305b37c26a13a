#include "sim/matter/reactions.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "world/base/embedded.h"
#include "world/base/text.h"
#include "world/base/toml_reader.h"

#include "reaction_files.h"

namespace sim {

using world::NumberRange;
using world::Status;
using world::TomlTable;

namespace {

constexpr std::array<std::string_view, 4> kBeside = {"any", "beside", "above", "below"};
constexpr NumberRange kKelvin{.min = 0, .max = 6000, .open_min = true};
constexpr double kBalance = 0.01;  // densities in world/blocks have three digits

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

/// "a" or "a + b"; false where a name is missing or there are three.
bool split_side(std::string_view side, std::string& first, std::string& second) {
  const size_t plus = side.find('+');
  first = trimmed(side.substr(0, plus));
  second = plus == side.npos ? std::string_view{} : trimmed(side.substr(plus + 1));
  const auto is_name = [](const std::string& s) { return !s.empty() && s.find_first_of(" +->") == s.npos; };
  return is_name(first) && (plus == side.npos || is_name(second));
}

Reaction read_row(TomlTable& table) {
  Reaction row;
  row.origin = table.where();
  table.require("what", row.what);
  std::string text;
  if (table.require("row", text)) {
    row.origin = table.where("row");
    const size_t arrow = text.find("->");
    const bool right = arrow != text.npos && split_side(std::string_view(text).substr(0, arrow), row.a, row.b) &&
                       split_side(std::string_view(text).substr(arrow + 2), row.c, row.d);
    if (!right || row.b.empty() != row.d.empty())
      table.fail("row", "'row' must be \"a -> c\" or \"a + b -> c + d\", with names of blocks");
  }
  int where = 0;
  if (table.read_choice("where", where, kBeside) && row.b.empty())
    table.fail("where", "'where' needs a second block in 'row'");
  row.where = static_cast<Beside>(where);
  std::array<int32_t, 2> rate = {1, 1};
  if (table.read("rate", std::span<int32_t>(rate), {.min = 1, .max = 1 << 20}) && rate[0] > rate[1])
    table.fail("rate", "'rate' must be at most 1: [chance, of] with chance <= of");
  row.chance = static_cast<uint32_t>(rate[0]), row.of = static_cast<uint32_t>(rate[1]);
  if (table.read("from_k", row.at_k, kKelvin)) row.when = Condition::from;
  if (table.has("to_k")) {
    if (row.when == Condition::from) table.fail("to_k", "a row has 'from_k' or 'to_k', not both");
    table.read("to_k", row.at_k, kKelvin);
    row.when = Condition::to;
  }
  table.read("heat_mj", row.heat_mj, {.min = -5000, .max = 5000});
  std::array<int32_t, 2> amounts = {4096, 4096};
  table.read("amounts", std::span<int32_t>(amounts), {.min = 0, .max = 65535});
  row.amount_c = amounts[0], row.amount_d = amounts[1];
  table.read("unbalanced", row.unbalanced);
  return row;
}

}  // namespace

std::vector<Reaction> read_reaction_rows(TomlTable& root) {
  std::vector<Reaction> rows;
  for (TomlTable& table : root.array_of_tables("reaction")) {
    rows.push_back(read_row(table));
    const bool known =
        std::any_of(rows.begin(), rows.end() - 1, [&](const Reaction& r) { return r.what == rows.back().what; });
    if (known) table.fail("what", "there is a reaction '" + rows.back().what + "' already");
  }
  return rows;
}

world::Result<ReactionTable> read_reactions(std::string_view text, const std::string& file_name) {
  TRY(world::TomlDocument document, world::TomlDocument::parse(text, file_name));
  ReactionTable all;
  TomlTable root = document.root();
  root.read("called_by", all.called_by);
  for (TomlTable& table : root.table("born_k"))
    for (const std::string& name : table.keys()) table.read(name, all.born_k[name], kKelvin);
  for (TomlTable& table : root.table("thins_out_per_s"))
    for (const std::string& name : table.keys())
      table.read(name, all.thins_out_per_s[name], NumberRange{.min = 0, .max = 10});
  all.rows = read_reaction_rows(root);
  for (TomlTable& table : root.array_of_tables("fuel")) {
    Fuel fuel;
    std::vector<std::string> blocks;
    table.require("blocks", blocks);
    table.require("mj_per_kg", fuel.mj_per_kg, NumberRange{.min = 0, .max = 200, .open_min = true});
    table.require("hours", fuel.hours, NumberRange{.min = 0.01, .max = 1000});
    table.require("leaves", fuel.leaves);
    for (const std::string& block : blocks) all.fuels[block] = fuel;
  }
  TRY_STATUS(document.finish());
  return all;
}

bool ReactionTable::is_called_by(std::string_view block) const {
  return std::find(called_by.begin(), called_by.end(), block) != called_by.end();
}

bool calls_for_heat(const world::Block& block) { return standard_reactions().is_called_by(block.name); }

const ReactionTable& standard_reactions() {
  static const ReactionTable table = [] {
    ReactionTable all;
    for (const world::EmbeddedText* file = world::reaction_files; file->name; ++file) {
      auto read = read_reactions(file->text, file->name);
      if (!read.ok()) std::cerr << read.error().message << '\n';
      CHECK(read.ok());
      all = std::move(*read);
    }
    return all;
  }();
  return table;
}

Status check_reaction(const Reaction& row, const world::BlockPalette& palette) {
  double mass[4] = {0, 0, 0, 0};
  const std::string* names[4] = {&row.a, &row.b, &row.c, &row.d};
  for (int i = 0; i < 4; ++i) {
    if (names[i]->empty()) continue;
    const auto id = palette.find(*names[i]);
    if (!id)
      return world::input_error(fmt::format("{}: reaction '{}': there is no block '{}'; the nearest is '{}'",
                                            row.origin, row.what, *names[i], palette.nearest_name(*names[i])));
    const world::Block& block = palette[*id];
    const bool fluid = *id != world::kAir && (block.phase == world::Phase::liquid || block.phase == world::Phase::gas);
    const int32_t amount = i == 2 ? row.amount_c : i == 3 ? row.amount_d : 4096;
    if (amount != 4096 && !fluid)
      return world::input_error(fmt::format("{}: reaction '{}': 'amounts' of '{}' must be 4096: it is no fluid",
                                            row.origin, row.what, *names[i]));
    if (amount == 0)
      return world::input_error(
          fmt::format("{}: reaction '{}': 'amounts' of '{}' is 0; write air instead", row.origin, row.what, *names[i]));
    mass[i] = block.density.value * amount / 4096;
  }
  const double before = mass[0] + mass[1], after = mass[2] + mass[3];
  const bool balanced = std::abs(after - before) <= kBalance * std::max(before, after);
  if (!balanced && row.unbalanced.empty())
    return world::input_error(
        fmt::format("{}: reaction '{}': {:.4g} kg become {:.4g} kg; balance 'amounts', or say why in 'unbalanced'",
                    row.origin, row.what, before, after));
  if (balanced && !row.unbalanced.empty())
    return world::input_error(fmt::format("{}: reaction '{}' is balanced: remove 'unbalanced'", row.origin, row.what));
  return {};
}

std::vector<std::vector<size_t>> reaction_loops(const std::vector<Reaction>& rows) {
  // Row i feeds j where it makes what j needs and i didn't need itself.
  const size_t n = rows.size();
  const auto makes = [](const Reaction& r, const std::string& block) {
    return !block.empty() && ((r.c == block && r.a != block) || (r.d == block && r.b != block));
  };
  std::vector<std::vector<uint8_t>> reaches(n, std::vector<uint8_t>(n, 0));
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j < n; ++j) reaches[i][j] = makes(rows[i], rows[j].a) || makes(rows[i], rows[j].b);
  for (size_t k = 0; k < n; ++k)
    for (size_t i = 0; i < n; ++i)
      if (reaches[i][k])
        for (size_t j = 0; j < n; ++j) reaches[i][j] |= reaches[k][j];
  std::vector<std::vector<size_t>> loops;
  std::vector<uint8_t> done(n, 0);
  for (size_t i = 0; i < n; ++i) {
    if (done[i] || !reaches[i][i]) continue;
    std::vector<size_t> loop;
    for (size_t j = i; j < n; ++j)
      if (reaches[i][j] && reaches[j][i]) {
        loop.push_back(j);
        done[j] = 1;
      }
    loops.push_back(std::move(loop));
  }
  return loops;
}

}  // namespace sim
