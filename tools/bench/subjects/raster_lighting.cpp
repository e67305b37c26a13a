/// What the rasterizer's approximations of light cost and lose, each against itself at its limit.
///
/// cutoff    2000 lamps over 300 m of ground: those left out that give less than a share of the display's white
/// fog       a density grid, by equal steps of the ray
/// textures  the valley's ground: a texel, mip levels with 1 to 16 probes, or the mean over the footprint
/// sun_map   the valley's ground, its sun by one map: the mean of 1 to 5 texels a side, against a ray at each pixel
/// spot_map  a spot over pillars, by maps of 32 to 1024 texels a side, against a ray at each pixel
/// sky       the valley's ground under rays to the sky, 1 to 64 a pixel
/// fog_light fog of four shapes, and mist in the valley, without or with the light that it scatters as if nothing hid
///           it, or by rays to the sun, against paths (of the ray caster, 256 a pixel; quick: 32)
/// Pictures of 192 x 108 pixels by the device that there is; the error is RMS over the mean of the reference.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/backend.h"
#include "render/image/error_metrics.h"
#include "tools/bench/cloud_field.h"
#include "tools/bench/screen_pictures.h"
#include "tools/picture.h"
#include "world/base/random.h"

namespace tools {

namespace {

using render::RenderKnobs;

constexpr int kWidth = 192, kHeight = 108;

/// A world and its camera.
struct Shown {
  world::World world;
  render::Camera camera;

  render::Image picture(render::Backend* backend, const RenderKnobs& knobs) {
    CHECK(backend != nullptr);
    auto frame = backend->render(world::WorldView(world), camera, knobs, kWidth, kHeight);
    CHECK(frame.ok());
    return std::move(frame->image);
  }
};
using ShownWorld = std::shared_ptr<Shown>;

Result<ShownWorld> shown(const world::Scene& scene, const std::string& camera) {
  world::ImportReport report;
  TRY(world::World world, build_picture_world(scene, report));
  TRY(const world::CameraPlacement placed, world::camera_of(world, camera));
  return std::make_shared<Shown>(Shown{std::move(world), render::Camera::from(placed)});
}

/// RMS over the mean of the reference, FLIP and bias.
ErrorSample errors_of(const render::Image& a, const render::Image& b) {
  double squares = 0, sum = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    const render::Rgb d = a.pixels[i] - b.pixels[i];
    squares += double{d.r} * d.r + double{d.g} * d.g + double{d.b} * d.b;
    sum += double{b.pixels[i].r} + b.pixels[i].g + b.pixels[i].b;
  }
  const double n = 3.0 * static_cast<double>(a.pixels.size());
  const render::ErrorMetrics metrics = render::compare_images(a, b).metrics;
  return {{std::sqrt(squares / n) / (sum / n), metrics.flip}, metrics.bias};
}

void darken(world::Environment& e) {
  e.sky_zenith = e.sky_horizon = e.sky_ground = {};
  e.sun_irradiance = {};
}

Result<ShownWorld> field_of_lamps() {
  world::Scene scene;
  scene.name = "lamps", scene.generator = "empty", scene.box = {{-150, 0, -150}, {149, 7, 149}};
  darken(scene.environment);
  scene.fills.push_back({{{-150, 0, -150}, {149, 0, 149}}, "plaster"});
  for (int i = 0; i < 2000; ++i) {
    const uint64_t h = world::mix64(static_cast<uint64_t>(i) + 17);
    world::Luminaire l;
    l.name = l.kind = "omni", l.radius = 0.05f, l.power = {60, 45, 30};
    l.position = world::WorldPoint::from(static_cast<double>(h % 3000) / 10 - 150, 2 + static_cast<double>(h >> 61) / 4,
                                         static_cast<double>((h >> 24) % 3000) / 10 - 150);
    scene.luminaires.push_back(l);
  }
  world::CameraPlacement camera;
  camera.name = "above", camera.position = world::WorldPoint::from(-140, 25, 140);
  camera.forward = glm::normalize(world::Vec3d(1, -0.35, -1));
  scene.cameras.push_back(camera);
  return shown(scene, "above");
}

Result<ShownWorld> cloud_in_a_box() {
  world::Scene scene;
  scene.name = "cloud", scene.generator = "empty", scene.box = {{-40, 0, -40}, {39, 7, 39}};
  scene.fills.push_back({{{-40, 0, -40}, {39, 0, 39}}, "grass"});
  world::Medium medium;
  medium.name = "cloud", medium.kind = "density_grid", medium.position = world::WorldPoint::from(-24, 2, -24);
  medium.scattering = {0.2f, 0.2f, 0.2f}, medium.emission = {60, 60, 65};
  TRY(medium.field, cloud_field());
  scene.media.push_back(std::move(medium));
  world::CameraPlacement camera;
  camera.name = "beside", camera.position = world::WorldPoint::from(-45, 20, 40);
  camera.forward = glm::normalize(world::Vec3d(1, 0.05, -0.9));
  scene.cameras.push_back(camera);
  return shown(scene, "beside");
}

Result<ShownWorld> pillars_under_a_spot() {
  world::Scene scene;
  scene.name = "pillars", scene.generator = "empty", scene.box = {{0, 0, 0}, {31, 15, 31}};
  darken(scene.environment);
  scene.fills.push_back({{{0, 0, 0}, {31, 0, 31}}, "plaster"});
  for (const int x : {8, 15, 22})
    for (const int z : {8, 15, 22}) scene.fills.push_back({{{x, 1, z}, {x + 1, 4, z + 1}}, "brick_red"});
  world::Luminaire spot;
  spot.name = spot.kind = "spot", spot.power = {90000, 90000, 80000};
  spot.position = world::WorldPoint::from(4.5, 13.5, 5.5), spot.axis = glm::normalize(world::Vec3f(0.6f, -0.7f, 0.5f));
  spot.up = glm::normalize(world::Vec3f(0, 0.5f, 0.7f));
  spot.half_angle = 0.9f, spot.inner_half_angle = 0.6f;
  scene.luminaires.push_back(spot);
  world::CameraPlacement camera;
  camera.name = "beside", camera.position = world::WorldPoint::from(3, 14, 33);
  camera.forward = glm::normalize(world::Vec3d(0.55, -0.55, -0.8));
  scene.cameras.push_back(camera);
  return shown(scene, "beside");
}

}  // namespace

void add_subject_raster_lighting(Registry& registry) {
  Subject subject{.question = "what do the rasterizer's approximations of light lose, and what do they save?",
                  .reference = "the same picture with the knob at its limit",
                  .metrics = {"RMS error of radiance (relative)", "mean FLIP"},
                  .work_unit = "pixels"};
  subject.threads = 0;
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    if (auto device = make_backend("raster"); !device.ok()) return device.error();  // whether there is a device
    std::vector<Setting> settings;
    const auto add = [&](const std::string& problem, const std::string& method, int knob, bool is_default,
                         const ShownWorld& of, const RenderKnobs& knobs, const RenderKnobs& limit) {
      Setting s{.method = method, .setting = fmt::format("{}@{}", method, knob), .problem = problem};
      s.knob = knob, s.is_default = is_default;
      const auto backend = rasterizer_of_its_own();
      s.measure = [=, &context](uint64_t) {
        const auto truth = context.shared<render::Image>("raster_lighting " + problem, [&] {
          return std::make_shared<render::Image>(of->picture(backend(), limit));
        });
        return errors_of(of->picture(backend(), knobs), *truth);
      };
      s.run = [=] {
        keep(of->picture(backend(), knobs));
        return static_cast<double>(kWidth * kHeight);
      };
      settings.push_back(std::move(s));
    };

    TRY(const ShownWorld lamps, field_of_lamps());
    RenderKnobs knobs, limit;
    knobs.exposure = limit.exposure = 4;
    knobs.luminaire_shadow = limit.luminaire_shadow = render::LuminaireShadow::none;
    limit.luminaire_cutoff = 0;
    for (const int millionths : {10000, 1000, 100, 10}) {
      knobs.luminaire_cutoff = static_cast<float>(millionths) * 1e-6f;
      add("cutoff", "cut-off in 1e-6 of white", millionths, millionths == 100, lamps, knobs, limit);
    }
    add("cutoff", "all luminaires", 0, false, lamps, limit, limit);

    TRY(const ShownWorld cloud, cloud_in_a_box());
    limit = knobs = {};
    limit.fog_steps = 2048;
    for (const int steps : {4, 16, 64, 256}) {
      knobs.fog_steps = steps;
      add("fog", "steps", steps, steps == RenderKnobs{}.fog_steps, cloud, knobs, limit);
    }

    TRY(const world::Scene valley_scene, world::load_scene("valley"));
    TRY(const ShownWorld valley, shown(valley_scene, "ground"));
    limit = knobs = {};
    limit.textures = render::TextureFilter::exact;
    knobs.textures = render::TextureFilter::off;
    add("textures", "no textures", 0, false, valley, knobs, limit);
    knobs.textures = render::TextureFilter::point;
    add("textures", "one texel", 1, false, valley, knobs, limit);
    knobs.textures = render::TextureFilter::mip;
    for (const int probes : {1, 4, 16}) {
      knobs.texture_anisotropy = probes;
      add("textures", "mip levels", probes, probes == RenderKnobs{}.texture_anisotropy, valley, knobs, limit);
    }
    add("textures", "64 samples", 64, false, valley, limit, limit);

    limit = knobs = {};
    knobs.sun_shadow = render::SunShadow::map;
    for (const int texels : {1, 3, 5}) {
      knobs.sun_map_filter = texels;
      add("sun_map", "mean of texels a side", texels, texels == RenderKnobs{}.sun_map_filter, valley, knobs, limit);
    }

    TRY(const ShownWorld pillars, pillars_under_a_spot());
    limit = knobs = {};
    knobs.luminaire_shadow = render::LuminaireShadow::map;
    for (const int texels : {32, 128, 256, 1024}) {
      knobs.spot_map_texels = texels;
      add("spot_map", "texels a side", texels, texels == RenderKnobs{}.spot_map_texels, pillars, knobs, limit);
    }

    limit = knobs = {};
    limit.sky_rays = 256;
    add("sky", "open sky", 0, true, valley, knobs, limit);
    knobs.corner_occlusion = true;
    add("sky", "corners", 1, false, valley, knobs, limit);
    knobs.corner_occlusion = false;
    for (const int rays : {1, 4, 16, 64}) {
      knobs.sky_rays = rays;
      add("sky", "rays", rays, false, valley, knobs, limit);
    }
    return settings;
  };
  registry.add(std::move(subject));

  Subject fog{.name = "fog_light",
              .question = "how far is the light that fog scatters from what paths find?",
              .reference = "path tracing, 256 samples a pixel (quick: 32)",
              .metrics = {"RMS error of radiance (relative)", "mean FLIP"},
              .work_unit = "pixels"};
  fog.threads = 0;
  fog.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    if (auto device = make_backend("raster"); !device.ok()) return device.error();
    std::vector<Setting> settings;
    for (const std::string name : {"fog_volumes", "mist"}) {
      TRY(const world::Scene scene, world::load_scene(name));
      TRY(const ShownWorld of, shown(scene, ""));
      for (const int rays : {-1, 0, 1, 4, 16, 64}) {
        RenderKnobs knobs;
        knobs.lod_error_px = 0, knobs.fog_sun_rays = std::max(rays, 0);
        if (rays < 0) knobs.fog_light = render::FogLight::none;
        const std::string method = rays > 0 ? "rays" : rays == 0 ? "unhidden" : "none";
        Setting s{.method = name + " " + method, .setting = name + " " + method, .problem = name};
        if (rays > 0) s.setting += fmt::format("@{}", rays), s.knob = rays;
        s.is_default = rays == RenderKnobs{}.fog_sun_rays;
        const auto backend = rasterizer_of_its_own();
        const int samples = context.quick() ? 32 : 256;
        s.measure = [=, &context](uint64_t) {
          const auto truth = context.shared<render::Image>("fog_light " + name, [&] {
            RenderKnobs paths;
            paths.light_transport = render::LightTransport::path, paths.spp = samples;
            auto caster = make_backend("raycast");
            CHECK(caster.ok());
            return std::make_shared<render::Image>(of->picture(caster->get(), paths));
          });
          return errors_of(of->picture(backend(), knobs), *truth);
        };
        s.run = [=] {
          keep(of->picture(backend(), knobs));
          return static_cast<double>(kWidth * kHeight);
        };
        settings.push_back(std::move(s));
      }
    }
    return settings;
  };
  registry.add(std::move(fog));
}

}  // namespace tools
