/// Worlds larger than memory: regions come in around viewers and go out behind them, within a budget of bytes.
///
///   Streamer streamer(world, &session, &generator, knobs);
///   streamer.update(viewers, now_s);     // each frame, on the thread that edits the world
///
/// A region is read from the save; what the save lacks, the generator makes; where there is neither, it is air. All of
/// that, and packing, counting and deriving masks, happens on the streamer's own threads; update() only plans, puts
/// what is ready into the store, and takes out what is far. A region that the save does not hold as it is (unsaved, or
/// being written) stays: where such regions fill the budget, a save is begun. A region made by the generator and never
/// edited is not saved; it is made again.
///
/// Layers come and go with the regions that their values lie in. Who keeps something beside the world, as light, asks
/// take_moved() what is there.
///
/// Edits must go through apply(), which first brings in what they touch: an edit of a region that is not there would
/// start from air. Before a layer is written, require() must have brought in where.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <unordered_map>
#include <unordered_set>

#include "world/gen/generator.h"
#include "world/saves/session.h"
#include "world/store/snapshot.h"

namespace world {

struct StreamingKnobs {
  size_t memory_budget_bytes = size_t{2} << 30;  // of blocks, masks and layers of regions, those on their way included
  double load_radius_m = 512;                    // regions nearer than this to a viewer are wanted
  double keep_radius_m = 640;                    // those farther than this go, also where there is room; >= load radius
  int32_t lowest_y = -1024, highest_y = 1023;    // voxels; regions wholly outside are never asked for
  double idle_s = 5;                             // an edited region is packed when it has rested for this long
  double update_ms = 4;                          // update() stops putting in and taking out at this
  int threads = 0;                               // that read and generate; 0: one fewer than the cores, at least one
};

struct StreamingReport {
  size_t bytes = 0;     // counted now; never above the budget, unless what is unsaved alone is more
  size_t resident = 0;  // regions, those that are air included
  size_t waiting = 0;   // wanted and not there yet
  uint64_t read = 0, generated = 0, evicted = 0, packed = 0;  // since the start
  double held_radius_m = 0;                                   // all wanted regions nearer than this are there
  bool budget_full = false;                                   // something wanted did not fit
  double update_ms = 0, longest_update_ms = 0;
  std::vector<std::string> errors;  // of regions that could not be read; since the start, each once
};

class Streamer {
 public:
  /// `session` and `generator` may be null; all must outlive the streamer.
  Streamer(World& world, SaveSession* session, const Generator* generator, const StreamingKnobs& knobs);
  ~Streamer();
  Streamer(const Streamer&) = delete;
  Streamer& operator=(const Streamer&) = delete;

  const StreamingReport& update(std::span<const VoxelPos> viewers, double now_s);
  /// Waits until everything that the viewers want, and that fits, is there: for headless use.
  const StreamingReport& settle(std::span<const VoxelPos> viewers, double now_s);
  const StreamingReport& report() const { return report_; }

  const StreamingKnobs& knobs() const { return knobs_; }

  bool is_resident(RegionPos r) const { return resident_.contains(r); }
  /// A consumer of what comes in and goes out; the regions that are there now are its first news.
  int subscribe();
  /// Regions that came in or went out since the last call for this consumer, sorted, each once; is_resident() says
  /// which. One that went and came again is among them.
  std::vector<RegionPos> take_moved(int subscriber);
  /// Brings in what the box meets, now, on this thread.
  Status require(const VoxelBox& box);
  /// Store::apply, after require() of what the batch touches.
  Result<EditReport> apply(const EditBatch& batch, UndoLog* undo = nullptr);

 private:
  struct Resident {
    size_t bytes = 0;
    float distance_m = 0;  // as of the last plan
    uint64_t edits = 0;    // region_edits() when last looked at
    size_t thaw_bytes = 0;
    double rests_since_s = 0;
  };
  struct Arrival {
    RegionPos pos;
    std::optional<PreparedRegion> region;  // nothing: it could not be read
    std::vector<std::pair<Layer, AnyLayer>> layers;
    size_t bytes = 0;  // of all that
    std::string error;
    bool generated = false;
  };

  Arrival fetch(RegionPos pos, unsigned mask_kinds) const;
  Status fetch_from_save(Arrival& arrival, unsigned mask_kinds) const;
  Resident& install(Arrival&& arrival);
  void note_moved(RegionPos r);
  void run();
  void plan(std::span<const VoxelPos> viewers);
  double distance_m(RegionPos r) const;
  void look_after_resident(double now_s);
  /// Takes out far regions until `bytes` more fit; false where that cannot be done with those farther than `distance`.
  bool make_room(size_t bytes, double distance);
  /// Takes out regions farther than `distance`, farthest first, while more() holds.
  void evict_farther_than(double distance, const std::function<bool()>& more);
  void evict(RegionPos r);
  void place(Arrival&& arrival, double now_s);

  World& world_;
  SaveSession* session_;
  const Generator* generator_;
  StreamingKnobs knobs_;
  StreamingReport report_;

  std::vector<VoxelPos> viewers_;
  std::vector<RegionPos> viewer_regions_;
  std::unordered_map<RegionPos, Resident, PosHash> resident_;
  std::vector<RegionPos> farthest_first_;  // resident when last planned; taken from its front
  size_t next_farthest_ = 0;
  std::vector<RegionPos> look_at_;  // resident regions in turn
  size_t next_look_ = 0;
  size_t resident_bytes_ = 0;
  std::vector<std::unordered_set<RegionPos, PosHash>> moved_;  // by subscriber
  std::unordered_set<RegionPos, PosHash> unreadable_;
  std::unordered_set<RegionPos, PosHash> overtaken_;  // on their way, and brought in by require() meanwhile
  double full_beyond_m_ = 0;                          // nothing farther is asked for: it would not fit

  // Shared with the threads.
  std::mutex mutex_;
  std::condition_variable wake_, arrived_;
  std::vector<std::pair<float, RegionPos>> wanted_;  // nearest last
  std::unordered_set<RegionPos, PosHash> in_flight_;
  std::vector<Arrival> arrivals_;
  size_t arrival_bytes_ = 0;
  unsigned mask_kinds_ = 0;
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace world
