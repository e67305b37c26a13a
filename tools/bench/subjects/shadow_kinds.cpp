/// What shadows cost, and what is wrong without them, or with a point in place of a lamp of some size.
///
/// sun   128 m of the valley under the sun alone: none, where the sky's level is below 15, by a map of 1 to 8 texels a
///       metre, by four maps around the eye, or one ray a point, right to 2e-5
/// sun, near   512 m of it from before a cabin, by the same maps: what lies near takes most of the picture
/// lamp  a square lamp 4 m wide, 12 m above a floor with pillars: an omni of its radiant intensity along its axis,
///       without shadows and with them; the lamp itself with 1 to 64 samples a point
/// One point for each of 48 x 32 pixels; light scatters once. The reference is path tracing, which samples the lamp by
/// solid angle, and meets nothing of it by chance.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"
#include "tools/bench/sight_lines.h"
#include "world/base/random.h"

namespace tools {

namespace {

using render::RenderKnobs;
using render::SunShadow;
using Lines = std::shared_ptr<const SightLines>;

constexpr int kWidth = 48, kHeight = 32;
constexpr float kLampEdge = 4;  // m
constexpr float kLampRadiance = 100;

void darken(world::Environment& e) { e.sky_zenith = e.sky_horizon = e.sky_ground = {}; }

Result<Lines> sunlit_valley(bool near) {
  TRY(world::Scene scene, world::load_scene("valley"));
  if (near) {
    scene.box = {{-128, 0, -256}, {383, 255, 255}};
    std::erase_if(scene.cameras, [](const world::CameraPlacement& c) { return c.name != "ground"; });
    CHECK(scene.cameras.size() == 1);
    // Away from the cabin, whose lamps the others' light lacks.
    scene.cameras[0].position = world::WorldPoint::from(64.5, 72.5, -50.5);
    scene.cameras[0].forward = glm::normalize(world::Vec3d(25.5, -1.5, 25.5));
  } else {
    scene.box = {{128, 0, -256}, {255, 255, -129}};
    scene.cameras.clear();  // the whole crop, from the south-east
  }
  darken(scene.environment);
  return SightLines::make(scene, kWidth, kHeight);
}

enum class Lamp { rectangle, omni, omni_without_shadows };

Result<Lines> pillars_under(Lamp lamp) {
  world::Scene scene;
  scene.name = "pillars", scene.generator = "empty";
  scene.box = {{0, 0, 0}, {31, 15, 31}};
  darken(scene.environment);
  scene.environment.sun_irradiance = {};
  scene.fills.push_back({{{0, 0, 0}, {31, 0, 31}}, "plaster"});
  for (const int x : {8, 15, 22})
    for (const int z : {8, 15, 22}) scene.fills.push_back({{{x, 1, z}, {x + 1, 4, z + 1}}, "brick_red"});
  world::Luminaire l;
  l.name = "lamp", l.position = world::WorldPoint::from(16, 13, 16), l.visible = false;
  if (lamp == Lamp::rectangle) {
    l.kind = "rectangle", l.extent = {kLampEdge, kLampEdge};
    l.radiance = {kLampRadiance, kLampRadiance, kLampRadiance};
  } else {
    const float power = 4 * 3.14159265f * kLampRadiance * kLampEdge * kLampEdge;
    l.kind = "omni", l.radius = 0.01f, l.power = {power, power, power};
    l.shadows = lamp == Lamp::omni;
  }
  scene.luminaires.push_back(l);
  world::CameraPlacement camera;
  camera.name = "above", camera.position = world::WorldPoint::from(16, 22, 44);
  camera.forward = glm::normalize(world::Vec3d(0, -20, -27));
  camera.vertical_fov_deg = 45;
  scene.cameras.push_back(camera);
  return SightLines::make(scene, kWidth, kHeight);
}

}  // namespace

void add_subject_shadow_kinds(Registry& registry) {
  Subject subject{.question = "what is a shadow worth, and how many samples does a soft one need?",
                  .reference = "path tracing, two independent halves of 4096 samples a point (quick: 512)",
                  .metrics = line_metrics(),
                  .work_unit = "points"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    const int samples = context.quick() ? 512 : 4096;
    const auto add = [&](const std::string& method, const std::string& problem, int knob, bool is_default,
                         const Lines& lines, const Lines& right, const RenderKnobs& knobs) {
      Setting s{.method = method,
                .setting = fmt::format("{}@{}{}", method, knob, problem == "sun near" ? " near" : ""),
                .problem = problem};
      s.knob = knob, s.is_default = is_default, s.stochastic = method == "rectangle";
      s.measure = [=, &context](uint64_t seed) {
        const auto truth = context.shared<LineHalves>("shadow_kinds " + problem, [&] {
          return std::make_shared<LineHalves>(line_halves(*right, RenderKnobs{}, 1, samples, context.seed()));
        });
        const auto seen = lines->radiance(render::LightTransport::direct, knobs, 1, world::hash_combine(seed, 1));
        return line_errors(seen, *truth);
      };
      s.run = [=] {
        keep(lines->radiance(render::LightTransport::direct, knobs, 1, 1));
        return static_cast<double>(lines->size());
      };
      settings.push_back(std::move(s));
    };
    RenderKnobs knobs;
    for (const bool near : {false, true}) {
      const std::string problem = near ? "sun near" : "sun";
      TRY(const Lines valley, sunlit_valley(near));
      knobs.sun_shadow = SunShadow::none;
      add("sun without shadow", problem, 0, false, valley, valley, knobs);
      knobs.sun_shadow = SunShadow::ray;
      add("sun with a ray", problem, 1, true, valley, valley, knobs);
      // By what backends draw.
      const auto add_drawn = [&](const std::string& method, int knob, const RenderKnobs& drawn) {
        Setting s{
            .method = method, .setting = fmt::format("{}@{}{}", method, knob, near ? " near" : ""), .problem = problem};
        s.knob = knob;
        s.measure = [=, &context](uint64_t) {
          const auto truth = context.shared<LineHalves>("shadow_kinds " + problem, [&] {
            return std::make_shared<LineHalves>(line_halves(*valley, RenderKnobs{}, 1, samples, context.seed()));
          });
          const auto seen = valley->raycast(drawn);
          return line_errors(seen, *truth);
        };
        s.run = [=] {
          keep(valley->raycast(drawn));
          return static_cast<double>(valley->size());
        };
        settings.push_back(std::move(s));
      };
      RenderKnobs drawn;
      if (!near) {
        drawn.light_model = render::LightModel::flood4, drawn.sun_shadow = SunShadow::sky_light;
        add_drawn("sun by the sky's level", 0, drawn);
        drawn.light_model = render::LightModel::none;
      }
      drawn.sun_shadow = SunShadow::map;
      for (const int texels_a_metre : {1, 2, 4, 8}) {
        if (near && texels_a_metre > 4) continue;  // more than there may be
        drawn.sun_map_texel = 1.0f / static_cast<float>(texels_a_metre);
        add_drawn("sun by a map", texels_a_metre, drawn);
      }
      drawn.sun_map_cascades = 4;
      for (const int texels : {256, 512, 1024}) {
        drawn.sun_cascade_texels = texels;
        add_drawn("sun by 4 cascades", texels, drawn);
      }
      drawn.sun_cascade_texels = 512, drawn.sun_map_split = 0;
      add_drawn("sun by 4 even cascades", 512, drawn);
      drawn.sun_map_split = 1;
      add_drawn("sun by 4 cascades of equal ratio", 512, drawn);
    }

    TRY(const Lines right, pillars_under(Lamp::rectangle));
    TRY(const Lines omni, pillars_under(Lamp::omni));
    TRY(const Lines unshadowed, pillars_under(Lamp::omni_without_shadows));
    add("omni without shadows", "lamp", 0, false, unshadowed, right, knobs);
    add("omni", "lamp", 1, false, omni, right, knobs);
    for (const int lamp_samples : {1, 4, 16, 64}) {
      RenderKnobs of_lamp;
      of_lamp.light_samples = lamp_samples;
      add("rectangle", "lamp", lamp_samples, lamp_samples == RenderKnobs{}.light_samples, right, right, of_lamp);
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
