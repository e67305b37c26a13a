/// What the world was: undo, redo and steps back through edits and through what the automata did since.
///
/// The history is a chain of intervals. Each begins with a moment (the tick, and what rules hold beside blocks and
/// layers) and perhaps an edit, and holds for each leaf that changed until its end what the changed voxels were before,
/// of blocks and of integer layers. Going back swaps these with the store, so that going forth is the same once more.
///
///   interval 0          interval 1                 interval 2 (open: its changes lie in the store only)
///   edit, 40 ticks      edit, 64 ticks             64 ticks so far ...
///
/// Undo goes to the moment before the last edit: time goes back with it, and goes on from there without the edit. Redo
/// goes forth to the moment at which undo was asked for. A step back goes to the last moment kept at or before the tick
/// that is wanted; who asked makes the edit there and steps on to the tick, which gives the same state as before.
///
/// cost   an edit: its changed leaves, 1 KiB each, compared and kept once; integer layers are compared as a whole
/// fails  where more than most_bytes would be kept, moments without an edit go first, then the oldest edits: they can't
///        be undone any more
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "tools/play/known_blocks.h"
#include "world/world.h"

namespace tools {

class History {
 public:
  /// Follows the world's blocks and integer layers from now on; it must outlive this and stay where it is. What the
  /// simulation keeps in pages of its own must have been written back before each call.
  explicit History(world::World& world, size_t most_bytes = size_t{256} << 20);

  /// Begins an interval at this tick, with the edit that comes next, or none (nullopt) where only time passes. An edit
  /// ends what could be redone.
  void begin(uint64_t tick, std::optional<world::EditBatch> edit, world::VoxelPos around = {});

  struct Moment {
    uint64_t tick = 0;
    std::map<std::string, std::string> state = {};  // world.simulation.state
    world::VoxelPos around = {};                    // where matter is simulated
  };
  /// What to do after the world was put back: the simulation is made anew at this tick, then the edit is made again
  /// where there is one.
  struct Restored {
    uint64_t tick = 0;
    std::optional<world::EditBatch> edit = {};
    world::VoxelPos around = {};
  };
  /// Nothing where there is no edit to take back. `tick` is the one that the world is at.
  std::optional<Restored> undo(uint64_t tick, world::VoxelPos around = {});
  std::optional<Restored> redo();
  /// To the last moment kept at or before `target`, which is before `tick`.
  std::optional<Restored> back_to(uint64_t target, uint64_t tick, world::VoxelPos around = {});

  size_t undo_steps() const;  // edits that can be taken back
  size_t redo_steps() const { return redo_.size(); }
  uint64_t open_since() const { return intervals_.empty() ? 0 : intervals_.back().begin.tick; }
  size_t bytes() const;  // kept for all this

 private:
  /// Bits of `changed` are voxels whose values are kept, in index order.
  template <class T>
  struct LeafChange {
    world::LeafPos leaf;
    world::LeafMask changed;
    std::vector<T> values;
  };
  struct LayerChange {  // all of a leaf: which voxels were active, and their values
    world::LeafPos leaf;
    world::LeafMask active;
    std::vector<int32_t> values;
  };
  struct Interval {
    Moment begin = {};
    bool closed = false;  // its changes are below; else they lie in the store only
    std::optional<world::EditBatch> edit = {};
    std::vector<LeafChange<world::BlockId>> blocks = {};
    std::map<world::Layer, std::vector<LayerChange>> layers = {};
    size_t bytes = 0;
  };
  struct Redo {
    size_t first = 0;  // where in the chain its intervals go, counted with those that were dropped
    std::vector<Interval> intervals;
    Moment end;
  };
  using Blocks = KnownBlocks::Blocks;

  /// Keeps what changed since the open interval began, and takes it as known.
  void close();
  void close_layers(Interval& open);
  /// Swaps the interval's changes with the store: the other way round after each call.
  void swap(Interval& interval);
  /// Puts the store back to where interval `first` began; those taken back move out, oldest first.
  std::vector<Interval> rewind(size_t first);
  /// The same, and they can be redone up to `end`. Where something can be redone already, time that passed since then
  /// is not kept: that begins where this ends.
  std::vector<Interval>& rewind_to_redo(size_t first, Moment end);
  void restore(const Moment& moment);
  void drop_oldest();
  /// Makes one interval of two, the second of which begins with no edit.
  static void merge(Interval& first, Interval&& second);

  world::World& world_;
  size_t most_bytes_, closed_bytes_ = 0;
  size_t dropped_ = 0;  // intervals that were too old to keep
  int subscriber_;
  KnownBlocks known_;  // as the open interval began
  std::map<world::Layer, std::unordered_map<world::LeafPos, LayerChange, world::PosHash>> layers_;  // all, then
  std::deque<Interval> intervals_;                                                                  // the last is open
  std::vector<Redo> redo_;
};

}  // namespace tools
