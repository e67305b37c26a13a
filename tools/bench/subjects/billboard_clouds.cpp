/// What billboard clouds of trees spoil and save: billboard_error_px of 0 to 8.
///
/// The valley, whole, 640x360, from its camera "far", its textures and the sun's shadow on, the level of voxels
/// everywhere: of coarser levels there are no trees. The reference is what faces show, which is what clouds come to
/// where the knob is small. Times are of pictures whose clouds are made.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/backend.h"
#include "tools/bench/screen_pictures.h"
#include "tools/picture.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

constexpr int kWidth = 640, kHeight = 360;

}  // namespace

void add_subject_billboard_clouds(Registry& registry) {
  Subject subject{.question = "what do a few planes for each far tree spoil, and what do they save?",
                  .reference = "the faces of those trees",
                  .metrics = {"RMS error of radiance (relative)", "mean FLIP"},
                  .work_unit = "pictures",
                  .knob_unit = "quarters of a pixel",
                  .threads = 2};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    TRY(const world::World* valley, context.world("valley"));
    TRY(const world::CameraPlacement far, world::camera_of(*valley, "far"));
    const std::shared_ptr<const world::World> shared(std::shared_ptr<void>(), valley);
    const auto view = [&](int quarters) {
      render::RenderKnobs knobs;
      knobs.billboard_error_px = static_cast<float>(quarters) / 4;
      knobs.lod_error_px = 0;
      return std::make_shared<SettledView>(shared, render::Camera::from(far), knobs, kWidth, kHeight);
    };
    const auto faces = view(0);
    for (const int quarters : {0, 2, 4, 8, 16, 32}) {
      if (context.quick() && quarters == 2) continue;
      const auto drawn = quarters == 0 ? faces : view(quarters);
      const char* const method = quarters == 0 ? "faces" : "clouds";
      Setting s{.method = method, .setting = fmt::format("{}@{}", method, quarters), .problem = "valley"};
      s.knob = quarters, s.is_default = quarters == std::lround(4 * render::RenderKnobs{}.billboard_error_px);
      s.measure = [=, &context](uint64_t) {
        const auto truth = context.shared<render::Image>(
            "billboard_clouds", [&] { return std::make_shared<render::Image>(faces->draw()); });
        return picture_error(drawn->draw(), *truth);
      };
      s.run = [drawn] {
        keep(drawn->draw().pixels.size());
        return 1.0;
      };
      settings.push_back(std::move(s));
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
