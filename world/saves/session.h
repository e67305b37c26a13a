/// A world and its save, open together: edits go on while what changed is written behind them.
///
///   auto session = SaveSession::open("home.loam", {});       // a missing file begins as an empty world
///   session->world().store.apply(...);
///   session->tick(seconds_of_the_clock);                     // each frame: begins an autosave where one is due
///   session->close();                                        // saves what is left
///
/// A save is one transaction and holds the world of one moment: that of the call that began it. It writes only what
/// changed since the last. Where it fails, the world stays as it is, what it would have written counts as unsaved
/// again, last_error() says why, and the next save tries again.
/// All calls come from the thread that edits the world.
#pragma once

#include <condition_variable>
#include <thread>
#include <unordered_set>

#include "world/saves/save_file.h"
#include "world/store/snapshot.h"

namespace world {

/// What one save writes.
struct SaveWork {
  StoreSnapshot regions;
  Meta meta;
  BlockId first_new_block = 1;
  std::vector<Block> new_blocks;
  struct LayerPart {
    Layer layer;
    std::vector<RegionPos> regions;          // those that changed, sorted
    std::shared_ptr<const AnyLayer> values;  // there
  };
  std::vector<LayerPart> layers;
  std::vector<Layer> dropped;                             // before the parts are written
  std::shared_ptr<const std::vector<std::string>> names;  // of blocks, by id: the palette may grow meanwhile
};

struct SaveReport {
  uint64_t regions = 0, bytes = 0;  // rows written, and their payloads
  double snapshot_ms = 0;           // on the thread that edits
  double write_ms = 0;              // behind it
};

class SaveSession {
 public:
  struct Options {
    double autosave_s = 60;  // 0: only where asked
    PayloadOptions payload = {};
    bool load = true;      // false: the world begins without regions, for a Streamer to bring
    std::string vfs = {};  // of tests
  };
  static Result<std::unique_ptr<SaveSession>> open(const std::filesystem::path& path, const Options& options);
  /// Makes the file of a world that has none yet, whole or not at all, and opens it.
  static Result<std::unique_ptr<SaveSession>> create(const std::filesystem::path& path, World&& world,
                                                     const Options& options);
  /// Waits for the save that is being written, and no more: call close() to save what is left.
  ~SaveSession();
  SaveSession(const SaveSession&) = delete;
  SaveSession& operator=(const SaveSession&) = delete;

  World& world() { return world_; }
  const World& world() const { return world_; }
  SaveFile& file() { return *file_; }

  /// True where something differs from the last complete save.
  bool has_changes() const;
  /// True where the region differs from the file as it is on disk, also while it is being written.
  bool is_unsaved(RegionPos r) const { return world_.store.is_unsaved(r) || writing_.contains(r); }
  /// Begins an autosave where one is due; takes in the result of one that has ended. `now_s`: any steady clock.
  void tick(double now_s);
  /// Takes a snapshot and lets it be written behind; false where the last is still being written or nothing changed.
  bool begin_save();
  bool is_saving() const { return saving_; }
  /// Waits for the save that is being written, and says how it went.
  Status wait();
  /// Saves now.
  Status save();
  Status close();

  int64_t saves() const { return file_->save_number(); }
  const std::optional<Error>& last_error() const { return last_error_; }
  const SaveReport& last_report() const { return report_; }

 private:
  SaveSession(std::unique_ptr<SaveFile> file, World world, const Options& options);
  SaveWork take_work();
  void finish();
  void run();

  std::unique_ptr<SaveFile> file_;
  World world_;
  Options options_;
  size_t saved_blocks_ = 0;
  std::shared_ptr<const std::vector<std::string>> names_;
  std::map<std::string, std::string> saved_meta_;
  std::optional<double> last_save_s_;

  // What is being written; finish() takes its result in.
  bool saving_ = false;
  std::unordered_set<RegionPos, PosHash> writing_;  // of blocks or a layer
  std::vector<RegionPos> writing_regions_;
  std::map<Layer, std::vector<RegionPos>> writing_layers_;
  std::vector<Layer> writing_dropped_;
  size_t writing_blocks_ = 0;
  std::map<std::string, std::string> writing_meta_;
  std::optional<Error> last_error_;
  SaveReport report_;

  // Between the two threads.
  std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::optional<SaveWork> work_;
  std::optional<Status> result_;
  SaveReport written_;
  bool stop_ = false;
  std::thread writer_;
};

/// Writes a whole world into a file that is missing or empty, without a journal: the caller syncs and renames it.
Status write_new_save(const World& world, const std::filesystem::path& path, const PayloadOptions& options = {});

}  // namespace world
