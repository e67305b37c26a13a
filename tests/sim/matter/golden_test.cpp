/// The states of scenes after so many ticks, against tests/golden/matter.toml: a change of any rule shows here, on
/// purpose or not. Where it is on purpose, this makes the file anew:
///
///   LOAM_REMAKE_GOLDEN=1 build/release/loam_sim_tests --gtest_filter='Golden.*'
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "sim/matter/matter.h"
#include "tests/support.h"
#include "world/base/jobs.h"
#include "world/scenes/scene.h"

namespace sim {
namespace {

struct Golden {
  std::string scene;
  unsigned long long ticks = 0;
  std::string hash;
};

std::filesystem::path golden_file() { return std::filesystem::path(world::kSourceFolder) / "tests/golden/matter.toml"; }

/// Lines `scene = { ticks = N, hash = "..." }`; others are comments.
std::vector<Golden> read_golden() {
  std::ifstream file(golden_file());
  std::vector<Golden> all;
  for (std::string line; std::getline(file, line);) {
    char scene[64], hash[64];
    unsigned long long ticks = 0;
    if (std::sscanf(line.c_str(), "%63[a-z_] = { ticks = %llu, hash = \"%16[0-9a-f]\" }", scene, &ticks, hash) == 3)
      all.push_back({scene, ticks, hash});
  }
  return all;
}

std::string hash_after(const std::string& name, uint64_t ticks) {
  auto scene = world::load_scene(name);
  CHECK(scene.ok());
  world::ImportReport report;
  auto world = world::build_world(*scene, report);
  CHECK(world.ok());
  MatterOptions options;
  options.seed = world->simulation.seed;
  options.effects = world->simulation.effects;
  for (const auto& [knob, value] : world->simulation.knobs) CHECK(sim_knobs().set(options.knobs, knob, value).ok());
  Matter matter(*world, options);
  CHECK(matter.begin().ok());
  for (uint64_t i = 0; i < ticks; ++i) matter.step();
  char text[20];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(matter.state_hash()));
  return text;
}

TEST(Golden, ScenesComeToTheirStatesOnAnyThreads) {
  std::vector<Golden> all = read_golden();
  ASSERT_GE(all.size(), 7u) << golden_file();
  if (std::getenv("LOAM_REMAKE_GOLDEN")) {
    std::ofstream file(golden_file());
    file << "# Hashes of the state of scenes after so many ticks, and how to make them anew: tests/sim/matter/"
            "golden_test.cpp.\n";
    for (const Golden& golden : all)
      file << golden.scene << " = { ticks = " << golden.ticks << ", hash = \"" << hash_after(golden.scene, golden.ticks)
           << "\" }\n";
    return;
  }
  for (const Golden& golden : all)
    for (const int threads : {1, 2, 3, 8}) {
      const world::ThreadLimit limit(threads);
      EXPECT_EQ(hash_after(golden.scene, golden.ticks), golden.hash) << golden.scene << ", " << threads << " threads";
    }
}

}  // namespace
}  // namespace sim
