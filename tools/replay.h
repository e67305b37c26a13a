/// Repeats what `loam sim --record` recorded, and finds where a run first differs from it: the tick, and the voxel.
///
/// A recording holds hashes alone. So where a repetition differs, what was recorded is run again too, by its own knobs
/// and on as many threads, beside the repetition: if that comes to the recorded hash, the two are compared voxel by
/// voxel, tick by tick. Else it was another program that recorded, and hashes of leaves say where it differs.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/matter/matter.h"
#include "tools/diff.h"
#include "tools/recording.h"
#include "world/base/errors.h"
#include "world/world.h"

namespace tools {

/// A world that is simulated, on so many threads; 0 for all.
class SimRun {
 public:
  /// Builds the world that a recording names, before its first tick.
  static world::Result<std::unique_ptr<SimRun>> make(const Recording& recording, int threads,
                                                     const std::vector<std::string>& settings = {});
  void step_to(uint64_t tick);
  sim::Matter& matter() { return *matter_; }
  /// What was written back to it, by flush() or state_hash().
  const world::World& world() const { return *world_; }

 private:
  std::unique_ptr<world::World> world_;
  std::unique_ptr<sim::Matter> matter_;
  int threads_ = 0;
};

struct FirstDifference {
  uint64_t tick = 0;      // after so many ticks of the world
  WorldDifference where;  // a: the run that is repeated, b: that which was expected; equal where only what rules hold
                          // beside the voxels, or a body, differs
};
/// Steps both until they differ, at most to `tick`. They are at the same tick.
std::optional<FirstDifference> first_difference(SimRun& run, SimRun& expected, uint64_t tick);

struct ReplayOptions {
  std::string log;
  std::vector<std::string> settings = {};  // KNOB=VALUE, over the recorded ones
  int threads = 0;
};
struct Replay {
  Recording recording;
  bool equal = true;
  uint64_t same_until = 0;
  // Where it isn't equal:
  uint64_t differs_by = 0;                         // the first mark that differs
  uint64_t hash = 0, recorded = 0;                 // there
  bool made_again = false;                         // the recorded run, as it was recorded, up to that mark
  std::optional<FirstDifference> first = {};       // of it and the repetition, if the repetition differs again
  std::vector<world::LeafPos> leaves = {};         // that differ at that mark, by their hashes
  std::vector<world::RegionPos> regions = {};      // and of a recording of version 2
  std::optional<WorldDifference> at_the_end = {};  // from the saved world, where it is there
};
/// `progress` is told the tick.
world::Result<Replay> replay_recording(const ReplayOptions& options,
                                       const std::function<void(const std::string&)>& progress = {});

}  // namespace tools
