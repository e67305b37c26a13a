/// loam sim SCENE or WORLD: simulates without a picture, and says what moved, what it cost and whether the books agree.
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/matter/matter.h"
#include "sim/matter/thermal.h"
#include "tools/inhabitants.h"
#include "tools/interrupt.h"
#include "tools/json_text.h"
#include "tools/knob_settings.h"
#include "tools/progress.h"
#include "tools/recording.h"
#include "tools/verb.h"
#include "world/base/jobs.h"
#include "world/base/text.h"
#include "world/scenes/scene.h"
#include "world/scenes/scene_reactions.h"

namespace tools {

namespace {

constexpr uint64_t kMostTicks = 1'000'000'000;
constexpr const char* kTickKey = "simulated_ticks";  // in a world's metadata

struct SimOptions {
  std::string scene, save, resume, until, record, accuracy;
  std::vector<std::string> settings;
  uint64_t ticks = 0, seed = 0, record_every = 16;
  int threads = 0;
  bool json = false, has_seed = false, has_ticks = false;
};

struct SimResult {
  uint64_t ticks = 0;
  double seconds = 0;
  bool interrupted = false;
};

world::Status check_options(const SimOptions& options) {
  if (!options.until.empty() && options.until != "settled")
    return world::usage_error("--until takes settled, not \"" + options.until + "\"");
  if (!options.has_ticks && options.until.empty())
    return world::usage_error("say how long: --ticks N, or --until settled, or both");
  if (options.ticks > kMostTicks)
    return world::usage_error(fmt::format("--ticks takes up to {}, not {}", kMostTicks, options.ticks));
  if (options.record_every == 0) return world::usage_error("--record-every takes a number of ticks above 0");
  if (!options.resume.empty() && !options.save.empty())
    return world::usage_error("--resume FILE saves to that file: leave --save out");
  return {};
}

nlohmann::json sim_json(sim::Matter& matter, const SimResult& result) {
  nlohmann::json j;
  j["ticks"] = result.ticks;
  j["tick"] = matter.tick();
  j["hash"] = fmt::format("{:016x}", matter.state_hash());
  j["ticks_per_s"] = result.seconds > 0 ? static_cast<double>(result.ticks) / result.seconds : 0.0;
  j["ms"] = result.seconds * 1e3;
  j["awake_leaves"] = matter.awake_leaves();
  j["settled"] = matter.settled();
  j["interrupted"] = result.interrupted;
  j["bytes"] = matter.bytes();
  j["ledger"] = nlohmann::json::object();
  bool exact = true;
  for (const sim::LedgerRow& row : matter.ledger()) {
    const nlohmann::json numbers = {{"start", row.start}, {"now", row.now}, {"in", row.in}, {"out", row.out}};
    if (row.is_heat)
      j["heat"] = numbers;
    else
      j["ledger"][row.substance] = numbers;
    exact &= row.exact();
  }
  j["ledger_exact"] = exact;
  j["effects"] = nlohmann::json::array();
  for (const sim::EffectReport& effect : matter.effects())
    j["effects"].push_back({{"name", effect.name},
                            {"called_for", effect.called_for},
                            {"why", effect.why},
                            {"ms", effect.ms},
                            {"leaves_visited", effect.leaves_visited},
                            {"voxels_changed", effect.voxels_changed},
                            {"moved", effect.moved},
                            {"bytes", effect.bytes},
                            {"notes", effect.notes}});
  return j;
}

/// A whole number of joules.
std::string joules(int64_t units) {
  const std::string digits =
      world::with_thousands(static_cast<uint64_t>(std::abs(units) * static_cast<int64_t>(sim::kHeatUnitJ)));
  return (units < 0 ? "-" : "") + digits;
}

void print_sim(const nlohmann::json& j) {
  std::printf("ticks         %s, %.1f a second%s\n", world::with_thousands(j["ticks"].get<uint64_t>()).c_str(),
              j["ticks_per_s"].get<double>(),
              j["interrupted"].get<bool>() ? "; stopped by Ctrl-C"
              : j["settled"].get<bool>()   ? "; settled"
                                           : "");
  std::printf("awake         %s leaves, %s\n", world::with_thousands(j["awake_leaves"].get<uint64_t>()).c_str(),
              world::bytes_text(j["bytes"].get<double>()).c_str());
  std::printf("hash          %s\n", j["hash"].get<std::string>().c_str());
  std::printf("\neffects                       ms        leaves        voxels  called for by\n");
  for (const auto& effect : j["effects"])
    std::printf("  %-18s %12.3f %13s %13s  %s\n", effect["name"].get<std::string>().c_str(), effect["ms"].get<double>(),
                world::with_thousands(effect["leaves_visited"].get<uint64_t>()).c_str(),
                world::with_thousands(effect["voxels_changed"].get<uint64_t>()).c_str(),
                effect["called_for"].get<bool>() ? effect["why"].get<std::string>().c_str() : "nothing");
  for (const auto& effect : j["effects"])
    if (const auto moved = effect["moved"].get<uint64_t>(); moved > 0)
      std::printf("  %s: %s moved, those of each tick\n", effect["name"].get<std::string>().c_str(),
                  world::with_thousands(moved).c_str());
  for (const auto& effect : j["effects"])
    for (const auto& note : effect["notes"])
      std::printf("  %s: %s\n", effect["name"].get<std::string>().c_str(), note.get<std::string>().c_str());
  std::printf("\nledger, m3               start            in           out           now%s\n",
              j["ledger_exact"].get<bool>() ? "   exact to 1/4096" : "   NOT BALANCED");
  const auto m3 = [](const nlohmann::json& n) { return n.get<double>() / sim::kFullVoxel; };
  for (const auto& [name, row] : j["ledger"].items())
    std::printf("  %-18s %13.3f %13.3f %13.3f %13.3f\n", name.c_str(), m3(row["start"]), m3(row["in"]), m3(row["out"]),
                m3(row["now"]));
  if (!j.contains("heat")) return;
  std::printf("\n  J, exact to 20 %20s %20s %20s %20s\n  %-14s", "start", "in", "out", "now", "heat");
  for (const char* column : {"start", "in", "out", "now"})
    std::printf(" %20s", joules(j["heat"][column].get<int64_t>()).c_str());
  std::printf("\n");
}

world::Result<int> run_sim(const SimOptions& options) {
  TRY_STATUS(check_options(options));
  const world::ThreadLimit limit(options.threads);
  std::error_code ignored;
  const bool goes_on = !options.resume.empty() && std::filesystem::exists(options.resume, ignored);
  TRY(const world::Scene scene, world::load_scene(goes_on ? options.resume : options.scene));
  world::ImportReport report;
  TRY(world::World world, world::build_world(scene, report));
  TRY_STATUS(world::add_scene_reactions(goes_on ? options.resume : options.scene, world));
  for (const std::string& warning : report.warnings) std::fprintf(stderr, "%s\n", warning.c_str());

  TRY(const world::Accuracy accuracy, world::accuracy_from_name(options.accuracy));
  TRY(sim::MatterOptions matter_options, sim::matter_options(world, accuracy));
  if (options.has_seed) matter_options.seed = options.seed;
  // A save goes on with what was set.
  TRY_STATUS(set_knobs(sim::sim_knobs(), matter_options.knobs, options.settings, &world.simulation.knobs));
  if (const auto tick = world.metadata.find(kTickKey); tick != world.metadata.end())
    matter_options.tick = std::strtoull(tick->second.c_str(), nullptr, 10);
  sim::Matter matter(world, matter_options);
  TRY_STATUS(matter.begin());

  // With --resume they count from the world's first tick, however often it was stopped.
  uint64_t most = options.has_ticks ? options.ticks : kMostTicks;
  if (!options.resume.empty()) most -= std::min(most, matter.tick());
  SimResult result;
  StopOnInterrupt stop;
  Progress progress;
  const auto start = std::chrono::steady_clock::now();
  Recording recording;
  recording.scene = options.scene;
  recording.seed = matter_options.seed;
  recording.start = matter.tick();
  recording.every = options.record_every;
  recording.saved = options.save;
  recording.threads = world::thread_count();
  LeafHashes leaves(world.store);
  std::map<world::LeafPos, uint64_t> marked;
  for (const auto& row : sim::sim_knobs().rows()) recording.knobs[row.name] = row.get(matter_options.knobs);
  const auto mark = [&] {
    if (options.record.empty() || matter.tick() == recording.start) return;
    if (!recording.marks.empty() && recording.marks.back().tick == matter.tick()) return;
    const uint64_t hash = matter.state_hash();
    const std::map<world::LeafPos, uint64_t>& now = leaves.update();
    recording.marks.push_back({matter.tick(), hash, changed_hashes(marked, now)});
    marked = now;
  };
  while (result.ticks < most && !(result.interrupted = stop.asked())) {
    if (!options.until.empty() && matter.settled()) break;
    matter.step();
    ++result.ticks;
    if (result.ticks % recording.every == 0) mark();
    if (result.ticks % 64 == 0)
      progress.stage(fmt::format("tick {}, {} leaves awake", matter.tick(), matter.awake_leaves()));
  }
  progress.stage("");
  mark();
  matter.flush();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  const nlohmann::json j = sim_json(matter, result);
  if (!options.record.empty()) TRY_STATUS(write_recording(recording, options.record));
  if (!options.save.empty() || !options.resume.empty() || result.interrupted) {
    const std::string path = !options.save.empty()     ? options.save
                             : !options.resume.empty() ? options.resume
                                                       : scene.name + "-checkpoint.loam";
    matter.save_state();
    world.metadata[kTickKey] = std::to_string(matter.tick());
    set_cloud_drift(world.environment, matter.tick());
    world.simulation.seed = matter_options.seed;
    TRY_STATUS(world::write_world(world, path));
    std::fprintf(stderr, "saved %s at tick %llu\n", path.c_str(), static_cast<unsigned long long>(matter.tick()));
  }
  if (options.json)
    std::cout << json_text(j) << '\n';
  else
    print_sim(j);
  return j["ledger_exact"].get<bool>() ? 0 : static_cast<int>(world::ErrorKind::unstable);
}

}  // namespace

void add_sim_verb(CommandLine& command) {
  auto options = std::make_shared<SimOptions>();
  CLI::App* verb = command.verb("sim", "simulate a world without pictures: ticks a second, books, effects, state hash");
  verb->add_option("SCENE", options->scene, "a scene, a saved world, or any file that can be read")->required();
  CLI::Option* ticks = verb->add_option("--ticks", options->ticks, "how many ticks of 1/20 s; the most, with --until");
  verb->add_option("--until", options->until, "settled: stop when nothing moves any more");
  verb->add_option("-t,--threads", options->threads, "threads (default: all)");
  CLI::Option* seed = verb->add_option("--seed", options->seed, "of all that is random (default: the scene's)");
  verb->add_option("--save", options->save, "write the world to this .loam file; `loam sim` goes on from it");
  verb->add_option("--resume", options->resume,
                   "a .loam file: goes on from it where it exists, up to --ticks in all, and saves to it");
  std::string knobs = "a knob, KNOB=VALUE:";
  for (const auto& row : sim::sim_knobs().rows()) knobs += "\n" + row.name + ": " + row.what;
  verb->add_option("--set", options->settings, knobs)->allow_extra_args(false);
  verb->add_option("--accuracy", options->accuracy, "fast, usual or exact: the knobs that --set doesn't name")
      ->default_val("usual");
  verb->add_option("--record", options->record, "write hashes of the state to this file, for `loam replay`");
  verb->add_option("--record-every", options->record_every, "ticks from a hash to the next");
  verb->add_flag("--json", options->json, "one JSON object on stdout");
  command.action(verb, [options, ticks, seed]() -> world::Result<int> {
    options->has_ticks = ticks->count() > 0;
    options->has_seed = seed->count() > 0;
    return run_sim(*options);
  });
}

}  // namespace tools
