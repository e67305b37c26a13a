/// loam replay LOG: repeats what `loam sim --record` or `loam play --record` recorded, and compares the state at each
/// of its marks.
#include <cstdio>
#include <iostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tools/diff.h"
#include "tools/json_text.h"
#include "tools/picture.h"
#include "tools/play/play_log.h"
#include "tools/progress.h"
#include "tools/replay.h"
#include "tools/verb.h"
#include "world/base/jobs.h"
#include "world/base/text.h"

namespace tools {

namespace {

struct ReplayVerbOptions {
  ReplayOptions replay;
  bool json = false;
};

nlohmann::json position_json(const auto& p) { return {p.x, p.y, p.z}; }
std::string position_text(const nlohmann::json& p) {
  return fmt::format("({}, {}, {})", p[0].get<int>(), p[1].get<int>(), p[2].get<int>());
}

/// The first voxel that differs, and in what: the block, or a layer.
nlohmann::json first_json(const FirstDifference& first) {
  nlohmann::json j{{"tick", first.tick}, {"all", difference_json(first.where)}};
  if (!first.where.first.empty()) {
    const VoxelDifference& d = first.where.first.front();
    j["voxel"] = position_json(d.pos), j["of"] = "block", j["found"] = d.a, j["expected"] = d.b;
  } else if (!first.where.layers.empty()) {
    const LayerDifference& d = first.where.layers.front();
    const auto value = [](const std::optional<double>& v) { return v ? nlohmann::json(*v) : nlohmann::json(nullptr); };
    j["voxel"] = position_json(d.pos), j["of"] = d.layer, j["found"] = value(d.a), j["expected"] = value(d.b);
  }
  return j;
}

nlohmann::json replay_json(const Replay& replay, const std::string& log) {
  nlohmann::json j{{"log", log},
                   {"scene", replay.recording.scene},
                   {"marks", replay.recording.marks.size()},
                   {"equal", replay.equal},
                   {"same_until", replay.same_until}};
  if (replay.equal) return j;
  j["hash"] = hash_text(replay.hash), j["recorded"] = hash_text(replay.recorded);
  j["differs_by"] = replay.differs_by;
  j["made_again"] = replay.made_again;
  if (replay.first) j["first"] = first_json(*replay.first);
  for (const world::LeafPos& l : replay.leaves) j["leaves"].push_back(position_json(world::voxel_from_leaf(l)));
  for (const world::RegionPos& r : replay.regions) j["regions"].push_back(position_json(r));
  if (replay.at_the_end) j["at_the_end"] = difference_json(*replay.at_the_end);
  return j;
}

/// All differences of two worlds, as far as they are listed.
void print_differences(const nlohmann::json& all) {
  const auto text = [](const nlohmann::json& value) { return value.is_null() ? std::string("nothing") : value.dump(); };
  for (const auto& d : all["first"])
    std::printf("  %s %s, recorded %s\n", position_text(d["position"]).c_str(), d["a"].get<std::string>().c_str(),
                d["b"].get<std::string>().c_str());
  for (const auto& d : all["layers"])
    std::printf("  %s %s: %s, recorded %s; %s voxels differ in it\n", position_text(d["position"]).c_str(),
                d["layer"].get<std::string>().c_str(), text(d["a"]).c_str(), text(d["b"]).c_str(),
                world::with_thousands(d["differing"].get<uint64_t>()).c_str());
}

/// Where it differs: the voxel, or leaves and regions by their hashes.
void print_places(const nlohmann::json& j) {
  constexpr size_t kMostListed = 20;
  const auto list = [&](const char* what, const nlohmann::json& places) {
    std::string all;
    for (size_t n = 0; n < places.size() && n < kMostListed; ++n) all += ' ' + position_text(places[n]);
    if (places.size() > kMostListed) all += fmt::format(" and {} more", places.size() - kMostListed);
    std::printf("%s:%s\n", what, all.c_str());
  };
  if (j.contains("first")) {
    const nlohmann::json& first = j["first"];
    if (first.contains("voxel"))
      std::printf("first differs at tick %llu in voxel %s\n", first["tick"].get<unsigned long long>(),
                  position_text(first["voxel"]).c_str());
    else
      std::printf("first differs at tick %llu in no voxel: a body, or what a rule keeps beside them\n",
                  first["tick"].get<unsigned long long>());
    print_differences(first["all"]);
  } else {
    std::printf(j["made_again"].get<bool>()
                    ? "repeated once more it doesn't differ: it isn't the same each time\n"
                    : "the recorded run doesn't come out as recorded in this program: hashes alone say where\n");
    if (j.contains("leaves")) list("leaves that differ, by their lowest voxels", j["leaves"]);
  }
  if (j.contains("regions")) list("regions that differ", j["regions"]);
  if (!j.contains("at_the_end")) return;
  std::printf("after the last mark %s voxels differ from the saved world\n",
              world::with_thousands(j["at_the_end"]["differing"].get<uint64_t>()).c_str());
  print_differences(j["at_the_end"]);
}

void print_inequality(const std::string& log, const auto& replay) {
  std::printf("%s: equal to tick %llu, differs by tick %llu: %s, recorded %s\n", log.c_str(),
              static_cast<unsigned long long>(replay.same_until), static_cast<unsigned long long>(replay.differs_by),
              hash_text(replay.hash).c_str(), hash_text(replay.recorded).c_str());
}

/// The first voxel that differs, and all that were found to.
nlohmann::json first_json(const PlayReplay& replay) {
  const auto value = [](const std::optional<std::string>& v) {
    return v ? nlohmann::json(*v) : nlohmann::json(nullptr);
  };
  nlohmann::json voxels = nlohmann::json::array();
  for (const PlayedDifference& v : replay.voxels)
    voxels.push_back(
        {{"voxel", position_json(v.pos)}, {"of", v.layer}, {"found", value(v.found)}, {"expected", value(v.expected)}});
  nlohmann::json first{{"tick", replay.differs_by}, {"in", replay.differs_in}, {"voxels", voxels}};
  if (!voxels.empty()) first.update(voxels[0]);
  return first;
}

void print_difference(const std::string& log, const PlayReplay& replay, const nlohmann::json& j) {
  if (!j.contains("first")) return print_inequality(log, replay);
  std::printf(
      "%s: equal to tick %llu; first differs at tick %llu, in %s, %s\n", log.c_str(),
      static_cast<unsigned long long>(replay.same_until), static_cast<unsigned long long>(replay.differs_by),
      replay.differs_in.c_str(),
      replay.voxels.empty() ? "in no voxel that is known" : ("in voxel " + position_text(j["first"]["voxel"])).c_str());
  constexpr size_t kMostPrinted = 10;
  const auto text = [](const std::optional<std::string>& v) { return v ? v->c_str() : "nothing known"; };
  for (size_t n = 0; n < std::min(kMostPrinted, replay.voxels.size()); ++n) {
    const PlayedDifference& v = replay.voxels[n];
    std::printf("  %s %s: %s, recorded %s\n", position_text(position_json(v.pos)).c_str(), v.layer.c_str(),
                text(v.found), text(v.expected));
  }
}

/// A session of `loam play --record`.
world::Result<int> replay_session(const ReplayVerbOptions& options) {
  const world::ThreadLimit limit(options.replay.threads);
  if (!options.replay.settings.empty())
    return world::usage_error("--set is for what `loam sim --record` wrote: a session of play has its world's knobs");
  const std::string& name = options.replay.log;
  TRY(const PlayLog log, read_play_log(name));
  TRY(const PlayReplay replay, replay_play(log));
  nlohmann::json j{{"log", name},
                   {"scene", log.scene},
                   {"marks", replay.marks},
                   {"equal", replay.equal},
                   {"same_until", replay.same_until},
                   {"hash", hash_text(replay.hash)},
                   {"recorded", hash_text(replay.recorded)}};
  if (!replay.equal) {
    j["differs_by"] = replay.differs_by;
    if (!replay.differs_in.empty()) j["first"] = first_json(replay);
  }
  if (options.json)
    std::cout << json_text(j) << '\n';
  else if (replay.equal)
    std::printf("%s: equal at %llu marks, to tick %llu: %s\n", name.c_str(),
                static_cast<unsigned long long>(replay.marks), static_cast<unsigned long long>(replay.same_until),
                hash_text(replay.hash).c_str());
  else
    print_difference(name, replay, j);
  return replay.equal ? 0 : static_cast<int>(world::ErrorKind::comparison);
}

world::Result<int> run_replay(const ReplayVerbOptions& options) {
  const std::string& log = options.replay.log;
  if (is_play_log(log)) return replay_session(options);
  Progress progress;
  TRY(const Replay replay, replay_recording(options.replay, [&](const std::string& at) { progress.stage(at); }));
  progress.stage("");
  const nlohmann::json j = replay_json(replay, log);
  if (options.json)
    std::cout << json_text(j) << '\n';
  else if (replay.equal)
    std::printf("%s: equal at %zu marks, to tick %llu\n", log.c_str(), replay.recording.marks.size(),
                static_cast<unsigned long long>(replay.same_until));
  else
    print_inequality(log, replay);
  if (!replay.equal && !options.json) print_places(j);
  return replay.equal ? 0 : static_cast<int>(world::ErrorKind::comparison);
}

}  // namespace

void add_replay_verb(CommandLine& command) {
  auto options = std::make_shared<ReplayVerbOptions>();
  CLI::App* verb = command.verb(
      "replay", "repeat a recorded simulation, or session of play, and say at which tick and voxel it first differs");
  verb->add_option("LOG", options->replay.log, "what `loam sim --record` or `loam play --record` wrote")->required();
  verb->add_option("-t,--threads", options->replay.threads, "threads (default: all)");
  verb->add_option("--set", options->replay.settings, "a knob, KNOB=VALUE, to repeat it with; `loam sim` lists them")
      ->allow_extra_args(false);
  verb->add_flag("--json", options->json, "one JSON object on stdout");
  command.action(verb, [options] { return run_replay(*options); });
}

}  // namespace tools
