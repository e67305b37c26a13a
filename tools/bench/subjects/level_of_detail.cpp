/// What coarser levels far away, and simpler shapes for blocks that are no cubes, cost and spoil: pictures by the
/// rasterizer.
///
/// levels  the valley, whole, 640x360 from its first camera: lod_error_px of 0 to 16
/// shapes  a meadow of 20,000 plants and fences: as cubes, as two crossed sheets each, as they are; the last also
///         without points for what is small
/// Times are of whole pictures after the first, in which all was made. Far voxels are smaller than pixels: errors are
/// against what a pixel sees in the mean, since a picture through the middles of pixels is as far from that without
/// coarser levels (knob 0).
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/backend.h"
#include "tools/bench/screen_pictures.h"
#include "tools/picture.h"
#include "world/base/random.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

constexpr int kWidth = 640, kHeight = 360;

std::shared_ptr<world::World> meadow() {
  auto w = std::make_shared<world::World>(world::standard_blocks());
  world::EditBatch batch;
  const auto block = [&](const char* name) { return *w->palette->find(name); };
  batch.fill({{-128, -1, -128}, {127, -1, 127}}, block("grass"));
  const world::BlockId plants[] = {block("tall_grass"), block("flower_red"), block("reed"), block("fern")};
  for (int x = -128; x < 128; ++x)
    for (int z = -128; z < 128; ++z) {
      const uint64_t h = world::mix64(static_cast<uint64_t>((x + 1000) * 4096 + z + 1000));
      if (h % 3 == 0) batch.set({x, 0, z}, plants[h / 3 % 4]);
    }
  CHECK(w->store.apply(batch).ok());
  return w;
}

struct Pictures {
  std::shared_ptr<render::Backend> backend, rays;
  const world::World* world;
  std::shared_ptr<world::World> own;
  render::Camera camera;

  Result<render::Image> draw(const render::RenderKnobs& knobs) const {
    TRY(render::Frame frame, backend->render(world::WorldView(*world), camera, knobs, kWidth, kHeight));
    return std::move(frame.image);
  }
};

void add_ladder(std::vector<Setting>& settings, BenchContext& context, const std::string& problem,
                const Pictures& pictures, const std::string& method, int knob, bool is_default,
                const render::RenderKnobs& knobs) {
  Setting s{.method = method, .setting = fmt::format("{}@{}", method, knob), .problem = problem};
  s.knob = knob, s.is_default = is_default;
  s.measure = [=, &context](uint64_t) {
    const auto truth = context.shared<render::Image>("level_of_detail " + problem, [&] {
      return std::make_shared<render::Image>(
          supersampled(*pictures.rays, *pictures.world, pictures.camera, {}, kWidth, kHeight, context.quick() ? 4 : 8));
    });
    const auto drawn = pictures.draw(knobs);
    if (!drawn.ok()) return ErrorSample{{std::nan(""), std::nan("")}, 0};
    return picture_error(*drawn, *truth);
  };
  s.run = [=] {
    keep(pictures.draw(knobs).ok());
    return 1.0;
  };
  settings.push_back(std::move(s));
}

}  // namespace

void add_subject_level_of_detail(Registry& registry) {
  Subject subject{.question = "what do coarser levels and simpler shapes spoil, and what do they save?",
                  .reference =
                      "voxels and shapes as they are, by rays: the mean of 8x8 pictures, each through another "
                      "point of the pixel (quick: 4x4)",
                  .metrics = {"RMS error of radiance (relative)", "mean FLIP"},
                  .work_unit = "pictures",
                  .threads = 2};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    TRY(const world::World* valley, context.world("valley"));
    TRY(const world::CameraPlacement first, world::camera_of(*valley, ""));
    TRY(const std::shared_ptr<render::Backend> rays, make_backend("raycast"));
    for (const int eighths : {0, 4, 8, 16, 32, 64, 128}) {
      render::RenderKnobs knobs;
      knobs.lod_error_px = static_cast<float>(eighths) / 8;
      // A rasterizer each: to change the knob makes levels anew, and runs take turns.
      TRY(const std::shared_ptr<render::Backend> backend, make_backend("raster"));
      const Pictures far{backend, rays, valley, nullptr, render::Camera::from(first)};
      add_ladder(settings, context, "valley", far, "levels by eighths of a pixel", eighths, eighths == 8, knobs);
    }
    TRY(const std::shared_ptr<render::Backend> other, make_backend("raster"));
    const auto plants = meadow();
    render::Camera eye;
    eye.position = world::WorldPoint::from(0.3, 2.2, 60.4);
    eye.forward = glm::normalize(world::Vec3d(0.2, -0.15, -1));
    TRY(const std::shared_ptr<render::Backend> near_rays, make_backend("raycast"));
    const Pictures near{other, near_rays, plants.get(), plants, eye};
    for (const render::ProxyShapes kind :
         {render::ProxyShapes::cube, render::ProxyShapes::billboard, render::ProxyShapes::mesh}) {
      render::RenderKnobs knobs;
      knobs.proxy_shapes = kind;
      const auto names = knob_choices(kind);
      add_ladder(settings, context, "meadow", near, std::string(names[static_cast<size_t>(kind)]), 0,
                 kind == render::ProxyShapes::mesh, knobs);
    }
    render::RenderKnobs no_points;
    no_points.shape_points_px = 0;
    add_ladder(settings, context, "meadow", near, "mesh as faces", 0, false, no_points);
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
