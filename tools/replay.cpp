#include "tools/replay.h"

#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "tools/knob_settings.h"
#include "world/base/jobs.h"
#include "world/scenes/scene.h"
#include "world/scenes/scene_reactions.h"

namespace tools {

namespace {

template <class Pos>
std::vector<Pos> positions(const std::map<Pos, uint64_t>& hashes) {
  std::vector<Pos> all;
  for (const auto& entry : hashes) all.push_back(entry.first);
  return all;
}

/// The tick and voxel between two marks, if the recorded run can be made again.
world::Status find_first(const ReplayOptions& options, Replay& replay,
                         const std::function<void(const std::string&)>& progress) {
  TRY(const auto run, SimRun::make(replay.recording, options.threads, options.settings));
  TRY(const auto expected, SimRun::make(replay.recording, replay.recording.threads));
  if (progress) progress("the recorded run again");
  run->step_to(replay.same_until);
  expected->step_to(replay.same_until);
  replay.first = first_difference(*run, *expected, replay.differs_by);
  expected->step_to(replay.differs_by);
  replay.made_again = expected->matter().state_hash() == replay.recorded;
  if (!replay.made_again) replay.first.reset();
  return {};
}

}  // namespace

world::Result<std::unique_ptr<SimRun>> SimRun::make(const Recording& recording, int threads,
                                                    const std::vector<std::string>& settings) {
  const world::ThreadLimit limit(threads);
  auto run = std::make_unique<SimRun>();
  run->threads_ = threads;
  TRY(const world::Scene scene, world::load_scene(recording.scene));
  world::ImportReport report;
  TRY(world::World world, world::build_world(scene, report));
  run->world_ = std::make_unique<world::World>(std::move(world));
  TRY_STATUS(world::add_scene_reactions(recording.scene, *run->world_));
  TRY(sim::MatterOptions options, sim::matter_options(*run->world_, world::Accuracy::usual));
  options.seed = recording.seed;
  options.tick = recording.start;
  for (const auto& [name, value] : recording.knobs) TRY_STATUS(sim::sim_knobs().set(options.knobs, name, value));
  TRY_STATUS(set_knobs(sim::sim_knobs(), options.knobs, settings));
  run->matter_ = std::make_unique<sim::Matter>(*run->world_, options);
  TRY_STATUS(run->matter_->begin());
  return run;
}

void SimRun::step_to(uint64_t tick) {
  const world::ThreadLimit limit(threads_);
  while (matter_->tick() < tick) matter_->step();
}

std::optional<FirstDifference> first_difference(SimRun& run, SimRun& expected, uint64_t tick) {
  while (run.matter().tick() < tick) {
    const uint64_t next = run.matter().tick() + 1;
    run.step_to(next);
    expected.step_to(next);
    if (run.matter().state_hash() == expected.matter().state_hash()) continue;
    return FirstDifference{next, compare_worlds(run.world(), expected.world())};
  }
  return {};
}

world::Result<Replay> replay_recording(const ReplayOptions& options,
                                       const std::function<void(const std::string&)>& progress) {
  Replay replay;
  TRY(replay.recording, read_recording(options.log));
  const Recording& recording = replay.recording;
  TRY(const auto run, SimRun::make(recording, options.threads, options.settings));
  LeafHashes leaves(run->world().store);
  std::map<world::LeafPos, uint64_t> expected;
  std::map<world::RegionPos, uint64_t> expected_regions;
  replay.same_until = recording.start;
  for (const Recording::Mark& mark : recording.marks) {
    run->step_to(mark.tick);
    replay.hash = run->matter().state_hash(), replay.recorded = mark.hash;
    if (progress) progress(fmt::format("tick {}", mark.tick));
    follow_hashes(expected, mark.leaves);
    follow_hashes(expected_regions, mark.regions);
    if (replay.hash == mark.hash) {
      replay.same_until = mark.tick;
      continue;
    }
    replay.equal = false;
    replay.differs_by = mark.tick;
    const std::map<world::LeafPos, uint64_t>& now = leaves.update();
    if (!expected.empty()) replay.leaves = positions(changed_hashes(expected, now));
    if (!expected_regions.empty()) replay.regions = positions(changed_hashes(expected_regions, region_hashes(now)));
    break;
  }
  if (replay.equal) return replay;
  std::error_code ignored;
  if (!recording.saved.empty() && std::filesystem::exists(recording.saved, ignored)) {
    run->step_to(recording.marks.back().tick);
    run->matter().flush();
    TRY(const world::Scene scene, world::load_scene(recording.saved));
    world::ImportReport report;
    TRY(const world::World saved, world::build_world(scene, report));
    replay.at_the_end = compare_worlds(run->world(), saved);
  }
  TRY_STATUS(find_first(options, replay, progress));
  return replay;
}

}  // namespace tools
