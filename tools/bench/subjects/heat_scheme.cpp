/// What a scheme of conduction costs and gets wrong: a Gaussian of heat in a bar of copper, spread from 4 to 12 voxels,
/// against the closed form. The knob is r = diffusivity * dt / h^2 of a step: by
/// heat_interval at the usual heat_speed, and by a speed that leaves so much for one tick; explicit steps beyond 1/6 of
/// the block that conducts best are cut.
#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "sim/matter/heat_plan.h"
#include "sim/matter/thermal.h"
#include "tools/bench/benchmark.h"
#include "tools/bench/matter/rule_bench.h"

namespace tools {

namespace {

using sim::HeatScheme;

constexpr int kLength = 128;
constexpr double kFrom = 4, kTo = 12, kPeak = 1e8;  // voxels, voxels, units

double gaussian(int x, double variance) {
  const double d = x + 0.5 - kLength / 2;
  return kPeak * kFrom / std::sqrt(variance) * std::exp(-d * d / (2 * variance));
}

double copper_diffusivity(const world::BlockPalette& palette) {  // m^2/s
  const world::Block& copper = palette[palette.find("copper_block").value()];
  return copper.heat_conductivity.value / (copper.density.value * copper.heat_capacity.value);
}

/// r of copper in a tick.
double tick_ratio(const sim::SimKnobs& knobs) {
  return copper_diffusivity(world::standard_blocks()) * static_cast<double>(knobs.heat_speed) /
         sim::kHeatTicksPerSecond;
}

sim::HeatPlan plan_of(const sim::SimKnobs& knobs) {
  const double largest = sim::ThermalTraits(world::standard_blocks(), {}).largest_diffusivity();
  return sim::plan_heat(knobs, largest).value();
}

/// After the ticks that take it as near to kTo as they can.
std::unique_ptr<RuleBench> spread(const sim::SimKnobs& knobs, double& variance, double& work) {
  auto bench = std::make_unique<RuleBench>();
  const world::VoxelBox bar{{0, 0, 0}, {kLength - 1, 7, 7}};
  // In a block that conducts nothing.
  world::Block insulator;
  insulator.name = "insulator";
  insulator.heat_conductivity = world::HeatConductivity{1e-12};
  CHECK(bench->world.palette->add(insulator).ok());
  bench->fill({bar.min - world::VoxelPos{1, 1, 1}, bar.max + world::VoxelPos{1, 1, 1}}, "insulator");
  bench->fill(bar, "copper_block");
  bench->options.knobs = knobs;
  bench->start("heat", bar);
  for (const sim::PageId p : bench->pages) {
    const int low = world::voxel_from_leaf(bench->cells->pos(p)).x;
    for (int i = 0; i < world::kLeafVoxels; ++i)
      bench->cells->heats(p)[static_cast<size_t>(i)] =
          static_cast<int32_t>(std::llround(gaussian(low + world::offset_in_leaf(i).x, kFrom * kFrom)));
    bench->cells->stir_heat(p);
  }
  bench->cells->spread();
  const int interval = plan_of(knobs).interval;
  const double ratio = tick_ratio(knobs), steps = std::round((kTo * kTo - kFrom * kFrom) / (2 * ratio * interval));
  const int ticks = std::max(static_cast<int>(steps), 1) * interval;
  work = 0;
  for (int i = 0; i < ticks; ++i) work += bench->step();
  variance = kFrom * kFrom + 2 * ratio * ticks;
  return bench;
}

/// Relative to the peak that it should have.
ErrorSample error_of(const sim::SimKnobs& knobs) {
  double variance = 0, work = 0;
  const auto bench = spread(knobs, variance, work);
  double squares = 0, sum = 0, largest = 0;
  for (int x = 0; x < kLength; ++x) {
    const sim::PageId p = bench->cells->find(world::leaf_from_voxel({x, 3, 3}));
    const double wrong = bench->cells->find_heats(p)[world::index_in_leaf({x, 3, 3})] - gaussian(x, variance);
    squares += wrong * wrong, sum += wrong, largest = std::max(largest, std::abs(wrong));
  }
  const double peak = kPeak * kFrom / std::sqrt(variance);
  return {{std::sqrt(squares / kLength) / peak, largest / peak}, sum / kLength / peak};
}

}  // namespace

void add_subject_heat_scheme(Registry& registry) {
  Subject subject{
      .question = "how should heat be conducted, and in which steps?",
      .reference = "closed form: a Gaussian whose variance grows by 2 r a step",
      .metrics = {"RMS error of temperature (relative to the peak)", "largest error (relative to the peak)"},
      .work_unit = "voxels",
      .knob_unit = "r of a step"};
  subject.settings = [](BenchContext&) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    const auto add_one = [&](const sim::SimKnobs& knobs, std::string_view name, bool is_default) {
      const std::string method(knob_choices(knobs.heat_scheme)[static_cast<size_t>(knobs.heat_scheme)]);
      Setting s{.method = method, .setting = fmt::format("{}@{}", method, name)};
      s.knob = tick_ratio(knobs) * plan_of(knobs).interval;
      s.is_default = is_default;
      s.measure = [=](uint64_t) { return error_of(knobs); };
      s.run = [=] {
        double variance = 0, work = 0;
        spread(knobs, variance, work);
        return work;
      };
      settings.push_back(std::move(s));
    };
    const sim::SimKnobs usual;
    for (const int ticks : {1, 2, 4, 8, 16}) {
      sim::SimKnobs knobs = usual;
      knobs.heat_interval = ticks;
      add_one(knobs, fmt::format("{} ticks", ticks), ticks == usual.heat_interval);
    }
    const auto add = [&](HeatScheme scheme, std::initializer_list<double> ratios) {
      for (const double ratio : ratios) {
        sim::SimKnobs knobs = usual;
        knobs.heat_scheme = scheme, knobs.heat_interval = 1;
        knobs.heat_speed = static_cast<float>(ratio / tick_ratio(usual) * static_cast<double>(usual.heat_speed));
        add_one(knobs, fmt::format("{:g}", ratio), false);
      }
    };
    add(HeatScheme::limited, {0.1, 0.4, 1.6, 6.4});
    add(HeatScheme::explicit_steps, {0.4, 1.6, 6.4});
    add(HeatScheme::implicit, {0.4, 1.6, 6.4, 25.6});
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
