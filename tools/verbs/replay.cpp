/// loam replay LOG: repeats what `loam sim --record` or `loam play --record` recorded, and compares the state at each
/// of its marks.
#include <cstdio>
#include <filesystem>
#include <iostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/matter/matter.h"
#include "tools/diff.h"
#include "tools/json_text.h"
#include "tools/picture.h"
#include "tools/play/play_log.h"
#include "tools/progress.h"
#include "tools/recording.h"
#include "tools/verb.h"
#include "world/base/jobs.h"
#include "world/base/text.h"
#include "world/scenes/scene.h"
#include "world/scenes/scene_reactions.h"

namespace tools {

namespace {

struct ReplayOptions {
  std::string log;
  int threads = 0;
  bool json = false;
};

/// The repetition after the last mark against the world that was saved then, voxel by voxel.
world::Status compare_with_saved(const Recording& recording, sim::Matter& matter, const world::World& world,
                                 nlohmann::json& j) {
  std::error_code ignored;
  if (!std::filesystem::exists(recording.saved, ignored)) return {};
  while (matter.tick() < recording.marks.back().tick) matter.step();
  matter.flush();
  TRY(const world::Scene scene, world::load_scene(recording.saved));
  world::ImportReport report;
  TRY(const world::World saved, world::build_world(scene, report));
  j["at_the_end"] = difference_json(compare_worlds(world, saved));
  return {};
}

/// Where it differs: regions by the log, voxels by the saved world.
void print_places(const nlohmann::json& j) {
  const auto place = [](const nlohmann::json& p) {
    return fmt::format("({}, {}, {})", p[0].get<int>(), p[1].get<int>(), p[2].get<int>());
  };
  if (j.contains("regions")) {
    std::string all;
    for (const auto& r : j["regions"]) all += ' ' + place(r);
    std::printf("regions that differ:%s\n", all.c_str());
  }
  if (!j.contains("at_the_end")) return;
  const nlohmann::json& end = j["at_the_end"];
  std::printf("after the last mark %s voxels differ from the saved world\n",
              world::with_thousands(end["differing"].get<uint64_t>()).c_str());
  for (const auto& d : end["first"])
    std::printf("  %s %s, recorded %s\n", place(d["position"]).c_str(), d["a"].get<std::string>().c_str(),
                d["b"].get<std::string>().c_str());
  for (const auto& d : end["layers"])
    std::printf("  %s %s: %s, recorded %s\n", place(d["position"]).c_str(), d["layer"].get<std::string>().c_str(),
                d["a"].dump().c_str(), d["b"].dump().c_str());
}

/// A session of `loam play --record`.
world::Result<int> replay_session(const ReplayOptions& options) {
  TRY(const PlayLog log, read_play_log(options.log));
  TRY(const PlayReplay replay, replay_play(log));
  const nlohmann::json j{{"log", options.log},
                         {"scene", log.scene},
                         {"marks", replay.marks},
                         {"equal", replay.equal},
                         {"same_until", replay.same_until},
                         {"hash", hash_text(replay.hash)},
                         {"recorded", hash_text(replay.recorded)}};
  if (options.json)
    std::cout << json_text(j) << '\n';
  else if (replay.equal)
    std::printf("%s: equal at %llu marks, to tick %llu: %s\n", options.log.c_str(),
                static_cast<unsigned long long>(replay.marks), static_cast<unsigned long long>(replay.same_until),
                hash_text(replay.hash).c_str());
  else
    std::printf("%s: equal to tick %llu, differs by tick %llu: %s, recorded %s\n", options.log.c_str(),
                static_cast<unsigned long long>(replay.same_until), static_cast<unsigned long long>(replay.differs_by),
                hash_text(replay.hash).c_str(), hash_text(replay.recorded).c_str());
  return replay.equal ? 0 : static_cast<int>(world::ErrorKind::comparison);
}

world::Result<int> run_replay(const ReplayOptions& options) {
  const world::ThreadLimit limit(options.threads);
  if (is_play_log(options.log)) return replay_session(options);
  TRY(const Recording recording, read_recording(options.log));
  TRY(const world::Scene scene, world::load_scene(recording.scene));
  world::ImportReport report;
  TRY(world::World world, world::build_world(scene, report));
  TRY_STATUS(world::add_scene_reactions(recording.scene, world));
  TRY(sim::MatterOptions matter_options, sim::matter_options(world, world::Accuracy::usual));
  matter_options.seed = recording.seed;
  matter_options.tick = recording.start;
  for (const auto& [name, value] : recording.knobs) TRY_STATUS(sim::sim_knobs().set(matter_options.knobs, name, value));
  sim::Matter matter(world, matter_options);
  TRY_STATUS(matter.begin());
  Progress progress;
  RegionHashes regions(world.store);
  std::map<world::RegionPos, uint64_t> expected;
  uint64_t same_until = recording.start;
  nlohmann::json j{
      {"log", options.log}, {"scene", recording.scene}, {"marks", recording.marks.size()}, {"equal", true}};
  for (const Recording::Mark& mark : recording.marks) {
    while (matter.tick() < mark.tick) matter.step();
    const uint64_t hash = matter.state_hash();
    const std::map<world::RegionPos, uint64_t>& now = regions.update();
    for (const auto& [r, recorded] : mark.regions) {
      if (recorded == 0)
        expected.erase(r);
      else
        expected[r] = recorded;
    }
    progress.stage(fmt::format("tick {}", mark.tick));
    if (hash == mark.hash) {
      same_until = mark.tick;
      continue;
    }
    j["equal"] = false;
    j["hash"] = fmt::format("{:016x}", hash), j["recorded"] = fmt::format("{:016x}", mark.hash);
    j["differs_by"] = mark.tick;
    if (expected.empty()) break;  // of version 1
    j["regions"] = nlohmann::json::array();
    for (const auto& [r, ignored] : changed_regions(expected, now)) j["regions"].push_back({r.x, r.y, r.z});
    break;
  }
  if (!j["equal"].get<bool>() && !recording.saved.empty()) {
    TRY_STATUS(compare_with_saved(recording, matter, world, j));
  }
  progress.stage("");
  j["same_until"] = same_until;
  const bool equal = j["equal"].get<bool>();
  if (options.json)
    std::cout << json_text(j) << '\n';
  else if (equal)
    std::printf("%s: equal at %zu marks, to tick %llu\n", options.log.c_str(), recording.marks.size(),
                static_cast<unsigned long long>(same_until));
  else
    std::printf("%s: equal to tick %llu, differs by tick %llu: %s, recorded %s\n", options.log.c_str(),
                static_cast<unsigned long long>(same_until), j["differs_by"].get<unsigned long long>(),
                j["hash"].get<std::string>().c_str(), j["recorded"].get<std::string>().c_str());
  if (!equal && !options.json) print_places(j);
  return equal ? 0 : static_cast<int>(world::ErrorKind::comparison);
}

}  // namespace

void add_replay_verb(CommandLine& command) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* verb = command.verb("replay", "repeat a recorded simulation, or session of play, and compare its states");
  verb->add_option("LOG", options->log, "what `loam sim --record` or `loam play --record` wrote")->required();
  verb->add_option("-t,--threads", options->threads, "threads (default: all)");
  verb->add_flag("--json", options->json, "one JSON object on stdout");
  command.action(verb, [options] { return run_replay(*options); });
}

}  // namespace tools
