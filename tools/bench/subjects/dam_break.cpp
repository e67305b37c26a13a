/// What a model of liquids gets wrong where a dam breaks: 12 m of water in a channel, a second later, against Ritter's
/// solution over a dry bed, and Stoker's over 2 m of water. Automata without inertia are too slow, and know no bore;
/// more passes are less so. source August Ritter. Die Fortpflanzung der Wasserwellen. 1892; James Stoker. Water Waves.
/// 1957, section 10.8 (both:
///        shallow water, no friction); Olivier Delestre and others. SWASHES. 2013, section 4.1 (as formulas)
#include <cmath>

#include <fmt/format.h>

#include "sim/matter/matter.h"
#include "tools/bench/benchmark.h"
#include "tools/bench/world_fill.h"

namespace tools {

namespace {

constexpr int kDepth = 12, kReach = 48, kWidth = 4;  // m
constexpr double kGravity = 9.81, kSeconds = 1, kTickSeconds = 0.05;

/// What is right a second after, from the dam at 0 with the deep water on the negative side.
struct Solution {
  int bed = 0;        // depth of the water ahead, m
  double front = 0;   // of what has moved, m
  double middle = 0;  // speed of waves in what has moved evenly, m/s; 0 over a dry bed
  double depth(double x) const {
    const double c = std::sqrt(kGravity * kDepth), speed = x / kSeconds;
    if (speed <= -c) return kDepth;
    if (x >= front) return bed;
    if (bed > 0 && speed >= 2 * c - 3 * middle) return middle * middle / kGravity;
    return (2 * c - speed) * (2 * c - speed) / (9 * kGravity);
  }
};
Solution solution_over(int bed) {
  const double c = std::sqrt(kGravity * kDepth), ahead = kGravity * bed;
  Solution s;
  s.bed = bed;
  s.front = 2 * c * kSeconds;
  if (bed == 0) return s;
  // The depth between rarefaction and bore.
  double low = std::sqrt(ahead), high = c;
  for (int i = 0; i < 100; ++i) {
    const double m = (low + high) / 2, square = m * m;
    const double over =
        -8 * ahead * square * (c - m) * (c - m) + (square - ahead) * (square - ahead) * (square + ahead);
    (over > 0 ? high : low) = m;
  }
  s.middle = low;
  s.front = 2 * low * low * (c - low) / (low * low - ahead) * kSeconds;
  return s;
}

struct Broken {
  world::World world{world::standard_blocks()};
  std::unique_ptr<sim::Matter> matter;
  double work = 0;  // voxels looked at
};

std::unique_ptr<Broken> broken(int bed, sim::LiquidModel model, int passes, uint64_t seed) {
  auto made = std::make_unique<Broken>();
  fill_block(made->world, {{-kReach - 1, -1, -1}, {kReach, kDepth + 4, kWidth}}, "granite");
  fill_block(made->world, {{-kReach, 0, 0}, {kReach - 1, kDepth + 4, kWidth - 1}}, "air");
  fill_block(made->world, {{-kReach, 0, 0}, {-1, kDepth - 1, kWidth - 1}}, "water");
  if (bed > 0) fill_block(made->world, {{0, 0, 0}, {kReach - 1, bed - 1, kWidth - 1}}, "water");
  sim::MatterOptions options;
  options.seed = seed;
  options.knobs.liquid_model = model;
  options.knobs.liquid_passes = passes;
  made->matter = std::make_unique<sim::Matter>(made->world, options);
  for (int i = 0; i < static_cast<int>(kSeconds / kTickSeconds); ++i)
    made->work += static_cast<double>(made->matter->step().leaves_visited) * world::kLeafVoxels;
  return made;
}

/// Depth as RMS over the channel and its mean, and the front: where the depth is 2 cm above the bed's, or 5 % of the
/// step, whichever is more.
ErrorSample error_of(const Broken& dam, const Solution& right) {
  double squares = 0, sum = 0, front = -kReach, water = 0;
  for (int x = -kReach; x < kReach; ++x) {
    double depth = 0;
    for (int y = 0; y < kDepth + 4; ++y)
      for (int z = 0; z < kWidth; ++z) depth += dam.matter->amount_at({x, y, z});
    depth /= static_cast<double>(sim::kFullVoxel) * kWidth;
    water += depth;
    const double step = right.bed > 0 ? 0.05 * (kDepth - right.bed) : 0.02;
    if (depth > right.bed + step) front = x + 1;
    const double wrong = depth - right.depth(x + 0.5);
    squares += wrong * wrong, sum += wrong;
  }
  const double at_first = static_cast<double>(kReach) * (kDepth + right.bed);
  return {{std::sqrt(squares / (2 * kReach)) / kDepth, std::abs(front - right.front), std::abs(water / at_first - 1)},
          sum / (2 * kReach) / kDepth};
}

void add_dam(Registry& registry, const char* name, int bed, const char* reference) {
  Subject subject{.name = name,
                  .question = "how well does a model of liquids break a dam?",
                  .reference = reference,
                  .metrics = {"RMS error of depth (relative to the dam's)", "error of the front (m)",
                              "water made or lost (relative)"},
                  .work_unit = "voxels",
                  .knob_unit = "passes a tick"};
  subject.settings = [bed](BenchContext&) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    const Solution right = solution_over(bed);
    const auto add = [&](sim::LiquidModel model, int passes) {
      const std::string method(knob_choices(model)[static_cast<size_t>(model)]);
      Setting s{.method = method,
                .setting = model == sim::LiquidModel::finite ? fmt::format("{}@{}", method, passes) : method};
      s.knob = passes;
      s.is_default = model == sim::LiquidModel::finite && passes == 1;
      s.measure = [=](uint64_t seed) { return error_of(*broken(bed, model, passes, seed), right); };
      s.run = [=] { return broken(bed, model, passes, 1)->work; };
      settings.push_back(std::move(s));
    };
    add(sim::LiquidModel::levels, 1);
    for (const int passes : {1, 2, 4, 8, 16}) add(sim::LiquidModel::finite, passes);
    add(sim::LiquidModel::waves, 1);
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace

void add_subject_dam_break(Registry& registry) {
  add_dam(registry, "dam_break", 0, "Ritter's solution over a dry bed, a second after");
  add_dam(registry, "dam_break_wet", 2, "Stoker's solution over 2 m of water, a second after");
}

}  // namespace tools
