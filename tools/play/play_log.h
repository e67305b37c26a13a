/// A recorded session: all that was done to a world, in its order, so that a repetition without a window comes to the
/// same state. One JSON object a line:
///
///   {"loam_play":1,"scene":"valley","commit":"...","hash":"..."}         where it begins: a scene, or a saved world
///   {"walk":[0,-1024,109,0],"ticks":"wwmwwm"}        what the player wanted, through w ticks of walking and m of
///   matter
///   {"edit":[[x,y,z,x,y,z,"granite"],...]}           boxes in order: corners and what they become
///   {"undo":1} {"redo":1} {"back":1} {"mode":[flies,passes]} {"to":[x,y,z,fx,fy,fz]}
///   {"mark":1200,"hash":"..."}                       matter's tick, and the hash of everything then
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <variant>
#include <vector>

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
  static world::Result<std::unique_ptr<PlayLogWriter>> open(const std::filesystem::path& path, const std::string& scene,
                                                            uint64_t hash);
  ~PlayLogWriter();
  void walk(const WalkInput& input);
  void matter();
  void edit(const world::EditBatch& batch, const world::BlockPalette& palette);
  void note(const char* what);  // undo, redo, back
  void mode(bool flies, bool passes);
  void teleport(const world::WorldPoint& foot);
  void mark(uint64_t tick, uint64_t hash);
  /// Whether all of it could be written.
  bool ok() const { return out_.good(); }

 private:
  void end_ticks();
  std::ofstream out_;
  WalkInput input_;
  std::string ticks_;
};

/// Errors name the file and the line.
world::Result<PlayLog> read_play_log(const std::filesystem::path& path);
bool is_play_log(const std::filesystem::path& path);

struct PlayReplay {
  bool equal = true;
  uint64_t marks = 0, same_until = 0, differs_by = 0;  // ticks of matter
  uint64_t hash = 0, recorded = 0;                     // at the end, or where it first differs
};
/// Builds the world that the log names, and does all of it again.
world::Result<PlayReplay> replay_play(const PlayLog& log);

}  // namespace tools
