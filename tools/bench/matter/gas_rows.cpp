#include "tools/bench/matter/gas_rows.h"

#include <chrono>

#include "tools/bench/matter/rule_bench.h"

namespace tools {

namespace {

/// A closed hall of 128 x 64 x 128, a third of which one gas fills; another gas beside it, or not.
Result<Prepared> prepare_gas(BenchContext& context, const char* second) {
  const int ticks = context.quick() ? 20 : 60;
  Prepared prepared;
  prepared.ours = {"amounts of awake leaves", [=] {
                     RuleBench bench;
                     const world::VoxelBox hall{{0, 0, 0}, {127, 63, 127}};
                     bench.fill({{-8, -8, -8}, {135, 71, 135}}, "granite");
                     bench.fill(hall, "air");
                     bench.fill({{0, 0, 0}, {127, 20, 127}}, "methane");
                     if (second) bench.fill({{0, 21, 0}, {127, 40, 127}}, second);
                     bench.start("gas", hall);
                     bench.wake();
                     for (int i = 0; i < 3; ++i) bench.step();
                     double voxels = 0;
                     const auto start = std::chrono::steady_clock::now();
                     for (int i = 0; i < ticks; ++i) voxels += bench.step();
                     const auto time = std::chrono::steady_clock::now() - start;
                     return voxels / std::chrono::duration<double>(time).count() * 1e-9;
                   }};
  return prepared;
}

}  // namespace

void add_gas_rows(Registry& registry) {
  registry.add({.name = "gas",
                .what = "looks at awake voxels of a hall of 128x64x128 in which methane rises: 60 ticks",
                .unit = "G voxels/s",
                .timing = Timing::reported,
                .threads = 2,
                .repetitions = 5,
                .reach = Reach{0.5, "the aim; Sandspiel's cells in the plane: 50 M"},
                .prepare = [](BenchContext& c) { return prepare_gas(c, nullptr); }});
  registry.add({.name = "gas_two_kinds",
                .what = "the same with carbon dioxide above it, which sinks through",
                .unit = "G voxels/s",
                .timing = Timing::reported,
                .threads = 2,
                .repetitions = 5,
                .prepare = [](BenchContext& c) { return prepare_gas(c, "carbon_dioxide"); }});
}

}  // namespace tools
