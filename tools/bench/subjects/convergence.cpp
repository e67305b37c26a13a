/// How fast pictures by the reference come near the truth: 1 to 64 samples a pixel, independent (random) or stratified
/// (sobol), of each scene of light. Errors as in tools/bench/path_pictures.h. Independent samples must show 1/sqrt(N),
/// slope -1/2.
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "tools/bench/path_pictures.h"

namespace tools {

using render::SampleSequence;

void add_subject_convergence(Registry& registry) {
  static constexpr std::array kScenes{"cornell", "nightclub", "furnace", "caustics", "fog_volumes", "gobo"};
  Subject subject{.question = "how many samples a pixel does a picture by the reference need?",
                  .reference = "path tracing itself, two independent halves of 2048 samples a pixel (quick: 512)",
                  .metrics = path_metrics(),
                  .work_unit = "camera samples",
                  .knob_unit = "samples a pixel"};
  for (const char* scene : kScenes) subject.expected_slopes[fmt::format("{} random", scene)] = {-0.5, 1};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    for (const char* scene : kScenes) {
      TRY(const world::World* world, context.world(scene));
      TRY(const std::shared_ptr<const PathStage> stage, path_stage(context, *world));
      for (const auto& [sequence, name] :
           {std::pair{SampleSequence::random, "random"}, {SampleSequence::sobol, "sobol"}})
        for (const int spp : {1, 4, 16, 64}) {
          const std::string method = fmt::format("{} {}", scene, name);
          Setting s{.method = method, .setting = fmt::format("{}@{}", method, spp), .problem = scene};
          s.knob = spp;
          s.is_default = sequence == SampleSequence::sobol && spp == 64;
          render::RenderKnobs knobs = stage->knobs;
          knobs.spp = spp, knobs.sample_sequence = sequence;
          // The halves are made when the first error is asked for, and serve all settings of the scene.
          s.measure = [=, &context](uint64_t seed) {
            const auto halves = context.shared<PictureHalves>(
                fmt::format("convergence {}", scene), [&] { return picture_halves(*stage, knobs, context.seed()); });
            return path_errors(*stage, *halves, knobs, seed);
          };
          s.run = [=] {
            if (!path_picture(*stage, knobs, 1)) return std::nan("");
            return static_cast<double>(stage->width * stage->height * spp);
          };
          settings.push_back(std::move(s));
        }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
