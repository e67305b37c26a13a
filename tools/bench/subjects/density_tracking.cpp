/// How paths of the reference find where light scatters in a density grid: the knob density_tracking, on a lumpy cloud
/// under the sun and the sky, at 1 to 64 independent samples a pixel. Errors as in tools/bench/path_pictures.h; both
/// ways are right in the mean, and must show 1/sqrt(N), slope -1/2.
#include <cmath>

#include <fmt/format.h>

#include "tools/bench/cloud_field.h"
#include "tools/bench/path_pictures.h"

namespace tools {

namespace {

std::shared_ptr<world::World> cloud_over_grass() {
  auto w = std::make_shared<world::World>(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-64, 0, -64}, {63, 0, 63}}, *w->palette->find("grass"));
  CHECK(w->store.apply(batch).ok());
  world::Medium cloud;
  cloud.name = "cloud", cloud.kind = "density_grid", cloud.position = world::WorldPoint::from(-24, 4, -24);
  cloud.scattering = {0.2f, 0.2f, 0.2f}, cloud.anisotropy = 0.6f;
  auto field = cloud_field();
  CHECK(field.ok());
  cloud.field = std::move(*field);
  w->media.push_back(std::move(cloud));
  world::CameraPlacement camera;
  camera.position = world::WorldPoint::from(-45, 20, 40);
  camera.forward = glm::normalize(world::Vec3d(1, 0.1, -0.9));
  w->cameras.push_back(camera);
  return w;
}

}  // namespace

void add_subject_density_tracking(Registry& registry) {
  Subject subject{.question = "which way through a density grid leaves less noise for its time?",
                  .reference = "path tracing by delta tracking, two halves of 2048 samples a pixel (quick: 512)",
                  .metrics = path_metrics(),
                  .work_unit = "camera samples",
                  .knob_unit = "samples a pixel"};
  subject.expected_slopes = {{"delta", {-0.5, 1}}, {"exact", {-0.5, 1}}};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    const auto world = context.shared<world::World>("density_tracking world", cloud_over_grass);
    TRY(const std::shared_ptr<const PathStage> stage, path_stage(context, *world));
    for (const render::DensityTracking tracking : {render::DensityTracking::delta, render::DensityTracking::exact})
      for (const int spp : {1, 4, 16, 64}) {
        const std::string method(knob_choices(tracking)[static_cast<size_t>(tracking)]);
        Setting s{.method = method, .setting = fmt::format("{}@{}", method, spp)};
        s.knob = spp;
        render::RenderKnobs knobs = stage->knobs;
        s.is_default = tracking == knobs.density_tracking && spp == 64;
        knobs.density_tracking = tracking, knobs.spp = spp, knobs.sample_sequence = render::SampleSequence::random;
        s.measure = [=, &context](uint64_t seed) {
          const auto halves = context.shared<PictureHalves>(
              "density_tracking", [&] { return picture_halves(*stage, stage->knobs, context.seed()); });
          return path_errors(*stage, *halves, knobs, seed);
        };
        s.run = [=] {
          if (!path_picture(*stage, knobs, 1)) return std::nan("");
          return static_cast<double>(stage->width * stage->height * spp);
        };
        settings.push_back(std::move(s));
      }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
