/// A torus as a level set, in pictures: what each way to draw it shows, and what a picture of it costs.
///
/// The torus of subject smooth_surface, 640x360, at voxels of 0.8 to 0.2 m; the camera sees it at the same size. By the
/// rasterizer as cubes and as the triangles of each method, by rays as cubes, planes and the field. Times are of whole
/// pictures after the first, in which all was made.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/backend.h"
#include "tools/bench/screen_pictures.h"
#include "tools/picture.h"

namespace tools {

namespace {

constexpr int kWidth = 640, kHeight = 360;
constexpr double kRing = 9.1, kTube = 3.2;  // m

std::shared_ptr<world::World> torus_of(double voxel_m) {
  auto w = std::make_shared<world::World>(world::standard_blocks());
  world::FloatLayer& distance = w->store.make_layer(world::Layer::distance);
  const world::BlockId granite = *w->palette->find("granite");
  const world::Vec3d axis = glm::normalize(world::Vec3d(0.4, 1, 0.57)), middle(0.37, -0.21, 0.13);
  const int half = static_cast<int>(std::ceil((kRing + kTube + 1) / voxel_m));
  world::EditBatch batch;
  for (int x = -half; x < half; ++x)
    for (int y = -half; y < half; ++y)
      for (int z = -half; z < half; ++z) {
        const world::Vec3d from = voxel_m * (world::Vec3d(x, y, z) + 0.5) - middle,
                           flat = from - glm::dot(from, axis) * axis;
        const double d = (glm::length(from - kRing * glm::normalize(flat)) - kTube) / voxel_m;
        if (std::abs(d) < 3) distance.set({x, y, z}, static_cast<float>(d));
        if (d <= 0) batch.set({x, y, z}, granite);
      }
  CHECK(w->store.apply(batch).ok());
  return w;
}

render::Camera camera_at(double voxel_m) {
  render::Camera camera;
  camera.position = world::WorldPoint::from(16.6 / voxel_m, 15.1 / voxel_m, 17.3 / voxel_m);
  camera.forward = glm::normalize(world::Vec3d(-1, -0.93, -1.04));
  camera.vertical_fov = 0.9;
  return camera;
}

}  // namespace

void add_subject_smooth_pictures(Registry& registry) {
  Subject subject{.question = "what does a picture of a level set show and cost, by triangles and by rays?",
                  .reference = "its field by rays, at voxels of 0.1 m (quick: 0.2 m)",
                  .metrics = {"RMS error of radiance (relative)", "mean FLIP"},
                  .work_unit = "pictures",
                  .knob_unit = "m a voxel",
                  .threads = 2};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    const double finest = context.quick() ? 0.2 : 0.1;
    const auto truth_of = [&context, finest] {
      return context.shared<render::Image>("smooth_pictures", [finest] {
        const auto world = torus_of(finest);
        render::RenderKnobs field;
        field.contours = render::ContourShape::field;
        auto rays = make_backend("raycast");
        CHECK(rays.ok());
        auto frame = (*rays)->render(world::WorldView(*world), camera_at(finest), field, kWidth, kHeight);
        CHECK(frame.ok());
        return std::make_shared<render::Image>(std::move(frame->image));
      });
    };
    for (const double size : {0.8, 0.4, 0.2}) {
      if (context.quick() && size < 0.4) continue;
      const auto world =
          context.shared<world::World>(fmt::format("smooth_pictures {}", size), [size] { return torus_of(size); });
      const auto add = [&](const std::string& method, const std::string& backend, bool is_default,
                           const render::RenderKnobs& knobs) -> Status {
        Setting s{.method = method, .setting = fmt::format("{}@{}", method, size), .problem = backend};
        s.knob = size, s.is_default = is_default;
        TRY(const std::shared_ptr<render::Backend> drawn_by, make_backend(backend));
        const auto draw = [=] {
          auto frame = drawn_by->render(world::WorldView(*world), camera_at(size), knobs, kWidth, kHeight);
          return frame.ok() ? std::move(frame->image) : render::Image();
        };
        s.measure = [=](uint64_t) { return picture_error(draw(), *truth_of()); };
        s.run = [=] {
          keep(draw().pixels.size());
          return 1.0;
        };
        settings.push_back(std::move(s));
        return {};
      };
      render::RenderKnobs knobs;
      TRY_STATUS(add("cubes by raster", "raster", false, knobs));
      TRY_STATUS(add("cubes by rays", "raycast", false, knobs));
      knobs.contours = render::ContourShape::planes;
      TRY_STATUS(add("planes by rays", "raycast", false, knobs));
      knobs.contours = render::ContourShape::field;
      TRY_STATUS(add("field by rays", "raycast", false, knobs));
      for (const render::ContourMesh method :
           {render::ContourMesh::surface_nets, render::ContourMesh::marching_cubes,
            render::ContourMesh::marching_tetrahedra, render::ContourMesh::openvdb}) {
        knobs.contour_mesh = method;
        TRY_STATUS(add(fmt::format("{} by raster", knob_choices(method)[static_cast<size_t>(method)]), "raster",
                       method == render::RenderKnobs{}.contour_mesh, knobs));
      }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
