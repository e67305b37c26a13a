/// How many places clouds have to be asked at: the knobs cloud_steps and cloud_light_steps, on 320x180 of a sky half
/// full of clouds over flat land, by the rasterizer and by the ray caster. Nothing else differs: light of surfaces is
/// the same in all settings.
#include <fmt/format.h>

#include "tools/bench/screen_pictures.h"
#include "tools/bench/world_fill.h"

namespace tools {

namespace {

constexpr int kWidth = 320, kHeight = 180;

std::shared_ptr<world::World> clouded_land() {
  auto land = std::make_shared<world::World>(world::standard_blocks());
  fill_block(*land, {{-256, 0, -256}, {255, 3, 255}}, "grass");
  land->environment.clouds.cover = 0.5f;
  world::CameraPlacement camera;
  camera.name = "sky";
  camera.position = world::WorldPoint::from(0.5, 30.5, 0.5);
  camera.forward = glm::normalize(world::Vec3d(0.45, 0.3, -1));
  camera.vertical_fov_deg = 60;
  land->cameras = {camera};
  return land;
}

}  // namespace

void add_subject_clouds(Registry& registry) {
  Subject subject{.question = "at how many places have clouds to be asked for their density, and how many shade each?",
                  .reference =
                      "256 places along each ray, 32 from each towards the sun, by the ray caster, the mean "
                      "over 4x4 points of each pixel (quick: 2x2)",
                  .metrics = {"RMS error (relative)", "FLIP"},
                  .work_unit = "pictures",
                  .knob_unit = "places along a ray",
                  .threads = 0};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    const std::shared_ptr<world::World> land = clouded_land();
    TRY(const auto rays, ScreenPictures::make(*land, "raycast", kWidth, kHeight));
    const int side = context.quick() ? 2 : 4;
    const auto truth = [=, &context] {
      return context.shared<render::Image>("clouds", [&] {
        render::RenderKnobs knobs;
        knobs.cloud_steps = 256, knobs.cloud_light_steps = 32;
        return std::make_shared<render::Image>(rays->supersampled(knobs, side));
      });
    };
    std::vector<Setting> settings;
    for (const std::string backend : {"raster", "raycast"}) {
      TRY(const auto maker, ScreenPictures::make(*land, backend, kWidth, kHeight));
      for (const auto& [steps, light_steps] : {std::pair{0, 0},
                                               {1, 0},
                                               {1, 1},
                                               {4, 1},
                                               {4, 2},
                                               {8, 0},
                                               {8, 1},
                                               {8, 2},
                                               {8, 4},
                                               {16, 2},
                                               {16, 4},
                                               {32, 4},
                                               {64, 4},
                                               {64, 16}}) {
        render::RenderKnobs knobs;
        knobs.cloud_steps = steps, knobs.cloud_light_steps = light_steps;
        Setting s{.method = fmt::format("{} light {}", backend, light_steps),
                  .setting = fmt::format("{} light {}@{}", backend, light_steps, steps),
                  .problem = backend};
        s.knob = steps;
        const render::RenderKnobs usual;
        s.is_default = steps == usual.cloud_steps && light_steps == usual.cloud_light_steps;
        // `land` lives as long as what draws it.
        s.measure = [=](uint64_t) { return picture_error(maker->frame(knobs).image, *truth()); };
        s.run = [=, kept = land] {
          keep(maker->frame(knobs).image.pixels.size());
          return 1.0;
        };
        settings.push_back(std::move(s));
      }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
