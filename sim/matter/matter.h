/// Matter of one world, tick by tick: the rules that its content calls for, on the leaves that are awake.
///
/// Everything that moves is integer. The state after a tick is a function of the world, the seed and the tick's number:
/// not of the threads, the order of leaves, which leaves were awake beyond need, or how often it was written back.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sim/bodies/inhabitants.h"
#include "sim/knobs.h"
#include "sim/matter/reactions.h"
#include "sim/matter/rule.h"
#include "world/world.h"

namespace sim {

struct EffectReport {
  std::string name;
  bool called_for = false;
  std::string why;
  // Sums over all ticks so far.
  uint64_t leaves_visited = 0, voxels_changed = 0;
  uint64_t moved = 0;  // bodies or particles, those of each tick
  double ms = 0;
  size_t bytes = 0;
  std::vector<std::string> notes;  // of the last tick that had any
};

/// Which rules a world calls for as it is, by its census and its scene's requests, and why; one a row of rule_rows().
/// Nothing is made or run.
std::vector<EffectReport> called_rules(const world::World& world);

struct StepReport {
  uint64_t leaves_visited = 0;  // by all rules
  uint64_t voxels_changed = 0;
};

/// One substance in the books: start + in - out = now, to the unit.
struct LedgerRow {
  std::string substance;
  int64_t start = 0, now = 0;  // in units of 1/4096 m^3 at rest
  int64_t in = 0, out = 0;     // what rules made and took away, and what edits put in and took out
  bool exact() const { return start + in - out == now; }
};

struct MatterOptions {
  uint64_t seed = 1;
  uint64_t tick = 0;                      // of the world: what was simulated before
  std::vector<std::string> effects = {};  // asked for beyond what the content calls for
  SimKnobs knobs = {};
  std::vector<Reaction> reactions = {};             // of the scene, beyond the rows of reactions.toml
  std::vector<world::ParticleSource> sources = {};  // the world's own, set by Matter
};

class Matter {
 public:
  /// The world must outlive it; its blocks may be edited between steps. Everything that may move is awake at first.
  Matter(world::World& world, const MatterOptions& options);
  ~Matter();

  /// Puts in the bodies and particles that the world asks for, or goes on where save_state() left off. Once, before the
  /// first step; without it there are none. Fails where the world asks for what can't be, or its state is damaged.
  world::Status begin();
  /// Writes all of the state to the world, blocks and layers and what else rules and bodies hold: whoever saves the
  /// world then, loads it, and makes a Matter of it at this tick, goes on as if nothing had been in between.
  void save_state();

  /// One tick. Edits of the store since the last flush() are taken in first.
  StepReport step();
  /// Looks at all that may move in the next tick: changes nothing of what happens.
  void wake_all();
  /// Whether nothing is awake: a step would visit no leaf.
  bool settled() const;
  size_t awake_leaves() const;
  uint64_t tick() const { return tick_; }
  /// Writes the state to the store, which lags behind it between.
  void flush();
  /// Of the world's blocks and layers, after flush(): the same for the same state, whatever led to it.
  uint64_t state_hash();
  /// How much there is of each block that is there: amounts of a liquid or gas, kFullVoxel for each voxel of another.
  std::map<world::BlockId, int64_t> amounts();
  int64_t amount(world::BlockId block);
  /// Every substance that was there at the start, is there, or was made; sorted by name.
  std::vector<LedgerRow> ledger();
  /// How much liquid or gas a voxel holds, 0 to about kFullVoxel.
  int amount_at(world::VoxelPos v) const;
  /// Every rule, bodies and particles, also those that were not called for.
  std::vector<EffectReport> effects() const;
  const Bodies* bodies() const { return inhabitants_ ? inhabitants_->bodies() : nullptr; }
  const Particles* particles() const { return inhabitants_ ? inhabitants_->particles() : nullptr; }
  size_t bytes() const;

 private:
  struct Running;
  StepReport step_rules(const Tick& tick);
  void call_rules();
  void follow_edits();
  void close();
  bool closed_ = false;
  world::World& world_;
  MatterOptions options_;
  uint64_t tick_;
  size_t made_kinds_ = 0;  // blocks that rules made any of
  std::unique_ptr<Cells> cells_;
  std::map<world::BlockId, int64_t> start_;
  world::Census flushed_;                           // of the store when it was last written
  std::map<world::BlockId, Cells::Booked> edited_;  // by others
  std::vector<Running> rules_;                      // one a row of rule_rows()
  std::unique_ptr<Inhabitants> inhabitants_;        // null: none
};

}  // namespace sim
