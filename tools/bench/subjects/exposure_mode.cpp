/// How well the exposure of a picture follows its light: the knob exposure_mode, on 320x180 of the valley by the
/// rasterizer at noon, at dusk and at night. The reference is the exposure at which the median of the luminance, of all
/// pixels sorted, is shown as exposure_key: half of the picture is brighter than that grey then, and half darker. What
/// pictures of the same light differ by in stops is the error; the second metric is what of the picture the display
/// can't tell from black or white.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "render/image/display.h"
#include "tools/bench/screen_pictures.h"

namespace tools {

namespace {

constexpr double kBlack = 0.5 / 255 / 12.92;  // sRGB's 8 bits show less as 0

/// Of a picture that is exposed already.
ErrorSample exposure_error(const render::Image& image) {
  if (image.pixels.empty()) return {{std::nan(""), std::nan("")}, std::nan("")};
  std::vector<double> shown;
  for (const render::Rgb& p : image.pixels)
    shown.push_back((0.2126 * p.r + 0.7152 * p.g + 0.0722 * p.b) / double{render::kWhiteRadiance});
  const auto lost = std::count_if(shown.begin(), shown.end(), [](double v) { return v < kBlack || v > 1; });
  const auto middle = shown.begin() + static_cast<std::ptrdiff_t>(shown.size() / 2);
  std::nth_element(shown.begin(), middle, shown.end());
  const double stops = std::log2(std::max(*middle, 1e-12) / double{render::RenderKnobs{}.exposure_key});
  return {{std::abs(stops), static_cast<double>(lost) / static_cast<double>(shown.size())}, stops};
}

}  // namespace

void add_subject_exposure_mode(Registry& registry) {
  Subject subject{
      .question = "how near to a middle grey does each way to expose a picture show it, by day and by night?",
      .reference = "the median of the luminance shown as exposure_key, by sorting all pixels",
      .metrics = {"stops from that", "share of pixels that are black or white"},
      .work_unit = "pixels",
      .knob_unit = "h",
      .threads = 0};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const world::World* valley, context.world("valley"));
    constexpr int kWidth = 320, kHeight = 180;
    std::vector<Setting> settings;
    for (const auto& [when, hours] : {std::pair{"noon", 12.0f}, {"dusk", 19.9f}, {"night", 23.0f}})
      for (const render::ExposureMode mode :
           {render::ExposureMode::fixed, render::ExposureMode::log_mean, render::ExposureMode::histogram}) {
        TRY(const auto maker, ScreenPictures::make(*valley, "raster", kWidth, kHeight));
        render::RenderKnobs knobs;
        const std::string method(knob_choices(mode)[static_cast<size_t>(mode)]);
        Setting s{.method = method, .setting = fmt::format("{} {}", method, when), .problem = when};
        s.knob = static_cast<double>(hours), s.is_default = mode == knobs.exposure_mode;
        knobs.exposure_mode = mode, knobs.time_of_day = hours;
        s.measure = [=](uint64_t) { return exposure_error(maker->frame(knobs).image); };
        s.run = [=] {
          keep(maker->frame(knobs).image.pixels.size());
          return static_cast<double>(kWidth * kHeight);
        };
        settings.push_back(std::move(s));
      }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
