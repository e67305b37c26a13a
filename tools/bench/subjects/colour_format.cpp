/// What a finished picture is stored in between the device and the program: the knob colour_format, on 640x360 of the
/// valley by the rasterizer.
#include <fmt/format.h>

#include "render/image/framebuffer.h"
#include "tools/bench/screen_pictures.h"

namespace tools {

void add_subject_colour_format(Registry& registry) {
  Subject subject{.question = "how many bits does the colour of a finished picture need?",
                  .reference = "the same picture in three floats",
                  .metrics = {"RMS error (relative)", "FLIP"},
                  .work_unit = "bytes",
                  .knob_unit = "bytes a pixel",
                  .threads = 0};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const world::World* valley, context.world("valley"));
    constexpr int kWidth = 640, kHeight = 360;
    TRY(const auto plain, ScreenPictures::make(*valley, "raster", kWidth, kHeight));
    const auto truth = [=, &context] {
      return context.shared<render::Image>("colour_format",
                                           [&] { return std::make_shared<render::Image>(plain->frame({}).image); });
    };
    std::vector<Setting> settings;
    for (uint8_t f = 0; f <= static_cast<uint8_t>(render::ColourFormat::rgb565); ++f) {
      render::RenderKnobs knobs;
      knobs.colour_format = static_cast<render::ColourFormat>(f);
      // A rasterizer each: runs take turns, and another format makes images anew.
      TRY(const auto maker, ScreenPictures::make(*valley, "raster", kWidth, kHeight));
      const render::PixelFormatInfo& format = render::info_of(static_cast<render::PixelFormat>(f));
      Setting s{.method = std::string(format.name), .setting = fmt::format("{}@{}", format.name, format.bytes)};
      s.knob = static_cast<double>(format.bytes);
      s.is_default = knobs.colour_format == render::RenderKnobs{}.colour_format;
      s.measure = [=](uint64_t) { return picture_error(maker->frame(knobs).image, *truth()); };
      s.run = [=] {
        keep(maker->frame(knobs).image.pixels.size());
        return static_cast<double>(format.bytes) * kWidth * kHeight;
      };
      settings.push_back(std::move(s));
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
