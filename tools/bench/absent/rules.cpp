/// Rules of matter that a world doesn't call for, against the same program without them; worlds at rest; and an edit in
/// a large world against the same edit in a small one.
#include <fmt/format.h>

#include "sim/matter/matter.h"
#include "tools/bench/absent.h"
#include "tools/bench/world_fill.h"

namespace tools {

namespace {

constexpr int kTicks = 48, kHeap = 24, kLongestTicks = 4000;

/// A floor of granite `edge` m wide with a cube of `heap` m above it, which moves for as long as a run takes.
std::unique_ptr<world::World> world_with(const char* block, int heap, int edge = 64) {
  auto made = std::make_unique<world::World>(world::standard_blocks());
  // With walls, so that water comes to rest.
  fill_block(*made, {{0, 0, 0}, {edge - 1, 47, edge - 1}}, "granite");
  fill_block(*made, {{1, 8, 1}, {edge - 2, 47, edge - 2}}, "air");
  const int half = heap / 2, middle = edge / 2;
  if (heap > 0)
    fill_block(*made,
               {{middle - half, 20, middle - half}, {middle - half + heap - 1, 19 + heap, middle - half + heap - 1}},
               block);
  return made;
}

AbsentRun run_of(sim::Matter& matter, const std::string& rule) {
  AbsentRun run;
  run.hash = matter.state_hash();
  for (const sim::EffectReport& effect : matter.effects()) {
    run.counters[effect.name + " leaves"] = effect.leaves_visited;
    run.counters[effect.name + " bytes"] = effect.bytes;
    if (effect.name == rule)
      run.leaves_visited = effect.leaves_visited, run.bytes = effect.bytes, run.passes = effect.called_for;
  }
  run.counters["bytes"] = matter.bytes();
  return run;
}

Result<AbsentRun> run_rule(const std::string& rule, const char* block, bool left_out) {
  const auto world = world_with(block, kHeap);
  sim::MatterOptions options;
  if (left_out) options.without = {rule};
  sim::Matter matter(*world, options);
  TRY_STATUS(matter.begin());
  for (int i = 0; i < kTicks; ++i) matter.step();
  return run_of(matter, rule);
}

/// Many ticks of a world where all has come to rest.
Result<AbsentRun> run_settled(const std::shared_ptr<world::World>& world, const std::shared_ptr<sim::Matter>& matter) {
  AbsentRun run;
  for (int i = 0; i < 2000; ++i) run.leaves_visited += matter->step().leaves_visited;
  keep(world);
  run.hash = run.counters["leaves"] = run.leaves_visited;
  return run;
}

struct Settled {
  std::shared_ptr<world::World> world;
  std::shared_ptr<sim::Matter> matter;
};

Result<Settled> settled_world(const char* block, int heap) {
  Settled made{world_with(block, heap, 32), nullptr};
  made.matter = std::make_shared<sim::Matter>(*made.world, sim::MatterOptions{});
  TRY_STATUS(made.matter->begin());
  for (int i = 0; i < kLongestTicks && !made.matter->settled(); ++i) made.matter->step();
  if (!made.matter->settled()) return world::input_error(fmt::format("{} doesn't settle", block));
  return made;
}

/// A hole into a floor with sand on it, in a world of `edge` m: what moves then is the same in each.
Result<AbsentRun> run_edit(const std::shared_ptr<sim::Matter>& matter, const std::shared_ptr<world::World>& world) {
  const world::BlockId sand = world->palette->find("sand").value();
  world::EditBatch batch;
  batch.fill({{8, 20, 8}, {11, 23, 11}}, sand);
  TRY_STATUS(matter->edit(batch));
  AbsentRun run;
  uint64_t visited = 0;
  for (int i = 0; i < 400 && (i == 0 || !matter->settled()); ++i) visited += matter->step().leaves_visited;
  run.counters["leaves"] = visited;
  world::EditBatch clear;
  clear.fill({{0, 8, 0}, {31, 40, 31}}, world::kAir);
  TRY_STATUS(matter->edit(clear));
  while (true) {
    matter->step();
    if (matter->settled()) break;
  }
  return run;
}

}  // namespace

void add_absent_rules(std::vector<AbsentCase>& cases) {
  for (const sim::RuleRow& row : sim::rule_rows()) {
    const std::string rule(row.info.name);
    // A heap that calls for other rules than this one.
    const char* const moves = rule == "granular" ? "water" : "sand";
    cases.push_back({rule, fmt::format("{} falls; the program with the rule, and without", moves),
                     [=](BenchContext&) -> Result<AbsentCase::Pair> {
                       return AbsentCase::Pair{[=] { return run_rule(rule, moves, true); },
                                               [=] { return run_rule(rule, moves, false); }};
                     }});
  }
  for (const char* block : {"sand", "water"})
    cases.push_back({fmt::format("settled_{}", block),
                     "2000 ticks at rest of a heap of 24^3 voxels, against one of 8^3",
                     [=](BenchContext&) -> Result<AbsentCase::Pair> {
                       TRY(const Settled rest, settled_world(block, kHeap));
                       TRY(const Settled few, settled_world(block, 8));
                       return AbsentCase::Pair{[=] { return run_settled(few.world, few.matter); },
                                               [=] { return run_settled(rest.world, rest.matter); }};
                     }});
  cases.push_back({"world_size", "a bucket of sand tipped out, in 256 times 8 m of land against 64",
                   [](BenchContext&) -> Result<AbsentCase::Pair> {
                     const auto make = [](int edge) {
                       std::shared_ptr<world::World> world = world_with("granite", 0, edge);
                       world::EditBatch batch;  // so that the rule is there from the start
                       batch.fill({{8, 8, 8}, {8, 8, 8}}, world->palette->find("sand").value());
                       CHECK(world->store.apply(batch).ok());
                       return Settled{world, std::make_shared<sim::Matter>(*world, sim::MatterOptions{})};
                     };
                     const Settled small = make(64), large = make(256);
                     for (const Settled& s : {small, large}) {
                       TRY_STATUS(s.matter->begin());
                       while (!s.matter->settled()) s.matter->step();
                     }
                     return AbsentCase::Pair{[=] { return run_edit(small.matter, small.world); },
                                             [=] { return run_edit(large.matter, large.world); }};
                   }});
}

}  // namespace tools
