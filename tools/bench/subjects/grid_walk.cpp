/// How many rays visit a wrong voxel when the grid walk's arithmetic is cheaper than exact, by length of the ray.
///
/// Origins within 1000 m of the world's origin, directions anywhere on a cube; all are numbers that a float holds, so
/// that each method starts from the same ray and only the walk differs.
/// Adding up in double visits the right voxels too at these lengths, and costs a little less; but its t drifts, and a
/// walk that crosses 128 empty voxels in one step has no sum to go on with. So Loam recomputes t from the plane.
#include <array>
#include <memory>
#include <type_traits>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"
#include "world/base/random.h"
#include "world/space/grid_walk_variants.h"

namespace tools {

namespace {

using world::FixedRay;

constexpr double kOriginRange = 1000;
constexpr int kTimedSteps = 1000000;  // a call, whatever the rays' length

using Rays = std::vector<FixedRay>;

Rays make_rays(int count, uint64_t seed) {
  Rays rays(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i)
    for (int a = 0; a < 3; ++a) {
      const auto draw = [&](uint64_t stream, double range) {
        return (2 * world::uniform01_double(world::random_bits(seed, i, a, 0, 0, stream)) - 1) * range;
      };
      FixedRay& ray = rays[static_cast<size_t>(i)];
      ray.origin[a] = static_cast<int64_t>(static_cast<double>(static_cast<float>(draw(0, kOriginRange))) * 0x1p32);
      ray.direction[a] = static_cast<int32_t>(draw(1, 0x1p24));
    }
  return rays;
}

/// Metrics: rays with a wrong voxel, per million; the largest deviation of a voxel; bias: as the first, which has no
/// sign.
template <class Walk>
ErrorSample errors_of(const Rays& rays, int steps) {
  int wrong_rays = 0;
  int64_t worst = 0;
  double worst_t = 0;
  for (const FixedRay& ray : rays) {
    world::ExactWalk exact(ray);
    Walk walk(ray);
    bool wrong = false;
    for (int i = 0; i < steps; ++i) {
      exact.step();
      walk.step();
      for (int a = 0; a < 3; ++a) {
        const int64_t off = std::abs(int64_t{walk.cell(a)} - exact.cell(a));
        wrong |= off != 0;
        worst = std::max(worst, off);
      }
    }
    wrong_rays += wrong;
    bool ends_right = true;
    for (int a = 0; a < 3; ++a) ends_right &= walk.cell(a) == exact.cell(a);
    if (ends_right) worst_t = std::max(worst_t, std::abs(walk.t() - exact.t()) / exact.t());
  }
  const double per_million = 1e6 * wrong_rays / static_cast<double>(rays.size());
  return {{per_million, static_cast<double>(worst), worst_t}, per_million};
}

template <class Walk>
double walk_all(const Rays& rays, int steps) {
  int64_t sum = 0;
  const int count = std::min(static_cast<int>(rays.size()), kTimedSteps / steps);
  for (int r = 0; r < count; ++r) {
    Walk walk(rays[static_cast<size_t>(r)]);
    for (int i = 0; i < steps; ++i) walk.step();
    sum += walk.cell(0) + walk.cell(1) + walk.cell(2);
  }
  keep(sum);
  return static_cast<double>(count) * steps;
}

template <class Walk>
void add_settings(std::vector<Setting>& settings, const std::string& method, const std::shared_ptr<const Rays>& rays,
                  bool quick) {
  for (const int steps : {100, 1000, 10000}) {
    Setting setting{.method = method, .setting = fmt::format("{}@{}", method, steps)};
    setting.problem = fmt::format("{} steps", steps), setting.knob = steps;
    setting.is_default = std::is_same_v<Walk, world::DoubleWalk>;
    setting.is_reference = std::is_same_v<Walk, world::ExactWalk>;  // only of rays of whole numbers
    const int count = std::min(static_cast<int>(rays->size()), (quick ? 500000 : 20000000) / steps);
    const auto measured = std::make_shared<const Rays>(rays->begin(), rays->begin() + count);
    setting.measure = [measured, steps](uint64_t) { return errors_of<Walk>(*measured, steps); };
    setting.run = [rays, steps] { return walk_all<Walk>(*rays, steps); };
    settings.push_back(std::move(setting));
  }
}

}  // namespace

void add_subject_grid_walk(Registry& registry) {
  Subject subject{
      .question = "what does the precision of the grid walk cost, and what does it save?",
      .reference = "crossings compared as fractions of 128-bit integers: exact",
      .metrics = {"rays with a wrong voxel (per million)", "largest deviation (voxels)", "error of t (relative)"},
      .work_unit = "steps; a call makes 1e6: 1 ms a call is 1 ns a step"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    const auto rays = std::make_shared<const Rays>(make_rays(context.quick() ? 10000 : 200000, context.seed()));
    std::vector<Setting> settings;
    const bool quick = context.quick();
    add_settings<world::AccumulateWalk<float>>(settings, "float accumulate", rays, quick);
    add_settings<world::RecomputeWalk<float>>(settings, "float recompute", rays, quick);
    add_settings<world::AccumulateWalk<double>>(settings, "double accumulate", rays, quick);
    add_settings<world::DoubleWalk>(settings, "double recompute", rays, quick);
    add_settings<world::FixedWalk>(settings, "fixed 32.32", rays, quick);
    add_settings<world::ExactWalk>(settings, "exact integers", rays, quick);
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
