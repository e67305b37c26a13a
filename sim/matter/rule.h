/// A rule of matter: one file in sim/matter/rules that defines
///   RuleInfo <name>_info();
///   std::unique_ptr<Rule> make_<name>_rule(size_t rule);
/// The folder is the registry.
///
/// A rule is called for by blocks of the census, by name in the scene's [simulation] table, or because it ran when the
/// world was saved. Where it isn't, it is never made: it enters no tick and holds no byte.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sim/matter/cells.h"
#include "world/base/errors.h"

namespace sim {

/// What a rule did in one tick.
struct RuleReport {
  uint64_t leaves_visited = 0;
  uint64_t voxels_changed = 0;
  size_t bytes = 0;  // of what the rule holds, beside the pages
  double ms = 0;
  std::vector<std::string> notes;  // for people: a loop of reactions, energy that left
};

struct MatterOptions;

struct Tick {
  uint64_t number = 0;
  uint64_t seed = 0;
  const MatterOptions* options = nullptr;
};

/// What a rule says of itself.
struct RuleInfo {
  std::string_view name;
  std::string_view what;
  std::string_view conserves;
  std::string_view layers;  // of the world, that it reads and writes
  /// Whether a voxel of this block calls for the rule.
  bool (*calls)(const world::Block& block) = nullptr;
  bool feels_heat = false;  // awake where it becomes warmer or colder, too
  bool reacts = false;      // called for by what a scene's own reactions name, too
};

class Rule {
 public:
  virtual ~Rule() = default;
  /// Before its first tick; the store holds all that the cells do.
  virtual void start(Cells&, const MatterOptions&) {}
  /// What it holds beside blocks and layers and needs to go on as if never stopped, as lines of text; empty where it
  /// holds nothing. It counts in the hash of the state, and is saved with the world.
  virtual std::string state() const { return {}; }
  /// Takes in what state() gave, after start(). Fails where that isn't a state of this rule in this world.
  virtual world::Status restore(Cells&, std::string_view) { return {}; }
  /// One tick of it on the pages that are awake for it; changes are told to cells.wake().
  virtual RuleReport step(Cells& cells, const Tick& tick) = 0;
};

struct RuleRow {
  RuleInfo info;
  /// `rule`: its number among the awake sets of the cells.
  std::unique_ptr<Rule> (*make)(size_t rule);
};
/// Every rule of sim/matter/rules, in the order in which a tick runs them: that of their names.
const std::vector<RuleRow>& rule_rows();

}  // namespace sim
