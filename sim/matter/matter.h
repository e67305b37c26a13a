/// Matter of one world, tick by tick: the rules that its content calls for, on the leaves that are awake.
///
/// Everything that moves is integer. The state after a tick is a function of the world, the seed and the tick's number:
/// not of the threads, the order of leaves, which leaves were awake beyond need, or how often it was written back.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sim/bodies/inhabitants.h"
#include "sim/knobs.h"
#include "sim/matter/edit_queue.h"
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

/// Which rules a world calls for as it is, by its census, its scene's requests and what ran when it was saved, and why;
/// one a row of rule_rows(). Nothing is made or run.
std::vector<EffectReport> called_rules(const world::World& world);

struct StepReport {
  uint64_t leaves_visited = 0;  // by all rules
  uint64_t voxels_changed = 0;
};

/// One substance, or heat, in the books: start + in - out = now, to the unit.
struct LedgerRow {
  std::string substance;       // "heat": beyond what blocks are born with, as the layer of that name
  int64_t start = 0, now = 0;  // in units of 1/4096 m^3 at rest; of heat in 20 J
  int64_t in = 0, out = 0;  // what rules made and took away, edits put in and took out, and came and went with regions
  bool is_heat = false;
  bool exact() const { return start + in - out == now; }
};

struct MatterOptions {
  uint64_t seed = 1;
  uint64_t tick = 0;                      // of the world: what was simulated before
  std::vector<std::string> effects = {};  // asked for beyond what the content calls for
  SimKnobs knobs = {};
  std::vector<std::string> without = {};            // rules that are left out as if the program had none of that name
  std::vector<Reaction> reactions = {};             // of the scene, beyond the rows of reactions.toml
  std::vector<world::ParticleSource> sources = {};  // the world's own, set by Matter
  double rest_k = kRestKelvin;                      // what nothing heats or cools; Matter takes the world's
};
/// What a world says of its own simulation: seed, effects, knobs over those of `accuracy`, and reactions, each checked.
/// Errors name the file, line and column of a reaction, or the knob.
world::Result<MatterOptions> matter_options(const world::World& world, world::Accuracy accuracy);

class Matter {
 public:
  /// The world must outlive it. Its blocks may be edited after a flush(), before the next step(); by edit() at any
  /// time. Everything that may move is awake at first.
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
  /// Writes voxels and boxes at the start of the next tick, in the order of calls; on any thread, while step() runs
  /// too. A fluid comes as full voxels; what was in a voxel goes, to the unit, and the ledger has both. A
  /// voxel that is of the block already stays as it is. Fails, and
  /// takes nothing, as EditQueue::push() does. What lies in a region that is unloaded waits until it is there.
  world::Status edit(const world::EditBatch& batch) { return edits_.push(batch, world_.palette->size()); }
  /// At the start of that tick, in an order that doesn't depend on which thread came first.
  world::Status edit(const world::EditBatch& batch, const EditTime& time) {
    return edits_.push(batch, time, world_.palette->size());
  }
  /// That the blocks of a region are not in the store, or are again: what would move there waits at its border, asleep.
  /// Between steps; flush() before the store forgets a region, then tell of it here.
  void set_unloaded(world::RegionPos r, bool unloaded);
  /// Looks at all that may move in the next tick: changes nothing of what happens.
  void wake_all();
  /// Whether nothing is awake, and no edit waits: a step would visit no leaf.
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
  /// Every substance that was there at the start, is there, or was made, sorted by name; then heat, where there was
  /// any.
  std::vector<LedgerRow> ledger();
  /// How much liquid or gas a voxel holds, 0 to about kFullVoxel.
  int amount_at(world::VoxelPos v) const;
  /// Every rule, bodies and particles, also those that were not called for.
  std::vector<EffectReport> effects() const;
  /// Takes the particles out, and puts in those of another matter of the same world: they are no part of its state, so
  /// they may go on where it is made anew. Puts nothing in where the world asks for none.
  std::unique_ptr<Particles> release_particles() { return inhabitants_ ? inhabitants_->release_particles() : nullptr; }
  void adopt_particles(std::unique_ptr<Particles> particles) {
    if (inhabitants_ && particles) inhabitants_->adopt_particles(std::move(particles));
  }
  const Bodies* bodies() const { return inhabitants_ ? inhabitants_->bodies() : nullptr; }
  const Particles* particles() const { return inhabitants_ ? inhabitants_->particles() : nullptr; }
  size_t bytes() const;

 private:
  struct Running;
  StepReport step_rules(const Tick& tick);
  /// What the store holds.
  struct Stored {
    std::map<world::BlockId, int64_t> amounts;
    int64_t heat = 0;
  };
  Stored stored() const;
  Stored booked() const;  // what it should, by the books
  void make_cells();
  void call_rules();
  void note_edits();
  void apply(const std::vector<world::EditBatch>& batches);
  void close();
  bool closed_ = false;
  world::World& world_;
  MatterOptions options_;
  uint64_t tick_;
  int subscriber_;                    // of the store: ours until there are cells, then theirs
  std::vector<std::string> ran_;      // names of the rules that ran when the world was saved
  size_t made_kinds_ = 0;             // blocks that rules made any of
  std::vector<uint8_t> out_of_rest_;  // by block: where something feels heat
  std::unique_ptr<Cells> cells_;
  Stored start_;
  std::optional<Stored> flushed_;                   // when it was last written; else the books say
  std::map<world::BlockId, Cells::Booked> edited_;  // by others, in the store
  Cells::Booked edited_heat_;
  EditQueue edits_;
  std::set<world::RegionPos> away_;
  std::map<world::RegionPos, world::EditBatch> waiting_;  // for regions that are away
  std::vector<world::EditBatch> arrived_;                 // waited, and are due
  std::vector<Running> rules_;                            // one a row of rule_rows()
  std::unique_ptr<Inhabitants> inhabitants_;              // null: none
};

}  // namespace sim
