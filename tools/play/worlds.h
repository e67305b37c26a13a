/// The worlds that can be played: where they come from, and the file that each is kept in.
#pragma once

#include "tools/play/sim_thread.h"

namespace tools {

/// What to play: one of these.
struct WorldChoice {
  std::string scene;      // a scene's name, the path of a scene, of a saved world, or of any file that can be read
  std::string generator;  // a new world: its generator, ...
  std::string name;       // ... what it is called, ...
  uint64_t seed = 1;      // ... its seed, ...
  world::VoxelPos size{512, 256, 512};  // ... and how large it is: 1 .. 4096 each
  bool keep = true;                     // false: no file is made for it
};

struct OpenedWorld {
  std::unique_ptr<PlayedWorld> played;
  std::vector<std::string> warnings;
  bool made_file = false;  // of a world that had none; it goes again where nothing was changed
};

/// Opens it, and its file: a saved world's own, or a new one in data_folder()/worlds. Where that can't be made the
/// world is played without, and a warning says why.
world::Result<OpenedWorld> open_world(const WorldChoice& choice);

/// A path in the folder for worlds that no file has: NAME.loam, NAME-2.loam, ...
std::filesystem::path free_world_path(const std::string& name);

}  // namespace tools
