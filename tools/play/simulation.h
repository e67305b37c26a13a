/// What happens in a played world, without a window: matter, the player, edits, and time that goes back. The state is a
/// function of the world at first and of the calls in their order, so a recording of the calls repeats it anywhere.
#pragma once

#include <memory>

#include "sim/matter/matter.h"
#include "tools/play/history.h"
#include "tools/play/walker.h"

namespace tools {

constexpr uint64_t kTicksKept = 32;  // a moment to step back to is kept so often, while anything moves
// In worlds of more regions than this matter moves only in those nearer than this to the player; the rest waits.
constexpr size_t kMostSimulated = 16;
constexpr int32_t kSimulatedM = 48, kAroundM = 24;  // looked at anew where the player has gone so far

class PlaySimulation {
 public:
  /// The world must outlive it and stay where it is. The player goes where it was saved, or to where the world's first
  /// camera is, or above the middle of the ground.
  static world::Result<std::unique_ptr<PlaySimulation>> make(world::World& world);

  // ---- what a recording holds ----
  void walk(const WalkInput& input);  // a tick of the player
  void step_matter();                 // a tick of matter
  /// Voxels and boxes, now. What overlaps the player is up to the caller.
  world::Result<world::EditReport> edit(const world::EditBatch& batch);
  bool undo();
  bool redo();
  /// To the tick before this one; false where the history doesn't reach so far.
  bool step_back();
  void set_mode(bool flies, bool passes);
  void teleport(const world::WorldPoint& foot);

  /// Kept with the world, for its pictures.
  void keep_knob(const std::string& name, const std::string& value);

  // ---- reading ----
  const sim::Matter& matter() const { return *matter_; }
  sim::Matter& matter() { return *matter_; }
  const Walker& walker() const { return *walker_; }
  const History& history() const { return *history_; }
  uint64_t tick() const { return matter_->tick(); }
  world::World& world() { return world_; }
  /// Of blocks, layers, what rules hold, and the player.
  uint64_t hash();
  double matter_ms() const { return matter_ms_; }  // the last tick that did anything
  /// Writes all into the world, that it may be saved: what rules hold, the tick, where the player is and looks.
  void prepare_save(double yaw, double pitch);
  bool edited() const { return edited_; }

 private:
  explicit PlaySimulation(world::World& world) : world_(world) {}
  world::Status make_matter(uint64_t tick);
  /// Tells matter which regions are near enough.
  void simulate_around(world::VoxelPos around);
  bool take(const std::optional<History::Restored>& restored, uint64_t to_tick);
  void keep_moment(uint64_t tick);

  world::World& world_;
  sim::MatterOptions options_;
  std::unique_ptr<sim::Matter> matter_;
  std::unique_ptr<Walker> walker_;
  std::unique_ptr<History> history_;
  world::VoxelPos around_{INT32_MIN, 0, 0};
  // What follows the store can't be told to stop: what a matter that is gone left behind is emptied now and then.
  std::vector<int> left_behind_, of_matter_;
  double matter_ms_ = 0;
  bool edited_ = false;
};

/// Where a player begins, and looks.
struct Start {
  world::WorldPoint foot;
  double yaw = 0, pitch = 0;  // radians: yaw 0 looks along -z, grows to the right; pitch grows upwards
  bool flies = false;
};
Start start_of(const world::World& world);

}  // namespace tools
