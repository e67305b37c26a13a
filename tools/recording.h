/// A recorded simulation: what was simulated, and the hash of the state every so many ticks, so that a repetition on
/// any machine says whether it came out the same, and where it first did not. One JSON object a line:
///
///   {"loam_recording":1,"scene":"dam","seed":1,"start":0,"every":16,"commit":"...","knobs":{"liquid_model":"finite",
///   ...}}
///   {"tick":16,"hash":"82c03e51745c8f78"}
///   ...
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "world/base/errors.h"

namespace tools {

struct Recording {
  struct Mark {
    uint64_t tick = 0;  // after so many ticks of the world
    uint64_t hash = 0;
  };
  std::string scene, commit;
  std::map<std::string, std::string> knobs;  // of the simulation, all of them
  uint64_t seed = 1;
  uint64_t start = 0;   // the world's tick when it began
  uint64_t every = 16;  // ticks between marks; the last mark may come earlier
  std::vector<Mark> marks;
};

/// Writes all of it, beside the target first: no partial file is left.
world::Status write_recording(const Recording& recording, const std::filesystem::path& path);
/// Errors name the file and the line.
world::Result<Recording> read_recording(const std::filesystem::path& path);

}  // namespace tools
