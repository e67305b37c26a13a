/// From which density on voxels are drawn as a surface: the knob contour_iso, on a lumpy cloud as a world's density
/// layer, 320x180, by triangles and by rays; at 0 as cubes. Which density is a surface is a matter of taste: errors say
/// how far the picture moves from that at half the density of the cloud's middle, and times what each surface costs.
/// Times are of pictures after the first, in which the surface was made.
#include <fmt/format.h>

#include "tools/bench/cloud_field.h"
#include "tools/bench/screen_pictures.h"

namespace tools {

namespace {

std::shared_ptr<world::World> cloud_layer() {
  auto w = std::make_shared<world::World>(world::standard_blocks());
  world::FloatLayer& density = w->store.make_layer(world::Layer::density);
  const world::BlockId plaster = *w->palette->find("plaster");
  world::EditBatch batch;
  constexpr int kEdge = kCloudLeaves * world::kLeafSize;
  for (int x = 0; x < kEdge; ++x)
    for (int y = 0; y < kEdge; ++y)
      for (int z = 0; z < kEdge; ++z)
        if (const float value = cloud_density({x, y, z}); value > 0) {
          density.set({x, y, z}, value);
          batch.set({x, y, z}, plaster);
        }
  CHECK(w->store.apply(batch).ok());
  world::CameraPlacement camera;
  camera.position = world::WorldPoint::from(-32, 40, 70);
  camera.forward = glm::normalize(world::Vec3d(1, -0.3, -0.83));
  w->cameras.push_back(camera);
  return w;
}

render::RenderKnobs knobs_of(int thousandths) {
  render::RenderKnobs knobs;
  knobs.contours = render::ContourShape::field;
  knobs.contour_iso = static_cast<float>(thousandths) / 1000;
  return knobs;
}

}  // namespace

void add_subject_contour_iso(Registry& registry) {
  Subject subject{.question = "what does the surface of a density cost, and how far does the threshold move it?",
                  .reference = "the same picture at a density of 0.5, of which the others are no approximation",
                  .metrics = {"RMS change (relative)", "FLIP"},
                  .work_unit = "pixels",
                  .knob_unit = "thousandths of density",
                  .threads = 0};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    constexpr int kWidth = 320, kHeight = 180;
    const auto world = context.shared<world::World>("contour_iso world", cloud_layer);
    std::vector<Setting> settings;
    for (const std::string backend : {"raster", "raycast"}) {
      TRY(const auto middle, ScreenPictures::make(*world, backend, kWidth, kHeight));
      for (const int thousandths : {0, 50, 200, 500, 800}) {
        TRY(const auto maker, ScreenPictures::make(*world, backend, kWidth, kHeight));
        const render::RenderKnobs knobs = knobs_of(thousandths);
        Setting s{.method = backend, .setting = fmt::format("{}@{}", backend, thousandths), .problem = backend};
        if (thousandths == 0) s.problem += " cubes";  // a surface is no rung of them
        s.knob = thousandths, s.is_default = knobs.contour_iso == render::RenderKnobs{}.contour_iso;
        s.measure = [=, &context](uint64_t) {
          const auto between = context.shared<render::Image>("contour_iso " + backend, [&] {
            return std::make_shared<render::Image>(middle->frame(knobs_of(500)).image);
          });
          return picture_error(maker->frame(knobs).image, *between);
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
