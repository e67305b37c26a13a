/// How many photons a picture by them needs, and from how far they may count: the knobs photons and photon_radius, on
/// the scene of caustics, 4 samples a pixel. Errors as in tools/bench/path_pictures.h; a radius that is too large
/// blurs, which is bias, and one too small leaves noise.
#include <cmath>

#include <fmt/format.h>

#include "tools/bench/path_pictures.h"

namespace tools {

void add_subject_photons(Registry& registry) {
  Subject subject{.question = "how many photons does a picture need, and from how far may they count?",
                  .reference = "path tracing, two independent halves of 2048 samples a pixel (quick: 512)",
                  .metrics = path_metrics(),
                  .work_unit = "photons",
                  .knob_unit = "photons a sample"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    TRY(const world::World* world, context.world("caustics"));
    TRY(const std::shared_ptr<const PathStage> stage, path_stage(context, *world));
    for (const float radius : {1.0f, 0.5f, 0.25f})
      for (const int photons : {5000, 20000, 100000}) {
        render::RenderKnobs knobs = stage->knobs;
        const std::string method = fmt::format("{} m", radius);
        Setting s{.method = method, .setting = fmt::format("{}@{}", method, photons)};
        s.knob = photons, s.is_default = photons == knobs.photons && radius == knobs.photon_radius;
        knobs.light_transport = render::LightTransport::photons, knobs.spp = 4;
        knobs.photons = photons, knobs.photon_radius = radius;
        s.measure = [=, &context](uint64_t seed) {
          const auto halves = context.shared<PictureHalves>(
              "photons", [&] { return picture_halves(*stage, stage->knobs, context.seed()); });
          return path_errors(*stage, *halves, knobs, seed);
        };
        s.run = [=] {
          if (!path_picture(*stage, knobs, 1)) return std::nan("");
          return static_cast<double>(photons) * knobs.spp;
        };
        settings.push_back(std::move(s));
      }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
