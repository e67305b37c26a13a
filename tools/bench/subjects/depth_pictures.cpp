/// What the rasterizer's depth format spoils and costs: the valley, whole, 640x360 from its first camera, with
/// depth_format of 16, 24 and 32 bits, without coarser levels. Subject depth_format has the distances alone.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/backend.h"
#include "tools/bench/screen_pictures.h"
#include "tools/picture.h"

namespace tools {

namespace {
constexpr int kWidth = 640, kHeight = 360;
}

void add_subject_depth_pictures(Registry& registry) {
  Subject subject{.question = "what does a coarse depth buffer show wrong, and what does it save?",
                  .reference = "the same picture by rays",
                  .metrics = {"RMS error of radiance (relative)", "mean FLIP"},
                  .work_unit = "pictures",
                  .knob_unit = "bits",
                  .threads = 2};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    TRY(const world::World* valley, context.world("valley"));
    TRY(const world::CameraPlacement first, world::camera_of(*valley, ""));
    const render::Camera camera = render::Camera::from(first);
    render::RenderKnobs knobs;
    knobs.lod_error_px = 0;
    for (const render::DepthFormat format :
         {render::DepthFormat::d16, render::DepthFormat::d24, render::DepthFormat::d32}) {
      knobs.depth_format = format;
      Setting s{.method = "raster", .setting = fmt::format("raster@{}", 16 + 8 * static_cast<int>(format))};
      s.knob = 16 + 8 * static_cast<int>(format);
      s.is_default = format == render::RenderKnobs{}.depth_format;
      TRY(const std::shared_ptr<render::Backend> backend, make_backend("raster"));
      const auto draw = [=] {
        auto frame = backend->render(world::WorldView(*valley), camera, knobs, kWidth, kHeight);
        return frame.ok() ? std::move(frame->image) : render::Image();
      };
      s.measure = [=, &context](uint64_t) {
        const auto truth = context.shared<render::Image>("depth_pictures", [&] {
          auto rays = make_backend("raycast");
          CHECK(rays.ok());
          auto frame = (*rays)->render(world::WorldView(*valley), camera, knobs, kWidth, kHeight);
          CHECK(frame.ok());
          return std::make_shared<render::Image>(std::move(frame->image));
        });
        return picture_error(draw(), *truth);
      };
      s.run = [=] {
        keep(draw().pixels.size());
        return 1.0;
      };
      settings.push_back(std::move(s));
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
