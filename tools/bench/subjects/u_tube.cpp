/// What a model of liquids gets wrong in communicating vessels: two basins of 8 x 8 m joined by a pipe below, all of
/// the water in one of them at first, and how far apart the levels are later.
///
/// In the end both stand at the mean, by hydrostatics, to one unit of mass a voxel: 1/4096 m. The second metric is what
/// of the water is gone, or was made.
#include <cmath>

#include <fmt/format.h>

#include "sim/matter/matter.h"
#include "tools/bench/benchmark.h"
#include "tools/bench/world_fill.h"

namespace tools {

namespace {

constexpr int kWide = 8, kApart = 8, kFull = 16;  // m
constexpr double kTickSeconds = 0.05;

struct Tube {
  world::World world{world::standard_blocks()};
  std::unique_ptr<sim::Matter> matter;
  double work = 0;

  /// Metres of water in the basin that begins at x.
  double level(int x0) const {
    int64_t units = 0;
    for (int x = x0; x < x0 + kWide; ++x)
      for (int z = 0; z < kWide; ++z)
        for (int y = 0; y < kFull + 8; ++y) units += matter->amount_at({x, y, z});
    return static_cast<double>(units) / sim::kFullVoxel / (kWide * kWide);
  }
};

std::unique_ptr<Tube> run(sim::LiquidModel model, int passes, double seconds, uint64_t seed) {
  auto tube = std::make_unique<Tube>();
  const int second = kWide + kApart;
  fill_block(tube->world, {{-1, -4, -1}, {second + kWide, kFull + 8, kWide}}, "granite");
  for (const int x0 : {0, second}) fill_block(tube->world, {{x0, 0, 0}, {x0 + kWide - 1, kFull + 8, kWide - 1}}, "air");
  // Down from the one, along, and up into the other.
  fill_block(tube->world, {{kWide - 2, -2, 3}, {kWide - 1, -1, 4}}, "water");
  fill_block(tube->world, {{second, -2, 3}, {second + 1, -1, 4}}, "water");
  fill_block(tube->world, {{kWide - 2, -3, 3}, {second + 1, -2, 4}}, "water");
  fill_block(tube->world, {{0, 0, 0}, {kWide - 1, kFull - 1, kWide - 1}}, "water");
  sim::MatterOptions options;
  options.seed = seed;
  options.knobs.liquid_model = model;
  options.knobs.liquid_passes = passes;
  tube->matter = std::make_unique<sim::Matter>(tube->world, options);
  for (int i = 0; i < static_cast<int>(seconds / kTickSeconds) && !(i > 0 && tube->matter->settled()); ++i)
    tube->work += static_cast<double>(tube->matter->step().leaves_visited) * world::kLeafVoxels;
  return tube;
}

ErrorSample error_of(const Tube& tube) {
  const double first = tube.level(0), second = tube.level(kWide + kApart);
  double changed = 0;
  for (const sim::LedgerRow& row : tube.matter->ledger())
    if (row.substance == "water") changed = std::abs(static_cast<double>(row.now - row.start)) / double(row.start);
  return {{std::abs(first - second) / kFull, changed}, (first - second) / kFull};
}

}  // namespace

void add_subject_u_tube(Registry& registry) {
  Subject subject{.question = "how soon, and how well, do communicating vessels become level?",
                  .reference = "hydrostatics: both at the mean",
                  .metrics = {"difference of level (of 16 m)", "water made or lost (relative)"},
                  .work_unit = "voxels",
                  .knob_unit = "passes a tick"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    for (const double seconds : {5.0, 20.0, 80.0}) {
      const auto add = [&](sim::LiquidModel model, int passes) {
        const std::string method(knob_choices(model)[static_cast<size_t>(model)]);
        Setting s{.method = method,
                  .setting = fmt::format("{:g} s {}@{}", seconds, method, passes),
                  .problem = fmt::format("after {:g} s", seconds)};
        s.knob = passes;
        s.is_default = model == sim::LiquidModel::finite && passes == 1;
        s.measure = [=](uint64_t seed) { return error_of(*run(model, passes, seconds, seed)); };
        s.run = [=] { return run(model, passes, seconds, 1)->work; };
        settings.push_back(std::move(s));
      };
      add(sim::LiquidModel::levels, 1);
      for (const int passes : {1, 4}) add(sim::LiquidModel::finite, passes);
      if (!context.quick()) add(sim::LiquidModel::finite, 16);
      add(sim::LiquidModel::waves, 1);
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
