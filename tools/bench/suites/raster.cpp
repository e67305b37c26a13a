/// Pictures of the valley by the rasterizer, from a camera that looks around, after what it derives has been made.
#include <cmath>

#include "render/backend.h"
#include "tools/bench/benchmark.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

constexpr int kWidth = 1280, kHeight = 720;

/// The scene's first camera, and the same turned by quarters about the vertical.
Result<std::vector<render::Camera>> cameras(const world::World& valley) {
  TRY(const world::CameraPlacement first, world::camera_of(valley, ""));
  std::vector<render::Camera> all;
  for (int quarter = 0; quarter < 4; ++quarter) {
    render::Camera camera = render::Camera::from(first);
    for (int i = 0; i < quarter; ++i) camera.forward = {-camera.forward.z, camera.forward.y, camera.forward.x};
    all.push_back(camera);
  }
  return all;
}

Result<std::unique_ptr<render::Backend>> make_backend(const std::string& name) {
  for (const render::BackendInfo& info : render::backends())
    if (info.name == name) return info.make();
  return world::Error{world::ErrorKind::no_device, "this program has no backend " + name};
}

/// Frames of all cameras a call, counting those drawn; NaN where one fails.
Result<std::function<double()>> frames_of(const world::World& valley, const std::vector<render::Camera>& views,
                                          const std::string& backend_name, const render::RenderKnobs& knobs,
                                          std::shared_ptr<render::FrameReport> last = nullptr) {
  TRY(std::shared_ptr<render::Backend> backend, make_backend(backend_name));
  // The first picture says whether it works, and why not.
  TRY(const render::Frame first, backend->render(world::WorldView(valley), views[0], knobs, kWidth, kHeight));
  (void)first;
  return std::function<double()>([=, &valley] {
    const world::WorldView view(valley);
    if (last) *last = {};
    for (const render::Camera& camera : views) {
      const auto frame = backend->render(view, camera, knobs, kWidth, kHeight);
      if (!frame.ok()) return std::nan("");
      if (last) last->faces_drawn += frame->report.faces_drawn;
    }
    return static_cast<double>(views.size());
  });
}

Result<Prepared> prepare(BenchContext& context, world::Accuracy accuracy) {
  TRY(const world::World* valley, context.world("valley"));
  TRY(const std::vector<render::Camera> views, cameras(*valley));
  const render::RenderKnobs knobs = render::render_knobs().preset(accuracy);
  const auto report = std::make_shared<render::FrameReport>();
  TRY(const auto raster, frames_of(*valley, views, "raster", knobs, report));
  TRY(const auto raycast, frames_of(*valley, views, "raycast", knobs));
  return Prepared{.ours = {"raster", raster}, .rivals = {{"raycast", raycast}}, .counters = [=] {
                    return std::map<std::string, double>{{"faces_a_frame", static_cast<double>(report->faces_drawn) /
                                                                               static_cast<double>(views.size())}};
                  }};
}

}  // namespace

void add_suite_raster(Registry& registry) {
  registry.add({.name = "valley_256m",
                .what = "the valley at 1280x720, four directions, accuracy fast: 256 m view distance",
                .unit = "frames/s",
                .threads = 2,
                .clock = Clock::wall,
                .repetitions = 5,
                .reach = Reach{20, "the first milestone: lavapipe on 2 cores, 20 frames/s"},
                .prepare = [](BenchContext& c) { return prepare(c, world::Accuracy::fast); }});
  registry.add({.name = "valley_whole",
                .what = "the valley at 1280x720, four directions, accuracy usual: all of it, with the sun's shadow",
                .unit = "frames/s",
                .threads = 2,
                .clock = Clock::wall,
                .repetitions = 5,
                .prepare = [](BenchContext& c) { return prepare(c, world::Accuracy::usual); }});
}

}  // namespace tools
