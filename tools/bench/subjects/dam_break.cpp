/// What a model of liquids gets wrong where a dam breaks: 12 m of water in a channel, a second later, against Ritter's
/// solution over a dry bed. The automata have no inertia, so that all of them are too slow; more passes are less so.
/// source August Ritter. Die Fortpflanzung der Wasserwellen. 1892 (shallow water, no friction)
#include <cmath>

#include <fmt/format.h>

#include "sim/matter/matter.h"
#include "tools/bench/benchmark.h"

namespace tools {

namespace {

constexpr int kDepth = 12, kReach = 48, kWidth = 4;  // m
constexpr double kGravity = 9.81, kSeconds = 1, kTickSeconds = 0.05;

/// Depth at x from the dam, which was at 0 with water on the negative side.
double ritter(double x) {
  const double c = std::sqrt(kGravity * kDepth), speed = x / kSeconds;
  if (speed <= -c) return kDepth;
  if (speed >= 2 * c) return 0;
  return (2 * c - speed) * (2 * c - speed) / (9 * kGravity);
}

struct Broken {
  world::World world{world::standard_blocks()};
  std::unique_ptr<sim::Matter> matter;
  double work = 0;  // voxels looked at
};

std::unique_ptr<Broken> broken(sim::LiquidModel model, int passes, uint64_t seed) {
  auto made = std::make_unique<Broken>();
  const auto fill = [&](world::VoxelPos low, world::VoxelPos high, const char* block) {
    world::EditBatch batch;
    batch.fill({low, high}, made->world.palette->find(block).value());
    CHECK(made->world.store.apply(batch).ok());
  };
  fill({-kReach - 1, -1, -1}, {kReach, kDepth + 4, kWidth}, "granite");
  fill({-kReach, 0, 0}, {kReach - 1, kDepth + 4, kWidth - 1}, "air");
  fill({-kReach, 0, 0}, {-1, kDepth - 1, kWidth - 1}, "water");
  sim::MatterOptions options;
  options.seed = seed;
  options.knobs.liquid_model = model;
  options.knobs.liquid_passes = passes;
  made->matter = std::make_unique<sim::Matter>(made->world, options);
  for (int i = 0; i < static_cast<int>(kSeconds / kTickSeconds); ++i)
    made->work += static_cast<double>(made->matter->step().leaves_visited) * world::kLeafVoxels;
  return made;
}

/// Depth as RMS over the channel and its mean, and the front: where less than 2 cm lie.
ErrorSample error_of(const Broken& dam) {
  double squares = 0, sum = 0, front = 0;
  for (int x = -kReach; x < kReach; ++x) {
    double depth = 0;
    for (int y = 0; y < kDepth + 4; ++y)
      for (int z = 0; z < kWidth; ++z) depth += dam.matter->amount_at({x, y, z});
    depth /= static_cast<double>(sim::kFullVoxel) * kWidth;
    if (depth > 0.02) front = x + 1;
    const double wrong = depth - ritter(x + 0.5);
    squares += wrong * wrong, sum += wrong;
  }
  const double right_front = 2 * std::sqrt(kGravity * kDepth) * kSeconds;
  return {{std::sqrt(squares / (2 * kReach)) / kDepth, std::abs(front - right_front)}, sum / (2 * kReach) / kDepth};
}

}  // namespace

void add_subject_dam_break(Registry& registry) {
  Subject subject{.question = "how well does a model of liquids break a dam?",
                  .reference = "Ritter's solution over a dry bed, a second after",
                  .metrics = {"RMS error of depth (relative to the dam's)", "error of the front (m)"},
                  .work_unit = "voxels",
                  .knob_unit = "passes a tick"};
  subject.settings = [](BenchContext&) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    const auto add = [&](sim::LiquidModel model, int passes) {
      const std::string method(knob_choices(model)[static_cast<size_t>(model)]);
      Setting s{.method = method,
                .setting = model == sim::LiquidModel::levels ? method : fmt::format("{}@{}", method, passes)};
      s.knob = passes;
      s.is_default = model == sim::LiquidModel::finite && passes == 1;
      s.measure = [=](uint64_t seed) { return error_of(*broken(model, passes, seed)); };
      s.run = [=] { return broken(model, passes, 1)->work; };
      settings.push_back(std::move(s));
    };
    add(sim::LiquidModel::levels, 1);
    for (const int passes : {1, 2, 4, 8, 16}) add(sim::LiquidModel::finite, passes);
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
