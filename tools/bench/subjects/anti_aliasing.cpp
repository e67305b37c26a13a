/// How many points of a pixel a picture has to look through: the knob anti_aliasing, on 320x180 of the valley as
/// drawn by the rasterizer and by the ray caster, and how near temporal comes with one a picture where nothing moves.
#include <fmt/format.h>

#include "tools/bench/screen_pictures.h"

namespace tools {

void add_subject_anti_aliasing(Registry& registry) {
  Subject subject{.question = "how many points of a pixel does a picture have to look through?",
                  .reference =
                      "a box filter over the pixel: the mean of 16x16 pictures by rays, each through another point of "
                      "it (quick: 8x8)",
                  .metrics = {"RMS error (relative)", "FLIP"},
                  .work_unit = "samples",
                  .knob_unit = "samples a pixel",
                  .threads = 0};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const world::World* valley, context.world("valley"));
    const int side = context.quick() ? 8 : 16;
    constexpr int kWidth = 320, kHeight = 180;
    TRY(const auto raycast, ScreenPictures::make(*valley, "raycast", kWidth, kHeight));
    const auto truth = [=, &context] {
      return context.shared<render::Image>(
          "anti_aliasing", [&] { return std::make_shared<render::Image>(raycast->supersampled({}, side)); });
    };
    std::vector<Setting> settings;
    for (const std::string backend : {"raster", "raycast"}) {
      TRY(const auto maker, ScreenPictures::make(*valley, backend, kWidth, kHeight));
      for (const auto anti_aliasing :
           {render::AntiAliasing::none, render::AntiAliasing::x2, render::AntiAliasing::x4, render::AntiAliasing::x8}) {
        render::RenderKnobs knobs;
        knobs.anti_aliasing = anti_aliasing;
        const int count = 1 << static_cast<int>(anti_aliasing);
        // Backends are no rungs of this knob: each has a front of its own.
        Setting s{.method = backend, .setting = fmt::format("{}@{}", backend, count), .problem = backend};
        s.knob = count;
        s.is_default = anti_aliasing == render::RenderKnobs{}.anti_aliasing;
        s.measure = [=](uint64_t) { return picture_error(maker->frame(knobs).image, *truth()); };
        s.run = [=] {
          keep(maker->frame(knobs).image.pixels.size());
          return static_cast<double>(count) * kWidth * kHeight;
        };
        settings.push_back(std::move(s));
      }
    }
    // One point in each picture, kept over pictures by a rasterizer of its own: another setting between would end that.
    TRY(const auto still, ScreenPictures::make(*valley, "raster", kWidth, kHeight));
    render::RenderKnobs temporal;
    temporal.anti_aliasing = render::AntiAliasing::temporal;
    constexpr int kPicturesKept = 8;
    Setting s{.method = "raster temporal at rest", .setting = "raster temporal at rest@1", .problem = "raster"};
    s.knob = 1;
    s.measure = [=](uint64_t) {
      for (int i = 1; i < kPicturesKept; ++i) still->frame(temporal);
      return picture_error(still->frame(temporal).image, *truth());
    };
    s.run = [=] {
      keep(still->frame(temporal).image.pixels.size());
      return static_cast<double>(kWidth) * kHeight;
    };
    settings.push_back(std::move(s));
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
