#include "world/formats/translation/translation.h"

#include <algorithm>
#include <charconv>
#include <memory>

#include <fmt/format.h>

#include "world/base/embedded.h"
#include "world/base/toml_reader.h"
#include "world/formats/translation/numeric_ids.h"
#include "world/proxies/proxy.h"

#include "translation_files.h"

namespace world {
namespace {

constexpr Ratio3 kPlaceholderAlbedo{0.8f, 0.02f, 0.6f};  // seen at once: nothing in nature looks like it
constexpr size_t kMostPlaceholders = 4096;               // further names share one
constexpr int kMostSteps = 6;                            // names that lead to other names

using Bindings = std::map<std::string, std::string>;

struct Rule {
  std::vector<std::string> match, base, keep;
  BlockState when;
  std::string block, like, proxy;
  std::optional<Ratio3> albedo;
  std::optional<Power3> emission;
  std::optional<bool> opaque;
  std::optional<Phase> phase;
  std::string bsdf;
};

/// A rule for one name, its placeholders filled in.
struct Bound {
  const Rule* rule;
  Bindings keys, values;  // of the lists
  std::string star;       // of match, where it has one: before and after the *
};

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

std::string filled(std::string text, const Bindings& bindings, std::string_view star) {
  for (const auto& [key, value] : bindings) text = replaced(std::move(text), "{" + key + "}", value);
  return replaced(std::move(text), "*", star);
}

/// What stands for the * of a pattern, or nothing.
std::optional<std::string> star_of(std::string_view pattern, std::string_view name) {
  const size_t at = pattern.find('*');
  const std::string_view before = pattern.substr(0, at), after = pattern.substr(at + 1);
  if (name.size() < before.size() + after.size() + 1 || !name.starts_with(before) || !name.ends_with(after)) return {};
  return std::string(name.substr(before.size(), name.size() - before.size() - after.size()));
}

bool holds(const BlockState& when, const BlockState& state) {
  return std::all_of(when.properties.begin(), when.properties.end(), [&](const auto& wanted) {
    const auto found = state.properties.find(wanted.first);
    return (found == state.properties.end() ? "" : found->second) == wanted.second;
  });
}

}  // namespace

class TranslationTable {
 public:
  static std::unique_ptr<TranslationTable> parse(const EmbeddedText& file) {
    auto table = std::make_unique<TranslationTable>();
    const Status read = table->read(file.text, file.name);
    if (!read.ok()) std::cerr << read.error().message << '\n';
    CHECK(read.ok());
    return table;
  }

  std::optional<Translated> find(const BlockState& state, int steps) const {
    if (steps > kMostSteps) return {};
    if (const auto found = exact_.find(state.name); found != exact_.end())
      for (const Bound& bound : found->second)
        if (auto made = apply(bound, state, steps)) return made;
    for (const auto& [pattern, bound] : patterns_)
      if (auto star = star_of(pattern, state.name)) {
        Bound with_star = bound;
        with_star.star = std::move(*star);
        if (auto made = apply(with_star, state, steps)) return made;
      }
    return {};
  }
  std::string foreign_name(std::string_view loam_name) const {
    const auto found = foreign_.find(std::string(loam_name));
    return found == foreign_.end() ? "" : qualified(found->second);
  }
  /// The name without the namespace of the game.
  std::string bare(const std::string& name) const {
    return !namespace_.empty() && name.starts_with(namespace_ + ":") ? name.substr(namespace_.size() + 1) : name;
  }
  std::string qualified(const std::string& name) const {
    return namespace_.empty() || name.find(':') != std::string::npos ? name : namespace_ + ":" + name;
  }
  /// "minecraft:300:2": a numeric id without a name, as one.
  std::string of_game(std::string_view id) const { return namespace_ + ":" + std::string(id); }
  const NumericIds& ids() const { return ids_; }

  Status read(std::string_view text, const std::string& file_name) {
    TRY(TomlDocument document, TomlDocument::parse(text, file_name));
    TomlTable root = document.root();
    root.read("namespace", namespace_);
    for (TomlTable lists : root.table("list"))
      for (auto& [name, table] : lists.tables())
        for (const std::string& key : table.keys()) table.read(key, lists_[name][key]);
    for (const char* kind : {"blocks", "like"})
      for (TomlTable table : root.table(kind))
        for (const std::string& key : table.keys()) {
          Rule rule;
          rule.match = {key};
          table.read(key, kind[0] == 'b' ? rule.block : rule.like);
          add(std::move(rule), table, key);
        }
    for (TomlTable table : root.array_of_tables("rule")) {
      Rule rule;
      if (!table.has_array("match"))
        table.require("match", rule.match.emplace_back());
      else
        table.read("match", rule.match);
      std::string when;
      if (table.read("when", when)) rule.when = parse_state("[" + when + "]");
      table.read("block", rule.block);
      table.read("like", rule.like);
      table.read("base", rule.base);
      table.read("keep", rule.keep);
      table.read("proxy", rule.proxy);
      table.read("bsdf", rule.bsdf);
      float bands[3];
      if (table.read("albedo", std::span<float>(bands))) rule.albedo = Ratio3{bands[0], bands[1], bands[2]};
      if (table.read("emission_w", std::span<float>(bands))) rule.emission = Power3{bands[0], bands[1], bands[2]};
      bool opaque = true;
      if (table.read("opaque", opaque)) rule.opaque = opaque;
      int phase = 0;
      constexpr std::string_view kPhases[] = {"gas", "liquid", "granular", "solid"};
      if (table.read_choice("phase", phase, kPhases)) rule.phase = static_cast<Phase>(phase);
      if (rule.block.empty() + rule.like.empty() + rule.base.empty() != 2)
        table.fail({}, "a rule needs exactly one of block, like and base");
      add(std::move(rule), table, "match");
    }
    ids_.read(root);
    return document.finish();
  }

 private:
  /// Registers a rule under each name that its lists make.
  void add(Rule made, TomlTable& table, const std::string& key) {
    rules_.push_back(std::make_unique<Rule>(std::move(made)));
    const Rule& rule = *rules_.back();
    for (const std::string& match : rule.match) {
      std::vector<std::pair<std::string, Bound>> names = {{match, {&rule, {}, {}, {}}}};
      for (const auto& [list, entries] : lists_) {
        if (match.find("{" + list + "}") == std::string::npos) continue;
        std::vector<std::pair<std::string, Bound>> more;
        for (const auto& [name, bound] : names)
          for (const auto& [entry, value] : entries) {
            more.emplace_back(replaced(name, "{" + list + "}", entry), bound);
            more.back().second.keys[list] = entry;
            more.back().second.values[list] = value;
          }
        names = std::move(more);
      }
      for (auto& [name, bound] : names) {
        for (const std::string& loam : {rule.block, rule.like}) {
          const std::string known = filled(loam, bound.values, "*");
          if (!known.empty() && known.find('*') == std::string::npos && !standard_blocks().find(known))
            table.fail(key, "'" + name + "' leads to '" + known + "', and there is no such block");
        }
        if (!rule.block.empty() && rule.when.properties.empty())
          foreign_.emplace(filled(rule.block, bound.values, ""), name);
        if (name.find('*') == std::string::npos)
          exact_[name].push_back(std::move(bound));
        else
          patterns_.emplace_back(name, std::move(bound));
      }
    }
  }

  std::optional<Translated> apply(const Bound& bound, const BlockState& state, int steps) const {
    const Rule& rule = *bound.rule;
    if (!holds(rule.when, state)) return {};
    if (!rule.block.empty()) {
      const auto id = standard_blocks().find(filled(rule.block, bound.values, bound.star));
      if (!id) return {};
      return Translated{standard_blocks()[*id], true};
    }
    std::optional<Translated> made;
    if (!rule.like.empty()) {
      if (const auto id = standard_blocks().find(filled(rule.like, bound.values, bound.star)))
        made = Translated{standard_blocks()[*id], false};
    }
    for (const std::string& base : rule.base) {
      if (made) break;
      const std::string name = filled(base, bound.keys, bound.star);
      if (name != state.name) made = find({name, state.properties}, steps + 1);
    }
    if (!made || made->block.name == "air") return {};
    Block& block = made->block;
    made->same = false;
    BlockState own{qualified(state.name), {}};
    const auto keep = [&](const std::string& key) {
      if (const auto found = state.properties.find(key); found != state.properties.end())
        own.properties[key] = found->second;
    };
    for (const std::string& key : rule.keep) keep(key);
    if (!rule.proxy.empty()) {
      std::string proxy = filled(rule.proxy, bound.values, bound.star);
      for (const auto& [key, value] : state.properties) {
        if (proxy.find("{" + key + "}") == std::string::npos) continue;
        proxy = replaced(std::move(proxy), "{" + key + "}", value);
        keep(key);
      }
      if (find_proxy(proxy)) {
        block.proxy = proxy;
        block.opaque = false;
      }
    }
    if (rule.albedo) block.albedo = *rule.albedo;
    if (rule.emission) block.emission = *rule.emission;
    if (rule.opaque) block.opaque = *rule.opaque;
    if (rule.phase) block.phase = *rule.phase;
    if (!rule.bsdf.empty()) block.bsdf = rule.bsdf;
    if (block.opaque) block.absorption = {};
    block.name = plain_name(state_text(own));
    return made;
  }

  std::string namespace_;
  std::map<std::string, std::map<std::string, std::string>> lists_;
  std::vector<std::unique_ptr<Rule>> rules_;
  std::unordered_map<std::string, std::vector<Bound>> exact_;
  std::vector<std::pair<std::string, Bound>> patterns_;
  std::unordered_map<std::string, std::string> foreign_;  // Loam's name -> the first name in the table
  NumericIds ids_;
};

BlockState parse_state(std::string_view text) {
  BlockState state;
  const size_t bracket = text.find('[');
  state.name = text.substr(0, bracket);
  if (bracket == std::string_view::npos) return state;
  text = text.substr(bracket + 1);
  if (text.ends_with(']')) text.remove_suffix(1);
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(','));
    const size_t equals = one.find('=');
    if (equals != std::string_view::npos) state.properties[std::string(one.substr(0, equals))] = one.substr(equals + 1);
    text.remove_prefix(std::min(one.size() + 1, text.size()));
  }
  return state;
}

std::string state_text(const BlockState& state) {
  std::string text = state.name;
  char before = '[';
  for (const auto& [key, value] : state.properties) {
    text += before;
    text += key + "=" + value;
    before = ',';
  }
  if (before == ',') text += ']';
  return text;
}

const TranslationTable& translation_table(std::string_view game) {
  static const std::map<std::string, std::unique_ptr<TranslationTable>, std::less<>> tables = [] {
    std::map<std::string, std::unique_ptr<TranslationTable>, std::less<>> all;
    for (const EmbeddedText* file = translation_files; file->name; ++file)
      all[std::string(file->name).substr(0, std::string_view(file->name).find('.'))] = TranslationTable::parse(*file);
    return all;
  }();
  const auto found = tables.find(game);
  CHECK(found != tables.end());
  return *found->second;
}

Status check_translation_table(std::string_view text, const std::string& file_name) {
  return TranslationTable().read(text, file_name);
}

std::optional<Translated> translate(const TranslationTable& table, const BlockState& state) {
  return table.find({table.bare(state.name), state.properties}, 0);
}

std::string numeric_state(const TranslationTable& table, std::string_view text) {
  const auto numeric = parse_numeric(text);
  return numeric ? table.ids().state(numeric->id, numeric->data) : "";
}

std::string foreign_name(const TranslationTable& table, std::string_view loam_name) {
  const std::string name = table.foreign_name(loam_name);
  if (name.empty()) return name;
  // A rule before it may lead elsewhere.
  const auto back = translate(table, {name, {}});
  return back && back->same && back->block.name == loam_name ? name : "";
}

std::string written_state(const TranslationTable& table, const Block& block) {
  if (block.name == "air") return "minecraft:air";
  if (const std::string name = foreign_name(table, block.name); !name.empty()) {
    const auto own = standard_blocks().find(block.name);
    if (own && toml_from_block(standard_blocks()[*own]) == toml_from_block(block)) return name;
  }
  if (const auto back = translate(table, parse_state(block.name));
      back && !back->same && toml_from_block(back->block) == toml_from_block(block))
    return block.name;
  return "loam:" + block.name;
}

// ---- Translator ------------------------------------------------------------------------------------------------

Translator::Translator(const TranslationTable& table, BlockPalette& palette, const BlockPalette* definitions)
    : table_(table), palette_(palette), definitions_(definitions) {}

BlockId Translator::block(std::string_view text) {
  BlockState state = parse_state(text);
  std::string known_as = state.name;
  if (const auto numeric = parse_numeric(text)) {
    const std::string named = table_.ids().state(numeric->id, numeric->data);
    if (!named.empty())
      state = parse_state(named);
    else if (const auto found = id_names_.find(numeric->id); found != id_names_.end())
      state = {found->second, {}};
    known_as = named.empty() && state.name == text.substr(0, state.name.size()) ? table_.of_game(text)
                                                                                : table_.qualified(state.name);
  }
  if (state.name.starts_with("loam:")) {
    const std::string name = state_text(state).substr(5);
    for (const BlockPalette* blocks : {definitions_, &standard_blocks()})
      if (const auto id = blocks ? blocks->find(name) : std::nullopt)
        if (const auto added = palette_.add((*blocks)[*id])) return *added;
  }
  if (auto made = translate(table_, state)) {
    if (made->block.name == "air") return kAir;
    if (const auto there = palette_.find(made->block.name)) return *there;
    if (const auto added = palette_.add(std::move(made->block))) return *added;
  }
  return placeholder(known_as);
}

std::vector<BlockId> Translator::blocks(const StateTable& states) {
  std::vector<StateNumber> order(states.texts().size());
  for (StateNumber i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](StateNumber a, StateNumber b) { return states.texts()[a] < states.texts()[b]; });
  std::vector<BlockId> all(order.size());
  for (const StateNumber i : order) all[i] = block(states.texts()[i]);
  return all;
}

BlockId Translator::placeholder(const std::string& name) {
  Block block;
  block.name = plain_name(name.find(':') == std::string::npos ? table_.qualified(name) : name);
  if (block.name.find(':') == std::string::npos || block.name[0] == ':') block.name = "unknown:" + block.name;
  if (placeholders_.size() >= kMostPlaceholders) block.name = "unknown:more";
  block.albedo = kPlaceholderAlbedo;
  const std::string shown = block.name;
  const auto id = palette_.add(std::move(block));
  if (!id) return placeholders_.empty() ? BlockId{1} : placeholders_.begin()->first;  // no id is left
  placeholders_.emplace(*id, shown);
  return *id;
}

Status Translator::finish(World& world, std::string_view format, const std::filesystem::path& file,
                          const ImportOptions& options, ImportReport& report,
                          const std::optional<LeftBehind>& left_behind) const {
  set_origin(world, format, file);
  if (left_behind) {
    report.fact("left behind",
                fmt::format("{} entities, {} block entities", left_behind->entities, left_behind->block_entities));
  }
  if (placeholders_.empty()) return {};
  for (const auto& [id, count] : world.store.census())
    if (const auto found = placeholders_.find(id); found != placeholders_.end())
      report.unmapped[found->second] += count;
  if (!options.strict || report.unmapped.empty()) return {};
  return input_error(fmt::format(
      "{}: {} kinds of block have no match, the first is '{}'; add a row to world/formats/translation, or leave "
      "--strict out to get placeholders",
      file.string(), report.unmapped.size(), report.unmapped.begin()->first));
}

std::string plain_name(std::string_view bytes) {
  std::string name;
  for (const char c : bytes.substr(0, 256)) name += c > ' ' && c < 127 && c != '"' && c != '\\' ? c : '_';
  return name;
}

}  // namespace world
