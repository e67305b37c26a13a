/// loam replay LOG: repeats what `loam sim --record` recorded, and compares the state at each of its marks.
#include <cstdio>
#include <iostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/matter/matter.h"
#include "tools/json_text.h"
#include "tools/progress.h"
#include "tools/recording.h"
#include "tools/verb.h"
#include "world/base/jobs.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

struct ReplayOptions {
  std::string log;
  int threads = 0;
  bool json = false;
};

world::Result<int> run_replay(const ReplayOptions& options) {
  const world::ThreadLimit limit(options.threads);
  TRY(const Recording recording, read_recording(options.log));
  TRY(const world::Scene scene, world::load_scene(recording.scene));
  world::ImportReport report;
  TRY(world::World world, world::build_world(scene, report));
  sim::MatterOptions matter_options;
  matter_options.seed = recording.seed;
  matter_options.tick = recording.start;
  matter_options.effects = world.simulation.effects;
  for (const auto& [name, value] : recording.knobs) TRY_STATUS(sim::sim_knobs().set(matter_options.knobs, name, value));
  sim::Matter matter(world, matter_options);
  TRY_STATUS(matter.begin());
  Progress progress;
  uint64_t same_until = recording.start;
  nlohmann::json j{
      {"log", options.log}, {"scene", recording.scene}, {"marks", recording.marks.size()}, {"equal", true}};
  for (const Recording::Mark& mark : recording.marks) {
    while (matter.tick() < mark.tick) matter.step();
    const uint64_t hash = matter.state_hash();
    progress.stage(fmt::format("tick {}", mark.tick));
    if (hash == mark.hash) {
      same_until = mark.tick;
      continue;
    }
    j["equal"] = false;
    j["hash"] = fmt::format("{:016x}", hash), j["recorded"] = fmt::format("{:016x}", mark.hash);
    j["differs_by"] = mark.tick;
    break;
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
  return equal ? 0 : static_cast<int>(world::ErrorKind::comparison);
}

}  // namespace

void add_replay_verb(Command& command) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* verb = command.verb("replay", "repeat a recorded simulation and compare its states");
  verb->add_option("LOG", options->log, "what `loam sim --record` wrote")->required();
  verb->add_option("-t,--threads", options->threads, "threads (default: all)");
  verb->add_flag("--json", options->json, "one JSON object on stdout");
  command.action(verb, [options] { return run_replay(*options); });
}

}  // namespace tools
