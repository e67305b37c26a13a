/// The simulation on a thread of its own, beside the one that draws. It owns the world that is played; who draws has a
/// copy, and gets the leaves that changed.
///
/// Requests are done at once, between ticks, in the order in which they came. Matter has a clock that can be paused,
/// slowed and sped up; the player's goes on. Where ticks take longer than they last, time is dropped and counted.
#pragma once

#include <algorithm>
#include <array>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "sim/clock.h"
#include "tools/inhabitants.h"
#include "tools/play/play_log.h"
#include "tools/play/simulation.h"
#include "world/saves/session.h"

namespace tools {

/// The world of a session of play, and where it is saved.
struct PlayedWorld {
  std::string name;                             // what its window and menu say
  std::string scene;                            // what load_scene() takes to make it again
  std::filesystem::path path;                   // of its save; empty: none
  std::unique_ptr<world::SaveSession> session;  // null: the world is in `own`, and can't be saved
  std::unique_ptr<world::World> own;
  world::World& world() { return session ? session->world() : *own; }
};

struct PlayRequest {
  enum class Kind { edit, undo, redo, back, step, mode, teleport, pause, speed, save, save_all, copy, look, knob };
  Kind kind = Kind::edit;
  world::EditBatch edit = {};
  world::WorldPoint foot = {};         // teleport
  bool flies = false, passes = false;  // mode
  bool on = false;                     // pause
  int speed_eighths = 8;               // speed
  double yaw = 0, pitch = 0;           // save, save_all, copy, look: where the player looks
  std::string name = {}, value = {};   // knob: of the world's pictures
  std::filesystem::path path = {};     // copy: where the whole world is written to, as it is
};

/// When the last tick of matter was due, by now_s(), and how long one lasts; 0: time stands.
struct MatterTime {
  double due_s = 0, tick_s = 0;
  /// Of the way to that tick, at `now_s`: what moves is drawn a tick late, and smoothly.
  double part(double now_s) const { return tick_s > 0 ? std::clamp((now_s - due_s) / tick_s, 0.0, 1.0) : 1; }
};

/// What there is to say of the simulation now.
struct PlayState {
  WalkState before, now;  // of the last tick of the player: drawn between them
  bool jumped = false;    // no picture between
  double tick_begun_s = 0;
  uint64_t tick = 0, applied = 0;  // of matter; requests done so far
  uint64_t copied_hash = 0;        // of the state that the last `copy` wrote
  MatterTime matter_time;
  bool paused = false, settled = true, edited = false;
  int speed_eighths = 8;
  size_t awake_leaves = 0, undo_steps = 0, redo_steps = 0, history_bytes = 0, matter_bytes = 0, store_bytes = 0;
  double matter_ms = 0;
  uint64_t dropped_ticks = 0;
  std::vector<sim::LedgerRow> ledger;
  std::vector<sim::EffectReport> effects;
  std::vector<world::LayerInfo> layers;
  int64_t saves = 0;
  bool saving = false;
  std::string unsaved;          // why the last save_all failed: one sentence; empty: it didn't
  std::string message;          // of the last request, or of a save that failed: one sentence; empty: none
  uint64_t message_number = 0;  // rises with each
};

using LeafValues = std::array<world::BlockId, world::kLeafVoxels>;
using LeafValuesMap = std::unordered_map<world::LeafPos, LeafValues, world::PosHash>;

/// Amounts of liquids that don't fill their voxels, of the leaves in which any changed: what the layer holds there now.
struct AmountChanges {
  struct Leaf {
    world::LeafMask active;
    std::array<int32_t, world::kLeafVoxels> values;
  };
  bool all = false;  // there are no others
  std::unordered_map<world::LeafPos, Leaf, world::PosHash> leaves;

  bool empty() const { return !all && leaves.empty(); }
  void put_into(world::Store& store) const;
};

class SimThread {
 public:
  struct Options {
    double autosave_s = 60;
    std::filesystem::path record;  // empty: nothing is recorded
  };
  /// Takes the world; what there is to draw at first must have been copied before start().
  static world::Result<std::unique_ptr<SimThread>> make(std::unique_ptr<PlayedWorld> played, const Options& options);
  ~SimThread();

  PlayedWorld& played() { return *played_; }  // before start() and after stop() only
  void start();
  /// Ends the thread; the world is written as it is where it can be saved. Says what went wrong.
  world::Status stop(double yaw, double pitch);

  /// Its number: done once state().applied is as large.
  uint64_t ask(PlayRequest request);
  void set_input(const WalkInput& input);
  PlayState state() const;
  /// Leaves that changed since the last call, as they are now, by all requests up to the number that is returned.
  uint64_t take_changes(LeafValuesMap& into, AmountChanges& amounts);
  /// What lives among the blocks as of the last tick; false, and as before, where that is what `into` has already.
  bool take_inhabitants(InhabitantRecords& into, uint64_t& number, MatterTime& time);
  /// Waits until the request is done, at most so long.
  void wait_for(uint64_t number, double seconds) const;

  /// Of any steady clock that all of play goes by.
  static double now_s();

 private:
  SimThread() : walk_clock_(kWalkTick, 6), matter_clock_(sim::kMatterTick, 4) {}
  void run();
  void do_request(PlayRequest& request);
  void tick(int64_t elapsed_ns);
  void save(bool wait);
  void publish(bool all);
  AmountChanges changed_amounts();
  void say(std::string message);
  void mark();
  void step_matter();

  std::unique_ptr<PlayedWorld> played_;
  std::unique_ptr<PlaySimulation> play_;
  std::unique_ptr<PlayLogWriter> log_;
  Options options_;
  sim::Clock walk_clock_, matter_clock_;
  int subscriber_ = 0;
  world::LayerMark liquid_mark_;
  int64_t waiting_steps_ = 0;
  uint64_t dropped_ = 0, walked_ = 0, copied_hash_ = 0;
  std::string unsaved_;
  double last_save_s_ = 0, last_full_s_ = 0, yaw_ = 0, pitch_ = 0;
  WalkState before_;

  mutable std::mutex mutex_;
  mutable std::condition_variable wake_, done_;
  std::vector<std::pair<uint64_t, PlayRequest>> requests_;
  uint64_t asked_ = 0;
  WalkInput input_;
  PlayState state_;
  LeafValuesMap changes_;
  AmountChanges amount_changes_;
  InhabitantRecords inhabitants_, next_inhabitants_;
  uint64_t inhabitants_number_ = 0;
  bool ticked_ = true, has_inhabitants_ = false;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace tools
