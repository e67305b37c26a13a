/// What a model of light costs and what it gets wrong: a cave with a lamp, coloured lamps behind a bend, and a shaft to
/// the sky; and the Cornell box in voxels.
///
/// light_model          every face under the open sky; levels of grey and of colour; flux along 6 to 512 directions.
///                      Time is that of all light from nothing. Levels fall by a fifth a voxel, as games draw them, not
///                      as light does: their error has a floor. That of flux falls with the directions to that of
///                      voxels. Paths of the tracer cost their time anew in each picture; their work is paths.
/// flux_residual        32 directions, reflection stopped at residuals from 0.3 to 0.001, against one of 1e-6
/// flux_lamp_points     32 directions, lamps seen from 0 to 16 points of each, in the Cornell box
/// light_interpolation  flux along 128 directions, drawn with one value a face, means at corners, linear between
/// middles One point for each of 72 x 48 pixels.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"
#include "tools/bench/sight_lines.h"
#include "tools/light.h"
#include "tools/picture.h"
#include "world/base/random.h"

namespace tools {

namespace {

using render::LightInterpolation;
using render::LightModel;
using render::RenderKnobs;

constexpr int kWidth = 72, kHeight = 48;
/// Light that is left after so many scatterings: the mean albedo of limestone is 0.5.
constexpr int kMostScatterings = 24;

struct LitScene {
  std::shared_ptr<const SightLines> lines;
  std::unique_ptr<render::Backend> raycast;
};

Result<std::shared_ptr<LitScene>> scene_of(const std::string& name) {
  TRY(const world::Scene scene, world::load_scene(name));
  auto made = std::make_shared<LitScene>();
  TRY(made->lines, SightLines::make(scene, kWidth, kHeight));
  TRY(made->raycast, make_backend("raycast"));
  return made;
}

/// What all of a subject's settings do.
Setting setting(const std::shared_ptr<LitScene>& c, const std::string& method, int knob, const RenderKnobs& knobs,
                const std::function<std::shared_ptr<LineHalves>()>& truth) {
  Setting s{.method = method, .setting = fmt::format("{}@{}", method, knob)};
  s.knob = knob;
  s.measure = [=](uint64_t) {
    const auto right = truth();
    const auto seen = c->lines->raycast(knobs);
    return line_errors(seen, *right);
  };
  s.run = [=] {
    LightOfWorld light;
    CHECK(light.follow(c->lines->world(), c->lines->camera().position, knobs).ok());
    return static_cast<double>(c->lines->world().store.bounds().volume());
  };
  return s;
}

std::function<std::shared_ptr<LineHalves>()> path_traced(BenchContext& context, const std::shared_ptr<LitScene>& c,
                                                         const std::string& problem) {
  return [&context, c, problem] {
    return context.shared<LineHalves>("light_model " + problem, [&] {
      return std::make_shared<LineHalves>(
          line_halves(*c->lines, RenderKnobs{}, kMostScatterings, context.quick() ? 64 : 1024, context.seed()));
    });
  };
}

RenderKnobs flux(int directions, float residual) {
  RenderKnobs knobs;
  knobs.light_model = LightModel::flux;
  knobs.flux_directions = directions, knobs.flux_residual = residual;
  return knobs;
}

constexpr const char* kPathTraced = "path tracing, two independent halves of 1024 samples a point (quick: 64)";

void add_models(Registry& registry) {
  Subject subject{.name = "light_model",
                  .question = "what is a model of light worth, and what does it cost?",
                  .reference = kPathTraced,
                  .metrics = line_metrics(),
                  .work_unit = "voxels; of path traced paths"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    for (const std::string problem : {"cave", "cornell_voxels"}) {
      TRY(const std::shared_ptr<LitScene> c, scene_of(problem));
      const auto truth = path_traced(context, c, problem);
      const size_t first = settings.size();
      for (const LightModel model : {LightModel::none, LightModel::flood4, LightModel::flood_rgb}) {
        RenderKnobs knobs;
        knobs.light_model = model;
        settings.push_back(setting(c, std::string(knob_choices(model)[static_cast<size_t>(model)]), 0, knobs, truth));
        settings.back().is_default = model == RenderKnobs{}.light_model;
      }
      for (const int directions : {6, 8, 32, 72, 128, 288, 512})
        if (!context.quick() || directions <= 128)
          settings.push_back(setting(c, "flux", directions, flux(directions, 0.01f), truth));
      for (const int samples : {1, 4, 16}) {
        Setting traced{.method = "path traced", .setting = fmt::format("path traced@{}", samples)};
        traced.knob = samples, traced.stochastic = true;
        const auto by_paths = [c, samples](uint64_t seed) {
          RenderKnobs knobs;
          knobs.max_depth = kMostScatterings;
          return c->lines->radiance(render::LightTransport::path, knobs, samples, world::hash_combine(seed, 0x9));
        };
        traced.measure = [=](uint64_t seed) { return line_errors(by_paths(seed), *truth()); };
        traced.run = [=] {
          keep(by_paths(1));
          return static_cast<double>(c->lines->size()) * samples;
        };
        settings.push_back(std::move(traced));
      }
      for (size_t i = first; i < settings.size(); ++i) {
        settings[i].problem = problem;
        settings[i].setting = problem + " " + settings[i].setting;
      }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

void add_residuals(Registry& registry) {
  Subject subject{.name = "light_model_flux_residual",
                  .question = "when may reflection be stopped?",
                  .reference = "the same 32 directions at a residual of 1e-6",
                  .metrics = line_metrics(),
                  .work_unit = "voxels"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const std::shared_ptr<LitScene> c, scene_of("cave"));
    const auto truth = [&context, c] {
      return context.shared<LineHalves>("light_model_flux_residual", [&] {
        LineHalves halves;
        halves.a = halves.b = c->lines->raycast(flux(32, 1e-6f));
        for (const world::Vec3d& v : halves.a) halves.mean += (v.x + v.y + v.z) / (3.0 * double(halves.a.size()));
        return std::make_shared<LineHalves>(std::move(halves));
      });
    };
    std::vector<Setting> settings;
    for (const float residual : {0.3f, 0.1f, 0.03f, 0.01f, 0.003f, 0.001f}) {
      settings.push_back(
          setting(c, "residual", static_cast<int>(std::lround(1 / residual)), flux(32, residual), truth));
      settings.back().is_default = residual == RenderKnobs{}.flux_residual;
    }
    return settings;
  };
  registry.add(std::move(subject));
}

void add_lamp_points(Registry& registry) {
  Subject subject{.name = "light_model_flux_lamp_points",
                  .question = "from how many points of a lamp must surfaces be lit?",
                  .reference = kPathTraced,
                  .metrics = line_metrics(),
                  .work_unit = "voxels"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const std::shared_ptr<LitScene> c, scene_of("cornell_voxels"));
    std::vector<Setting> settings;
    for (const int points : {0, 1, 4, 16}) {
      RenderKnobs knobs = flux(32, 0.01f);
      knobs.flux_lamp_points = points;
      settings.push_back(setting(c, "points", points, knobs, path_traced(context, c, "cornell_voxels")));
      settings.back().is_default = points == RenderKnobs{}.flux_lamp_points;
    }
    return settings;
  };
  registry.add(std::move(subject));
}

void add_interpolations(Registry& registry) {
  Subject subject{.name = "light_model_interpolation",
                  .question = "what does light that varies over a face add?",
                  .reference = kPathTraced,
                  .metrics = line_metrics(),
                  .work_unit = "points"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const std::shared_ptr<LitScene> c, scene_of("cave"));
    std::vector<Setting> settings;
    for (const LightInterpolation how :
         {LightInterpolation::face, LightInterpolation::vertex, LightInterpolation::linear}) {
      RenderKnobs knobs = flux(128, 0.01f);
      knobs.light_interpolation = how;
      Setting s = setting(c, std::string(knob_choices(how)[static_cast<size_t>(how)]), 0, knobs,
                          path_traced(context, c, "cave"));
      s.is_default = how == RenderKnobs{}.light_interpolation;
      // The picture alone: the light is the same for all.
      const auto light = std::make_shared<LightOfWorld>();
      const auto made = light->follow(c->lines->world(), c->lines->camera().position, knobs);
      if (!made.ok()) return made.error();
      s.run = [c, knobs, light, made = *made] {
        c->raycast->light = made;
        keep(c->lines->picture(*c->raycast, knobs));
        return static_cast<double>(c->lines->size());
      };
      settings.push_back(std::move(s));
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace

void add_subject_light_model(Registry& registry) {
  add_models(registry);
  add_residuals(registry);
  add_lamp_points(registry);
  add_interpolations(registry);
}

}  // namespace tools
