/// What blocks scatter glossily, in direct light without luminaires: as matte, or as the lobe of the sun (the knob
/// direct_gloss). Metals under the sun and the sky, 192x108, by the rasterizer and by rays. What surfaces mirror of
/// each other is missing in both, so the error has a floor.
#include <fmt/format.h>

#include "tools/bench/metal_yard.h"
#include "tools/bench/screen_pictures.h"

namespace tools {

void add_subject_direct_gloss(Registry& registry) {
  Subject subject{.question = "what does the highlight of the sun cost, and how much nearer is it to the truth?",
                  .reference = "path tracing, 1024 samples a pixel (quick: 64)",
                  .metrics = {"RMS error (relative)", "FLIP"},
                  .work_unit = "pixels",
                  .threads = 0};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    constexpr int kWidth = 192, kHeight = 108;
    const auto world = context.shared<world::World>("metal_yard", metal_yard);
    TRY(const auto rays, ScreenPictures::make(*world, "raycast", kWidth, kHeight));
    const int samples = context.quick() ? 64 : 1024;
    const auto truth = [=, &context] {
      return context.shared<render::Image>("direct_gloss", [&] {
        render::RenderKnobs paths;
        paths.light_transport = render::LightTransport::path, paths.spp = samples;
        return std::make_shared<render::Image>(rays->frame(paths).image);
      });
    };
    std::vector<Setting> settings;
    for (const std::string backend : {"raster", "raycast"})
      for (const render::DirectGloss gloss : {render::DirectGloss::matte, render::DirectGloss::lobe}) {
        TRY(const auto maker, ScreenPictures::make(*world, backend, kWidth, kHeight));
        render::RenderKnobs knobs;
        const std::string method = fmt::format("{} {}", backend, knob_choices(gloss)[static_cast<size_t>(gloss)]);
        // Backends are no rungs of this knob: each has a front of its own.
        Setting s{.method = method, .setting = method, .problem = backend};
        s.is_default = gloss == knobs.direct_gloss;
        knobs.direct_gloss = gloss;
        s.measure = [=](uint64_t) { return picture_error(maker->frame(knobs).image, *truth()); };
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
