/// What grids of heights for land that is far spoil and save: heightfield_error_px of 0 to 4.
///
/// Rolling land of 1024x1024 m without caves and trees, 640x360. The reference is what the faces show that grids stand
/// for, of the levels of lod_error_px=1; beside them, as another way to draw less, coarser levels alone. Times are of
/// pictures whose surfaces are made.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/backend.h"
#include "tools/bench/screen_pictures.h"
#include "tools/picture.h"
#include "world/world.h"

namespace tools {

namespace {

constexpr int kWidth = 640, kHeight = 360;

std::shared_ptr<world::World> rolling_land() {
  auto w = std::make_shared<world::World>(world::standard_blocks());
  world::EditBatch batch;
  const auto block = [&](const char* name) { return *w->palette->find(name); };
  const world::BlockId stone = block("stone"), grass = block("grass"), sand = block("sand");
  for (int x = -512; x < 512; ++x)
    for (int z = -512; z < 512; ++z) {
      const int top = static_cast<int>(60 + 30 * std::sin(x * 0.017) * std::cos(z * 0.013) + 9 * std::sin(z * 0.05));
      batch.fill({{x, 0, z}, {x, top - 1, z}}, stone);
      batch.set({x, top, z}, (x >> 4 ^ z >> 4) & 1 ? grass : sand);
    }
  CHECK(w->store.apply(batch).ok());
  return w;
}

}  // namespace

void add_subject_heightfields(Registry& registry) {
  Subject subject{.question = "what do grids of heights for far land spoil, and what do they save?",
                  .reference = "the faces of that land",
                  .metrics = {"RMS error of radiance (relative)", "mean FLIP"},
                  .work_unit = "pictures",
                  .knob_unit = "halves of a pixel",
                  .threads = 2};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    const auto land = context.shared<world::World>("rolling land", rolling_land);
    render::Camera eye;
    eye.position = world::WorldPoint::from(-450.3, 130.2, 3.4);
    eye.forward = glm::normalize(world::Vec3d(1, -0.2, 0.1));
    const auto view = [&](float grids_px, float levels_px) {
      render::RenderKnobs knobs;
      knobs.heightfield_error_px = grids_px;
      knobs.lod_error_px = levels_px;
      return std::make_shared<SettledView>(land, eye, knobs, kWidth, kHeight);
    };
    const auto faces = view(0, 1);
    const auto add = [&](const char* method, int halves, const std::shared_ptr<SettledView>& drawn) {
      Setting s{.method = method, .setting = fmt::format("{}@{}", method, halves), .problem = "rolling land"};
      s.knob = halves, s.is_default = drawn == faces;
      s.measure = [=, &context](uint64_t) {
        const auto truth = context.shared<render::Image>(
            "heightfields", [&] { return std::make_shared<render::Image>(faces->draw()); });
        return picture_error(drawn->draw(), *truth);
      };
      s.run = [drawn] {
        keep(drawn->draw().pixels.size());
        return 1.0;
      };
      settings.push_back(std::move(s));
    };
    add("faces", 0, faces);
    for (const int halves : {1, 2, 4, 8}) add("grids", halves, view(static_cast<float>(halves) / 2, 1));
    for (const int halves : {4, 8}) add("coarser levels", halves, view(0, static_cast<float>(halves) / 2));
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
