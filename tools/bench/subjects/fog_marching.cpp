/// How wrong the transmittance of a medium is when it is marched or estimated instead of integrated, and what that
/// costs: height fog, which has a closed form, and smoke in a density grid.
///
/// height fog  0.05 1/m at density 1, scale height 20 m; rays of 10 .. 300 m from 0 .. 40 m up, in all directions that
///             stay above -40 m. Reference: the closed form.
/// fog kinds   of one density within bounds: everywhere, in a box, in an ellipsoid, below a slanted plane; 0.05 1/m,
/// rays of
///             10 .. 100 m that begin within 40 m. Reference: the closed form of each. What a march misses is the piece
///             of a step that lies across a bound, so both rules are first order there, and exact where there is none.
/// smoke       a ball of 48 voxels with smooth lumps and holes, trilinear; rays through it. Reference: the integral of
///             each cell's cubic, which is exact but for rounding. Marching's steps share the part of the ray inside
///             the grid's bounds.
/// Marching from the left is first order in the step, from the middle second; jittered steps are wrong by chance, with
/// a standard deviation of order 1.5. Delta and ratio tracking are right in the mean; n is how many estimates are
/// averaged.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/trace/media.h"
#include "tools/bench/benchmark.h"
#include "world/base/random.h"
#include "world/media/brick_field.h"

namespace tools {

namespace {

using render::MarchRule;
using world::Medium;
using world::Vec3d;

struct FogRay {
  Vec3d origin, direction;
  double t0, t1;
  double exact;  // transmittance
};
struct FogProblem {
  Medium medium;
  double sigma_t = 0;
  std::vector<FogRay> rays;
};

struct Numbers {
  uint64_t seed, n = 0;
  double operator()() { return world::uniform01_double(world::random_bits(seed, static_cast<int64_t>(n++), 0, 0)); }
};

Vec3d any_direction(Numbers& random) {
  const double z = 2 * random() - 1, phi = 6.28318530717958648 * random(), r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), z, r * std::sin(phi)};
}

std::shared_ptr<const FogProblem> height_fog(int count, uint64_t seed) {
  auto problem = std::make_shared<FogProblem>();
  problem->medium.kind = "height_fog";
  problem->medium.scale_height = 20;
  problem->sigma_t = 0.05;
  Numbers random{seed};
  while (static_cast<int>(problem->rays.size()) < count) {
    const Vec3d origin(0, 40 * random(), 0), direction = any_direction(random);
    const double t1 = 10 + 290 * random();
    if (origin.y + t1 * direction.y < -40) continue;
    problem->rays.push_back({origin, direction, 0, t1, 0});
  }
  return problem;
}

std::shared_ptr<const FogProblem> fog_of_kind(const std::string& kind, int count, uint64_t seed) {
  auto problem = std::make_shared<FogProblem>();
  problem->medium.kind = kind;
  problem->medium.half_extent = {30, 12, 20};
  problem->medium.normal = world::Vec3f(glm::normalize(Vec3d(0.2, 1, -0.3)));
  problem->sigma_t = 0.05;
  Numbers random{seed};
  for (int i = 0; i < count; ++i) {
    const Vec3d origin = 40.0 * random() * any_direction(random), direction = any_direction(random);
    problem->rays.push_back({origin, direction, 0, 10 + 90 * random(), 0});
  }
  return problem;
}

/// Lumps of a size of 6 voxels, from noise on a lattice of that pitch.
float smoke_density(world::VoxelPos v, uint64_t seed) {
  const double r = std::sqrt(double(v.x * v.x + v.y * v.y + v.z * v.z)) / 24;
  if (r >= 1) return 0;
  const Vec3d p = Vec3d(v.x + 60, v.y + 60, v.z + 60) / 6.0, low = floor(p), f = p - low, w = f * f * (3.0 - 2.0 * f);
  double noise = 0;
  for (int c = 0; c < 8; ++c) {
    const int64_t x = static_cast<int64_t>(low.x) + (c >> 2), y = static_cast<int64_t>(low.y) + (c >> 1 & 1),
                  z = static_cast<int64_t>(low.z) + (c & 1);
    noise += (c & 4 ? w.x : 1 - w.x) * (c & 2 ? w.y : 1 - w.y) * (c & 1 ? w.z : 1 - w.z) *
             world::uniform01_double(world::random_bits(seed, x, y, z));
  }
  return static_cast<float>(std::max(0.0, (1 - r * r) * 4 * (noise - 0.4)));
}

Result<std::shared_ptr<const FogProblem>> smoke(int count, uint64_t seed) {
  std::vector<world::FieldLeaf> leaves;
  for (int x = -3; x < 3; ++x)
    for (int y = -3; y < 3; ++y)
      for (int z = -3; z < 3; ++z) {
        world::FieldLeaf& leaf = leaves.emplace_back();
        leaf.leaf = {x, y, z};
        for (int i = 0; i < world::kLeafVoxels; ++i)
          leaf.values[static_cast<size_t>(i)] =
              smoke_density(world::voxel_from_leaf(leaf.leaf) + world::offset_in_leaf(i), seed);
      }
  auto problem = std::make_shared<FogProblem>();
  problem->medium.kind = "density_grid";
  TRY(problem->medium.field, world::BrickField::make(std::move(leaves), world::FieldSampling::trilinear, "smoke"));
  problem->sigma_t = 0.1;
  Numbers random{seed + 1};
  while (static_cast<int>(problem->rays.size()) < count) {
    const Vec3d direction = any_direction(random), through = 20.0 * random() * any_direction(random);
    const Vec3d origin = through - 60.0 * direction;
    const world::MediumInterval in = world::medium_interval(problem->medium, origin, direction, 200);
    if (!in.empty()) problem->rays.push_back({origin, direction, in.t0, in.t1, 0});
  }
  return std::shared_ptr<const FogProblem>(std::move(problem));
}

std::shared_ptr<const FogProblem> with_exact(const FogProblem& problem) {
  auto made = std::make_shared<FogProblem>(problem);
  for (FogRay& r : made->rays)
    r.exact = render::closed_transmittance(made->medium, r.origin, r.direction, r.t0, r.t1, made->sigma_t);
  return made;
}

enum class Method { closed, left, midpoint, jittered, delta, ratio };

double transmittance(const FogProblem& p, const FogRay& r, Method method, int n, render::RandomNumbers random) {
  double sum = 0;
  switch (method) {
    case Method::closed:
      return render::closed_transmittance(p.medium, r.origin, r.direction, r.t0, r.t1, p.sigma_t);
    case Method::left:
    case Method::midpoint:
    case Method::jittered: {
      const MarchRule rule = method == Method::left       ? MarchRule::left
                             : method == Method::midpoint ? MarchRule::midpoint
                                                          : MarchRule::jittered;
      return std::exp(-p.sigma_t * render::marched_depth(p.medium, r.origin, r.direction, r.t0, r.t1, rule, n, random));
    }
    case Method::delta:
      for (int i = 0; i < n; ++i)
        sum += render::delta_tracked_transmittance(p.medium, r.origin, r.direction, r.t0, r.t1, p.sigma_t, random);
      return sum / n;
    case Method::ratio:
      for (int i = 0; i < n; ++i)
        sum += render::ratio_tracked_transmittance(p.medium, r.origin, r.direction, r.t0, r.t1, p.sigma_t, random);
      return sum / n;
  }
  return 0;
}

/// Metrics: root mean square and largest error of the transmittance over the rays; bias: mean signed error.
ErrorSample errors_of(const FogProblem& p, Method method, int n, uint64_t seed) {
  Numbers random{seed};
  double squares = 0, sum = 0, worst = 0;
  for (const FogRay& r : p.rays) {
    const double error = transmittance(p, r, method, n, random) - r.exact;
    squares += error * error, sum += error, worst = std::max(worst, std::abs(error));
  }
  const double count = static_cast<double>(p.rays.size());
  return {{std::sqrt(squares / count), worst}, sum / count};
}

void add_settings(std::vector<Setting>& settings, const std::string& name, Method method, std::vector<int> knobs,
                  const std::shared_ptr<const FogProblem>& problem, bool is_default) {
  for (const int n : knobs) {
    Setting setting{.method = name, .setting = fmt::format("{}@{}", name, n)};
    setting.knob = n, setting.is_default = is_default;
    setting.stochastic = method == Method::jittered || method == Method::delta || method == Method::ratio;
    setting.measure = [=](uint64_t seed) { return errors_of(*problem, method, n, seed); };
    setting.run = [=] {
      Numbers random{7};
      double sum = 0;
      for (const FogRay& r : problem->rays) sum += transmittance(*problem, r, method, n, random);
      keep(sum);
      return static_cast<double>(problem->rays.size());
    };
    settings.push_back(std::move(setting));
  }
}

Subject subject(const std::string& name, const std::string& question, const std::string& reference) {
  return {.name = name,
          .question = question,
          .reference = reference,
          .metrics = {"error of transmittance (RMS)", "error of transmittance (largest)"},
          .work_unit = "rays"};
}

std::vector<Setting> all_methods(const std::shared_ptr<const FogProblem>& problem, std::vector<int> steps) {
  std::vector<Setting> settings;
  const std::vector<int> estimates{1, 4, 16, 64};
  add_settings(settings, "closed form", Method::closed, {1}, problem, true);
  add_settings(settings, "left", Method::left, steps, problem, false);
  add_settings(settings, "midpoint", Method::midpoint, steps, problem, false);
  add_settings(settings, "jittered", Method::jittered, steps, problem, false);
  add_settings(settings, "delta tracking", Method::delta, estimates, problem, false);
  add_settings(settings, "ratio tracking", Method::ratio, estimates, problem, false);
  return settings;
}

}  // namespace

void add_subject_fog_marching(Registry& registry) {
  Subject height =
      subject("fog_marching", "how many steps does fog need, where it has a closed form?", "closed form of height fog");
  height.expected_slopes = {{"left", {-1, 16}},
                            {"midpoint", {-2, 16}},
                            {"jittered", {-1.5, 16}},
                            {"delta tracking", {-0.5, 1}},
                            {"ratio tracking", {-0.5, 1}}};
  height.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    const auto problem = with_exact(*height_fog(context.quick() ? 200 : 1000, context.seed()));
    return all_methods(problem, {1, 2, 4, 8, 16, 32, 64, 128});
  };
  registry.add(std::move(height));

  Subject kinds = subject("fog_kinds", "how many steps does fog of one density within bounds need?",
                          "closed form of each kind of fog");
  for (const char* kind : {"box_fog", "ellipsoid_fog", "halfspace_fog"})
    kinds.expected_slopes[std::string(kind) + " midpoint"] = {-1, 8};
  kinds.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    for (const std::string kind : {"homogeneous", "box_fog", "ellipsoid_fog", "halfspace_fog"}) {
      const auto problem = with_exact(*fog_of_kind(kind, context.quick() ? 400 : 4000, context.seed()));
      const size_t first = settings.size();
      add_settings(settings, kind + " closed form", Method::closed, {1}, problem, true);
      add_settings(settings, kind + " midpoint", Method::midpoint, {1, 2, 4, 8, 16, 32, 64, 128}, problem, false);
      add_settings(settings, kind + " jittered", Method::jittered, {1, 4, 16, 64}, problem, false);
      for (size_t i = first; i < settings.size(); ++i) settings[i].problem = kind;
    }
    return settings;
  };
  registry.add(std::move(kinds));

  Subject grid = subject("fog_marching_smoke", "how is the transmittance of smoke found fastest at a given error?",
                         "integral of each cell's cubic, exact but for rounding");
  grid.expected_slopes = {{"delta tracking", {-0.5, 1}}, {"ratio tracking", {-0.5, 1}}};
  grid.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const auto made, smoke(context.quick() ? 200 : 1000, context.seed()));
    return all_methods(with_exact(*made), {4, 8, 16, 32, 64, 128, 256});
  };
  registry.add(std::move(grid));
}

}  // namespace tools
