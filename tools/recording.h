/// A recorded simulation: what was simulated, and the hash of the state every so many ticks, so that a repetition on
/// any machine says whether it came out the same, and where it first did not. One JSON object a line:
///
///   {"loam_recording":3,"scene":"dam","seed":1,"start":0,"every":16,"threads":2,"commit":"...",
///   "knobs":{"liquid_model":"finite",...},"saved":"dam.loam"}
///   {"tick":16,"hash":"82c03e51745c8f78","leaves":{"0 0 0":"18a9c2405e7d3f61"}}
///   ...
///
/// leaves: hashes of the leaves that changed since the start or have a value in a layer of integers, of those whose
/// hash isn't that of the mark before: they say where a repetition differs. saved: the world after the last mark, to
/// compare voxel by voxel. Version 2 had hashes by region, the sums of those of its leaves; version 1 neither.
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
    std::map<world::LeafPos, uint64_t> leaves = {};
    std::map<world::RegionPos, uint64_t> regions = {};  // of version 2, which has no leaves
  };
  std::string scene, commit;
  std::string saved;                         // a .loam file, or empty
  std::map<std::string, std::string> knobs;  // of the simulation, all of them
  uint64_t seed = 1;
  uint64_t start = 0;   // the world's tick when it began
  uint64_t every = 16;  // ticks between marks; the last mark may come earlier
  int threads = 0;      // that it ran on; 0: all, or not known
  std::vector<Mark> marks;
};

/// Hashes of what changed in each leaf since this was made.
class LeafHashes {
 public:
  /// The store must outlive it.
  explicit LeafHashes(const world::Store& store) : store_(store), subscriber_(store.subscribe()) {}
  /// Of all leaves in which a block changed, or a layer of integers has a value. What the store lacks counts as
  /// unchanged: flush() before.
  const std::map<world::LeafPos, uint64_t>& update();

 private:
  const world::Store& store_;
  int subscriber_;
  std::map<world::LeafPos, uint64_t> blocks_;  // of leaves that changed
  std::map<world::LeafPos, uint64_t> leaves_;
};
std::map<world::RegionPos, uint64_t> region_hashes(const std::map<world::LeafPos, uint64_t>& leaves);

/// The entries of `now` that `before` doesn't have, or has otherwise; 0 for those that only `before` has.
template <class Pos>
std::map<Pos, uint64_t> changed_hashes(const std::map<Pos, uint64_t>& before, const std::map<Pos, uint64_t>& now) {
  std::map<Pos, uint64_t> changed;
  for (const auto& [at, hash] : now)
    if (const auto was = before.find(at); was == before.end() || was->second != hash) changed[at] = hash;
  for (const auto& [at, hash] : before)
    if (!now.contains(at)) changed[at] = 0;  // nothing there differs from the start any more
  return changed;
}
/// Brings `all` up to what changed_hashes() returned.
template <class Pos>
void follow_hashes(std::map<Pos, uint64_t>& all, const std::map<Pos, uint64_t>& changed) {
  for (const auto& [at, hash] : changed) {
    if (hash == 0)
      all.erase(at);
    else
      all[at] = hash;
  }
}

/// Writes all of it, beside the target first: no partial file is left.
world::Status write_recording(const Recording& recording, const std::filesystem::path& path);
/// Errors name the file and the line.
world::Result<Recording> read_recording(const std::filesystem::path& path);

}  // namespace tools
