/// A recorded session: all that was done to a world, in its order, so that a repetition without a window comes to the
/// same state. One JSON object a line:
///
///   {"loam_play":2,"scene":"valley","commit":"...","hash":"..."}         where it begins: a scene, or a saved world
///   {"walk":[0,-1024,109,0],"ticks":"wwmwwm","sums":["...",""]}
///       what the player wanted, through w ticks of walking and m of matter; what each m changed
///   {"edit":[[x,y,z,x,y,z,"granite"],...]}           boxes in order: corners and what they become
///   {"undo":1} {"redo":1} {"back":1} {"mode":[flies,passes]} {"to":[x,y,z,fx,fy,fz]}
///   {"sum":"..."}                                    what the edit, undo, redo or step back changed
///   {"mark":1200,"hash":"..."}                       matter's tick, and the hash of everything then
///
/// A sum is the text of a ChangeSketch; where bodies moved, "/" and their hash follow. Version 1 had no sums.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <variant>
#include <vector>

#include "tools/diff.h"
#include "tools/play/change_sketch.h"
#include "tools/play/simulation.h"

namespace tools {

struct PlayEvent {
  enum class Kind { walk, matter, edit, undo, redo, back, mode, teleport, mark };
  Kind kind = Kind::walk;
  WalkInput input = {};                                            // walk
  std::vector<std::pair<world::VoxelBox, std::string>> edit = {};  // edit
  bool flies = false, passes = false;                              // mode
  world::WorldPoint foot = {};                                     // teleport
  uint64_t tick = 0, hash = 0;                                     // mark
  std::optional<std::string> sum = {};                             // matter, edit, undo, redo, back
};

/// What each step of a session changed, as the log has it.
class ChangeSums {
 public:
  explicit ChangeSums(PlaySimulation& play) : play_(play), follower_(play.world()) {}
  struct Sum {
    ChangeSketch changes;
    std::string text;
  };
  /// Since the last call; empty where nothing changed.
  Sum take();

 private:
  uint64_t bodies_hash() const;
  PlaySimulation& play_;
  ChangeFollower follower_;
  uint64_t bodies_ = bodies_hash();
};

struct PlayLog {
  std::string scene;  // what load_scene() takes
  std::string commit;
  uint64_t hash = 0;  // of the state at first
  std::vector<PlayEvent> events;
};

/// Writes while it goes: what was done is in the file when the program dies.
class PlayLogWriter {
 public:
  /// `play`: at its beginning; it must outlive this.
  static world::Result<std::unique_ptr<PlayLogWriter>> open(const std::filesystem::path& path, const std::string& scene,
                                                            PlaySimulation& play);
  ~PlayLogWriter();
  void walk(const WalkInput& input);
  void matter();
  void edit(const world::EditBatch& batch, const world::BlockPalette& palette);
  void note(const char* what);  // undo, redo, back
  void mode(bool flies, bool passes);
  void teleport(const world::WorldPoint& foot);
  /// What the last of matter, edit and note changed, once it is done.
  void sum();
  void mark();
  /// Whether all of it could be written.
  bool ok() const { return out_.good(); }

 private:
  explicit PlayLogWriter(PlaySimulation& play) : play_(play), changes_(play) {}
  void end_ticks();
  PlaySimulation& play_;
  ChangeSums changes_;
  std::ofstream out_;
  WalkInput input_;
  std::string ticks_;
  std::vector<std::string> sums_;
};

/// Errors name the file and the line.
world::Result<PlayLog> read_play_log(const std::filesystem::path& path);
bool is_play_log(const std::filesystem::path& path);

/// A voxel that differs at the first tick that does.
struct PlayedDifference {
  std::string layer;  // or "block"
  world::VoxelPos pos;
  std::optional<std::string> found, expected;  // the block's name, or the layer's number; nothing where not known
};
struct PlayReplay {
  bool equal = true;
  uint64_t marks = 0, same_until = 0, differs_by = 0;  // ticks of matter
  uint64_t hash = 0, recorded = 0;                     // at the last mark, unless something differs before
  std::string differs_in = {};  // what was done when it first differed: "a tick", "an edit", ...; empty: only a mark
  std::vector<PlayedDifference> voxels = {};  // that differ then, sorted: all, or where many do, some of them
};
/// Builds the world that the log names, and does all of it again.
world::Result<PlayReplay> replay_play(const PlayLog& log);

}  // namespace tools
