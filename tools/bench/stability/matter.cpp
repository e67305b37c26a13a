/// Matter that is neither made nor lost, for any number of threads and across saves: CM, TH and IO of the catalogue.
#include <cmath>
#include <set>

#include "sim/matter/matter.h"
#include "tools/bench/stability.h"
#include "tools/bench/world_fill.h"
#include "world/base/jobs.h"
#include "world/formats/format.h"

namespace tools {

namespace {

/// A wall of granite round a floor, with heaps of sand and water over it.
std::unique_ptr<world::World> basin() {
  auto made = std::make_unique<world::World>(world::standard_blocks());
  fill_block(*made, {{-1, 0, -1}, {32, 40, 32}}, "granite");
  fill_block(*made, {{0, 1, 0}, {31, 40, 31}}, "air");
  fill_block(*made, {{4, 6, 4}, {15, 17, 15}}, "water");
  fill_block(*made, {{10, 22, 10}, {24, 34, 24}}, "sand");
  return made;
}

Result<double> mass_lost() {
  const auto world = basin();
  sim::Matter matter(*world, {});
  TRY_STATUS(matter.begin());
  for (int i = 0; i < 600; ++i) matter.step();
  double lost = 0;
  for (const sim::LedgerRow& row : matter.ledger()) lost += std::abs(double(row.start + row.in - row.out - row.now));
  return lost;
}

Result<double> hashes_by_threads() {
  std::set<uint64_t> hashes;
  for (const int threads : {1, 2, 3, 8}) {
    const world::ThreadLimit limit(threads);
    const auto world = basin();
    sim::Matter matter(*world, {});
    TRY_STATUS(matter.begin());
    for (int i = 0; i < 200; ++i) matter.step();
    hashes.insert(matter.state_hash());
  }
  return static_cast<double>(hashes.size() - 1);
}

Result<double> hashes_across_a_save(BenchContext& context) {
  TRY(const std::filesystem::path folder, context.scratch());
  const auto world = basin();
  sim::Matter matter(*world, {});
  TRY_STATUS(matter.begin());
  for (int i = 0; i < 100; ++i) matter.step();
  matter.save_state();
  TRY_STATUS(world::write_world(*world, folder / "half.loam"));
  world::ImportReport report;
  TRY(world::World loaded, world::read_world(folder / "half.loam", {}, report));
  sim::MatterOptions options;
  options.tick = matter.tick();
  sim::Matter again(loaded, options);
  TRY_STATUS(again.begin());
  for (int i = 0; i < 100; ++i) matter.step(), again.step();
  return matter.state_hash() != again.state_hash();
}

Result<double> comes_to_rest() {
  const auto world = basin();
  sim::Matter matter(*world, {});
  TRY_STATUS(matter.begin());
  for (int i = 0; i < 5000 && !matter.settled(); ++i) matter.step();
  uint64_t visited = 0;
  for (int i = 0; i < 100; ++i) visited += matter.step().leaves_visited;
  return static_cast<double>(visited);
}

/// Diffusion by explicit steps of ratio r: the highest temperature of a bar that begins between 0 and 1, over 1.
double diffused_beyond(double r) {
  std::vector<double> t(64, 0.0);
  for (size_t i = 28; i < 36; ++i) t[i] = i % 2;
  double worst = 0;
  for (int n = 0; n < 200; ++n) {
    std::vector<double> next = t;
    for (size_t i = 1; i + 1 < t.size(); ++i) next[i] = t[i] + r * (t[i - 1] - 2 * t[i] + t[i + 1]);
    t = next;
    for (const double v : t) worst = std::max({worst, v - 1, -v});
  }
  return worst;
}

}  // namespace

void add_stability_matter(std::vector<StabilityCase>& cases) {
  cases.push_back({"CM1", "sand and water in a basin: what is there at the start is there 600 ticks later",
                   "units of 1/4096 m3", 0, "whole numbers", [](BenchContext&) { return mass_lost(); }});
  cases.push_back({"CM7", "the same comes to rest, and then visits no leaf", "leaves in 100 ticks", 0, "exactness",
                   [](BenchContext&) { return comes_to_rest(); }});
  cases.push_back({"TH1", "1, 2, 3 and 8 threads find the same state", "other hashes", 0, "bit equality",
                   [](BenchContext&) { return hashes_by_threads(); }});
  cases.push_back({"TH11", "a run that was saved and loaded half way ends in the same state", "other hashes", 0,
                   "bit equality", hashes_across_a_save});
  cases.push_back({"CM4", "explicit diffusion at a ratio of 1/6 keeps the maximum principle", "beyond 0 to 1", 0,
                   "von Neumann's bound", [](BenchContext&) -> Result<double> { return diffused_beyond(1.0 / 6); },
                   [] { return diffused_beyond(0.6); }});
}

}  // namespace tools
