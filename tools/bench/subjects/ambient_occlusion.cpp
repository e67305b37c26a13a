/// How well occlusion of the sky by rays of some number and length stands in for the sky's light.
///
/// 128 m of the valley under a sky of one radiance and no sun; one point for each of 72 x 48 pixels. "open sky" is
/// light_transport=direct, the closed form of a sky that nothing hides; "corners" darkens that by the voxels next to a
/// face (corner_occlusion); the others are ambient_occlusion with 1 to 64
/// rays a point that see no further than 8 m, 32 m, or all. The first error is against what the sky sends to the first
/// surface: rays of any length are right in the mean, shorter ones find too much sky. The second is against all light
/// of up to 6 scatterings, which none of them has.
///
/// Stratified rays that look for edges come near as N^(-3/4), the order of scrambled nets for the indicator of a set in
/// the plane.
/// source  Zhijian He, Xiaoqun Wang. On the Convergence Rate of Randomized Quasi-Monte Carlo for Discontinuous
///         Functions. 2015; Sergey Zhukov, Andrey Iones, Grigorij Kronin. An Ambient Light Illumination Model. 1998
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"
#include "tools/bench/sight_lines.h"
#include "world/base/random.h"

namespace tools {

namespace {

using render::RenderKnobs;

constexpr int kWidth = 72, kHeight = 48, kMostScatterings = 6;

Result<std::shared_ptr<const SightLines>> valley_under_sky() {
  TRY(world::Scene scene, world::load_scene("valley"));
  scene.box = {{128, 0, -256}, {255, 255, -129}};
  scene.cameras.clear();  // the whole crop, from the south-east
  scene.environment.sun_irradiance = {};
  scene.environment.sky_zenith = scene.environment.sky_horizon = scene.environment.sky_ground = {1, 1, 1};
  return SightLines::make(scene, kWidth, kHeight);
}

struct Truth {
  LineHalves first_surface, all;
};

struct Method {
  std::string name;
  render::LightTransport transport;
  float distance;
};

}  // namespace

void add_subject_ambient_occlusion(Registry& registry) {
  Subject subject{.question = "how many rays, and how long, does the occlusion of the sky need?",
                  .reference = "path tracing, two independent halves of 1024 samples a point (quick: 128)",
                  .metrics = {"RMS error of the sky's light (relative)", "RMS error against all light (relative)"},
                  .work_unit = "points",
                  .expected_slopes = {{"any length", {-0.75, 1}}}};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const std::shared_ptr<const SightLines> sight, valley_under_sky());
    const int samples = context.quick() ? 128 : 1024;
    const auto truth = [=, &context] {
      return context.shared<Truth>("ambient_occlusion", [&] {
        const RenderKnobs knobs;
        return std::make_shared<Truth>(Truth{line_halves(*sight, knobs, 1, samples, context.seed()),
                                             line_halves(*sight, knobs, kMostScatterings, samples, context.seed())});
      });
    };
    std::vector<Setting> settings;
    for (const Method& method : {Method{"open sky", render::LightTransport::direct, 0},
                                 Method{"8 m", render::LightTransport::ambient_occlusion, 8},
                                 Method{"32 m", render::LightTransport::ambient_occlusion, 32},
                                 Method{"any length", render::LightTransport::ambient_occlusion, 1e9f}})
      for (const int rays : method.distance > 0 ? std::vector{1, 4, 16, 64} : std::vector{1}) {
        RenderKnobs knobs;
        knobs.light_samples = rays, knobs.occlusion_distance = method.distance;
        Setting s{.method = method.name, .setting = fmt::format("{}@{}", method.name, rays)};
        s.knob = rays;
        s.is_default = method.distance == 0;
        s.stochastic = method.distance > 0;
        s.measure = [=](uint64_t seed) {
          const auto seen = sight->radiance(method.transport, knobs, 1, world::hash_combine(seed, 1));
          const auto known = truth();
          return ErrorSample{{relative_rms(seen, known->first_surface), relative_rms(seen, known->all)},
                             relative_bias(seen, known->first_surface),
                             relative_noise(known->first_surface)};
        };
        s.run = [=] {
          keep(sight->radiance(method.transport, knobs, 1, 1));
          return static_cast<double>(sight->size());
        };
        settings.push_back(std::move(s));
      }
    // By the eight voxels around a face alone.
    RenderKnobs corners;
    corners.corner_occlusion = true, corners.sun_shadow = render::SunShadow::none;
    Setting s{.method = "corners", .setting = "corners@8"};
    s.knob = 8;
    s.measure = [=](uint64_t) {
      const auto seen = sight->raycast(corners);
      const auto known = truth();
      return ErrorSample{{relative_rms(seen, known->first_surface), relative_rms(seen, known->all)},
                         relative_bias(seen, known->first_surface),
                         relative_noise(known->first_surface)};
    };
    // A picture of a world that stands still: the first has found the light of faces.
    const auto again = std::make_shared<std::function<std::vector<world::Vec3d>()>>();
    s.run = [=] {
      if (!*again) *again = sight->raycaster(corners);
      keep((*again)());
      return static_cast<double>(sight->size());
    };
    settings.push_back(std::move(s));
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
