/// How far textures tilt the normals that the sun meets: the knob normal_detail, from flat faces to slopes of 2, on
/// 320x180 of the valley. How bumpy a block is is a matter of taste, so nothing is the truth: errors say how far the
/// picture moves from that of flat faces, and times what the tilt costs.
#include <fmt/format.h>

#include "tools/bench/screen_pictures.h"

namespace tools {

void add_subject_normal_detail(Registry& registry) {
  Subject subject{.question = "what do tilted normals cost, and how far do they move the picture?",
                  .reference = "the same picture with flat faces, of which the others are no approximation",
                  .metrics = {"RMS change (relative)", "FLIP"},
                  .work_unit = "pixels",
                  .knob_unit = "thousandths of slope",
                  .threads = 0};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const world::World* valley, context.world("valley"));
    constexpr int kWidth = 320, kHeight = 180;
    std::vector<Setting> settings;
    for (const std::string backend : {"raster", "raycast"}) {
      TRY(const auto flat, ScreenPictures::make(*valley, backend, kWidth, kHeight));
      for (const int thousandths : {0, 100, 500, 2000}) {
        TRY(const auto maker, ScreenPictures::make(*valley, backend, kWidth, kHeight));
        render::RenderKnobs knobs;
        knobs.normal_detail = static_cast<float>(thousandths) / 1000;
        Setting s{.method = backend, .setting = fmt::format("{}@{}", backend, thousandths), .problem = backend};
        s.knob = thousandths, s.is_default = knobs.normal_detail == render::RenderKnobs{}.normal_detail;
        s.measure = [=, &context](uint64_t) {
          const auto before = context.shared<render::Image>("normal_detail " + backend, [&] {
            render::RenderKnobs none;
            none.normal_detail = 0;
            return std::make_shared<render::Image>(flat->frame(none).image);
          });
          return picture_error(maker->frame(knobs).image, *before);
        };
        s.run = [=] {
          keep(maker->frame(knobs).image.pixels.size());
          return static_cast<double>(kWidth * kHeight);
        };
        settings.push_back(std::move(s));
      }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
