/// The lobe of glossy surfaces in pictures by the reference: the knob gloss_lobe, on metals under the sun and the sky,
/// 64 samples a pixel. The lobe with Fresnel's rise is the reference, as in subject bsdf_simplification, which has them
/// without other light: its own error is noise, and that of the others what they give too much or too little.
/// Errors as in tools/bench/path_pictures.h.
#include <cmath>

#include <fmt/format.h>

#include "tools/bench/metal_yard.h"
#include "tools/bench/path_pictures.h"

namespace tools {

void add_subject_gloss_lobe(Registry& registry) {
  Subject subject{.question = "how far off are pictures by simpler lobes, and do those save time?",
                  .reference = "the lobe with Fresnel's rise, two halves of 2048 samples a pixel (quick: 512)",
                  .metrics = path_metrics(),
                  .work_unit = "camera samples"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    const auto world = context.shared<world::World>("metal_yard", metal_yard);
    TRY(const std::shared_ptr<const PathStage> stage, path_stage(context, *world));
    for (const render::GlossLobe lobe :
         {render::GlossLobe::published, render::GlossLobe::exact, render::GlossLobe::fresnel}) {
      const std::string method(knob_choices(lobe)[static_cast<size_t>(lobe)]);
      Setting s{.method = method, .setting = method};
      render::RenderKnobs knobs = stage->knobs;
      s.is_default = lobe == knobs.gloss_lobe;
      knobs.gloss_lobe = lobe, knobs.spp = 64;
      s.measure = [=, &context](uint64_t seed) {
        const auto halves = context.shared<PictureHalves>("gloss_lobe", [&] {
          render::RenderKnobs reference = stage->knobs;
          reference.gloss_lobe = render::GlossLobe::fresnel;
          return picture_halves(*stage, reference, context.seed());
        });
        return path_errors(*stage, *halves, knobs, seed);
      };
      s.run = [=] {
        if (!path_picture(*stage, knobs, 1)) return std::nan("");
        return static_cast<double>(stage->width * stage->height * knobs.spp);
      };
      settings.push_back(std::move(s));
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
