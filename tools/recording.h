/// A recorded simulation: what was simulated, and the hash of the state every so many ticks, so that a repetition on
/// any machine says whether it came out the same, and where it first did not. One JSON object a line:
///
///   {"loam_recording":2,"scene":"dam","seed":1,"start":0,"every":16,"commit":"...","knobs":{"liquid_model":"finite",
///   ...},"saved":"dam.loam"}
///   {"tick":16,"hash":"82c03e51745c8f78","regions":{"0 0 0":"18a9c2405e7d3f61"}}
///   ...
///
/// regions: hashes of what changed in each since the start, of those whose hash isn't that of the mark before: they say
/// where a repetition differs. saved: the world after the last mark, to compare voxel by voxel. Version 1 had neither.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "world/base/errors.h"
#include "world/store/store.h"

namespace tools {

struct Recording {
  struct Mark {
    uint64_t tick = 0;  // after so many ticks of the world
    uint64_t hash = 0;
    std::map<world::RegionPos, uint64_t> regions = {};
  };
  std::string scene, commit;
  std::string saved;                         // a .loam file, or empty
  std::map<std::string, std::string> knobs;  // of the simulation, all of them
  uint64_t seed = 1;
  uint64_t start = 0;   // the world's tick when it began
  uint64_t every = 16;  // ticks between marks; the last mark may come earlier
  std::vector<Mark> marks;
};

/// Hashes of what changed in each region since this was made.
class RegionHashes {
 public:
  /// The store must outlive it.
  explicit RegionHashes(const world::Store& store) : store_(store), subscriber_(store.subscribe()) {}
  /// Of all regions in which anything changed, or a layer of integers has a value. What the store lacks counts as
  /// unchanged: flush() before.
  const std::map<world::RegionPos, uint64_t>& update();

 private:
  const world::Store& store_;
  int subscriber_;
  std::map<world::LeafPos, uint64_t> leaves_;  // that changed: hashes of their blocks
  std::map<world::RegionPos, uint64_t> regions_;
};
/// The entries of `now` that `before` doesn't have, or has otherwise.
std::map<world::RegionPos, uint64_t> changed_regions(const std::map<world::RegionPos, uint64_t>& before,
                                                     const std::map<world::RegionPos, uint64_t>& now);

/// Writes all of it, beside the target first: no partial file is left.
world::Status write_recording(const Recording& recording, const std::filesystem::path& path);
/// Errors name the file and the line.
world::Result<Recording> read_recording(const std::filesystem::path& path);

}  // namespace tools
