/// Pictures of the valley by the rasterizer, from a camera that looks around, after what it derives has been made.
#include <malloc.h>

#include <cmath>
#include <mutex>

#include "render/backend.h"
#include "render/extract/extractor.h"
#include "render/raster/raster.h"
#include "tools/bench/benchmark.h"
#include "tools/bench/flight.h"
#include "tools/picture.h"
#include "world/base/jobs.h"
#include "world/gen/generator.h"
#include "world/scenes/scene.h"
#include "world/store/snapshot.h"

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

/// The triangles of what is seen in a constant colour: what a picture costs at least.
constexpr const char* kBare = "constant colour";

Result<std::unique_ptr<render::Backend>> backend_of(const std::string& name) {
  if (name != kBare) return make_backend(name);
  TRY(auto bare, render::make_raster({}));
  bare->draw_bare(true);
  return std::unique_ptr<render::Backend>(std::move(bare));
}

/// Frames of all cameras a call, counting those drawn; NaN where one fails.
Result<std::function<double()>> frames_of(const world::World& valley, const std::vector<render::Camera>& views,
                                          const std::string& backend_name, const render::RenderKnobs& knobs,
                                          std::shared_ptr<render::FrameReport> last = nullptr) {
  TRY(std::shared_ptr<render::Backend> backend, backend_of(backend_name));
  // The first picture says whether it works, and why not.
  TRY(const render::Frame first, backend->render(world::WorldView(valley), views[0], knobs, kWidth, kHeight));
  (void)first;
  return std::function<double()>([=, &valley] {
    const world::WorldView view(valley);
    if (last) *last = {};
    std::map<std::string, double> ms;
    std::map<std::string, uint64_t> work;
    for (const render::Camera& camera : views) {
      const auto frame = backend->render(view, camera, knobs, kWidth, kHeight);
      if (!frame.ok()) return std::nan("");
      if (last) last->faces_drawn += frame->report.faces_drawn;
      for (const render::EffectWork& w : frame->report.work) work[w.name] += w.work;
      for (const render::PassReport& pass : frame->report.passes) ms[pass.name] += pass.ms;
    }
    if (last)
      for (const auto& [name, sum] : ms) last->passes.push_back({name, sum, 0, 0});
    if (last)
      for (const auto& [name, sum] : work) last->work.push_back({name, sum});
    return static_cast<double>(views.size());
  });
}

/// Of a frame: faces drawn and the time of each pass.
std::map<std::string, double> counters_of(const render::FrameReport& report, double frames) {
  std::map<std::string, double> counters{{"faces_a_frame", static_cast<double>(report.faces_drawn) / frames}};
  for (const render::PassReport& pass : report.passes) counters[pass.name + "_ms"] = pass.ms / frames;
  for (const render::EffectWork& w : report.work) counters[w.name] = static_cast<double>(w.work) / frames;
  return counters;
}

/// A meadow of 325 x 325 plants, one a voxel, seen from its edge; a torch put in and taken out where `edit` asks.
Result<Prepared> prepare_plants(BenchContext&, bool edit) {
  const auto w = std::make_shared<world::World>(world::standard_blocks());
  world::EditBatch batch;
  const auto block = [&](const char* name) { return *w->palette->find(name); };
  constexpr int kEdge = 325;
  batch.fill({{0, -1, -kEdge}, {kEdge - 1, -1, -1}}, block("grass"));
  const world::BlockId plants[] = {block("tall_grass"), block("fern"), block("wheat")};
  for (int x = 0; x < kEdge; ++x)
    for (int z = -kEdge; z < 0; ++z) batch.set({x, 0, z}, plants[(x * 7 + (z + kEdge) * 3) % 3]);
  TRY_STATUS(w->store.apply(batch));
  // High enough for all of it to lie in the picture.
  render::Camera camera;
  camera.position = world::WorldPoint::from(kEdge / 2.0 + 0.3, 190, 150.2);
  camera.forward = glm::normalize(world::Vec3d(0, -0.62, -1));
  TRY(std::shared_ptr<render::Backend> backend, make_backend("raster"));
  render::RenderKnobs knobs;
  knobs.lod_error_px = 0;
  TRY(const render::Frame first, backend->render(world::WorldView(*w), camera, knobs, kWidth, kHeight));
  (void)first;
  const auto report = std::make_shared<render::FrameReport>();
  const auto turn = std::make_shared<int>(0);
  const world::BlockId torch = block("torch");
  return Prepared{.ours = {"raster",
                           [=] {
                             if (edit) {
                               world::EditBatch one;
                               one.set({kEdge / 2, 1, -20}, ++*turn % 2 ? torch : world::kAir);
                               if (!w->store.apply(one).ok()) return std::nan("");
                             }
                             const auto frame = backend->render(world::WorldView(*w), camera, knobs, kWidth, kHeight);
                             if (!frame.ok()) return std::nan("");
                             *report = frame->report;
                             return 1.0;
                           }},
                  .counters = [=] { return counters_of(*report, 1); }};
}

/// The valley's land as wide as its camera sees at 4 km, its regions packed as they are made.
Result<std::shared_ptr<world::World>> wide_valley(bool quick) {
  TRY(const world::Scene scene, world::load_scene("valley"));
  const auto w = std::make_shared<world::World>(world::standard_blocks());
  w->environment = scene.environment, w->cameras = scene.cameras;
  TRY(const auto generator, world::make_generator("valley", scene.seed, scene.parameters, *w->palette));
  for (const world::MaskKind kind : {world::MaskKind::occupied, world::MaskKind::opaque}) w->store.masks(kind);
  const unsigned kinds = w->store.mask_kinds();
  const int half = quick ? 8 : 32;  // regions
  std::mutex installing;
  world::parallel_for(size_t(4) * half * half * 2, [&](size_t i) {
    const int n = static_cast<int>(i), side = 2 * half;
    const world::RegionPos pos{n / 2 / side - half, n % 2, n / 2 % side - half};
    world::RegionBuilder region(pos);
    generator->generate(region);
    world::PreparedRegion made(region, *w->palette, kinds);
    const std::lock_guard lock(installing);
    w->store.install(std::move(made));
  });
  return w;
}

constexpr double kMiB = 1024 * 1024;

/// To each side, until all impostors are made.
constexpr int kPicturesUntilImpostors = 12;

/// Of a picture of the wide valley: what following the camera took, ms.
double follow_ms(const render::FrameReport& report) {
  double ms = 0;
  for (const render::PassReport& pass : report.passes)
    if (pass.name == "extract" || pass.name == "upload") ms += pass.ms;
  return ms;
}

/// Frames to all sides, or the longest time that following the camera takes of a frame while it flies.
Result<Prepared> prepare_wide(BenchContext& context, bool flies, float impostor_error_px = 0) {
  malloc_trim(0);  // so that what the row before gave back isn't taken again unseen
  const auto resident_MiB = [before = static_cast<double>(resident_bytes())] {
    return (static_cast<double>(resident_bytes()) - before) / kMiB;
  };
  TRY(const std::shared_ptr<world::World> valley, wide_valley(context.quick()));
  TRY(const std::vector<render::Camera> views, cameras(*valley));
  render::RenderKnobs knobs = render::render_knobs().preset(world::Accuracy::fast);
  knobs.view_distance = 4096;
  knobs.proxy_shapes = render::ProxyShapes::cube;
  if (!flies) {
    knobs.impostor_error_px = impostor_error_px;
    const auto report = std::make_shared<render::FrameReport>();
    TRY(const auto frames, frames_of(*valley, views, "raster", knobs, report));
    for (int i = 0; i < kPicturesUntilImpostors && impostor_error_px > 0; ++i) keep(frames());
    return Prepared{.ours = {"raster", [valley, frames] { return frames(); }}, .counters = [=] {
                      auto counters = counters_of(*report, static_cast<double>(views.size()));
                      counters["resident_MiB"] = resident_MiB();
                      counters["blocks_and_masks_MiB"] = static_cast<double>(valley->store.bytes_memory()) / kMiB;
                      return counters;
                    }};
  }
  TRY(std::shared_ptr<render::Backend> backend, make_backend("raster"));
  const auto camera = std::make_shared<render::Camera>(views[0]);
  const auto draw = [=]() -> double {
    const auto frame = backend->render(world::WorldView(*valley), *camera, knobs, 320, 180);
    camera->position.voxel.x += 2;  // 30 m/s at 15 frames/s
    return frame.ok() ? follow_ms(frame->report) : std::nan("");
  };
  const double first_ms = draw();
  const auto most_MiB = std::make_shared<double>(0);
  return Prepared{.ours = {"raster",
                           [=] {
                             double longest = 0;
                             for (int i = 0; i < 150; ++i) longest = std::max(longest, draw());
                             *most_MiB = std::max(*most_MiB, resident_MiB());
                             return longest;
                           }},
                  .counters = [=] {
                    return std::map<std::string, double>{{"first_picture_ms", first_ms}, {"resident_MiB", *most_MiB}};
                  }};
}

Result<Prepared> prepare(BenchContext& context, world::Accuracy accuracy, float view_distance = 0,
                         const std::string& rival = "raycast") {
  TRY(const world::World* valley, context.world("valley"));
  TRY(const std::vector<render::Camera> views, cameras(*valley));
  render::RenderKnobs knobs = render::render_knobs().preset(accuracy);
  if (view_distance > 0) knobs.view_distance = view_distance;
  const auto report = std::make_shared<render::FrameReport>();
  TRY(const auto raster, frames_of(*valley, views, "raster", knobs, report));
  TRY(const auto other, frames_of(*valley, views, rival, knobs));
  return Prepared{.ours = {"raster", raster}, .rivals = {{rival, other}}, .counters = [=] {
                    return counters_of(*report, static_cast<double>(views.size()));
                  }};
}

/// Faces drawn of those in the world, a frame; the counters say for what the others weren't.
Result<Prepared> prepare_culling(BenchContext& context) {
  TRY(const world::World* valley, context.world("valley"));
  TRY(const std::vector<render::Camera> views, cameras(*valley));
  const render::RenderKnobs knobs = render::render_knobs().preset(world::Accuracy::usual);
  const auto report = std::make_shared<render::FrameReport>();
  TRY(const auto raster, frames_of(*valley, views, "raster", knobs, report));
  // With those into cavities that nothing outside sees.
  render::Extractor all, open;
  const world::WorldView view(*valley);
  const render::ExtractReport of_all = all.rebuild(view, {.sealed_cavities = true}),
                              of_open = open.rebuild(view, {.sealed_cavities = false});
  const auto counters = [=] {
    auto found = counters_of(*report, static_cast<double>(views.size()));
    found["unit_faces_visible"] = static_cast<double>(of_all.faces);
    found["unit_faces_into_cavities"] = static_cast<double>(of_all.faces - of_open.faces);
    found["rectangles"] = static_cast<double>(of_all.quads);
    found["rectangles_into_cavities"] = static_cast<double>(of_all.quads - of_open.quads);
    return found;
  };
  return Prepared{.ours = {"raster",
                           [=] {
                             const double frames = raster();
                             return static_cast<double>(report->faces_drawn) / frames;
                           }},
                  .counters = counters};
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
  registry.add({.name = "valley_256m_usual",
                .what = "the valley at 1280x720, four directions, 256 m view distance, the rest as usual",
                .unit = "frames/s",
                .threads = 2,
                .clock = Clock::wall,
                .repetitions = 5,
                .reach = Reach{30, "lavapipe on 2 cores: 30 frames/s"},
                .prepare = [](BenchContext& c) { return prepare(c, world::Accuracy::usual, 256); }});
  registry.add({.name = "valley_256m_least",
                .what = "the same beside its triangles and pixels in a constant colour",
                .unit = "frames/s",
                .threads = 2,
                .clock = Clock::wall,
                .repetitions = 5,
                .reach = Reach{0.5, "within 2x of the bare minimum", true},
                .prepare = [](BenchContext& c) { return prepare(c, world::Accuracy::usual, 256, kBare); }});
  registry.add(
      {.name = "valley_faces",
       .what = "rectangles drawn of the valley's a frame, accuracy usual; the counters say for what others were not",
       .unit = "rectangles",
       .better = Better::lower,
       .timing = Timing::reported,
       .threads = 2,
       .clock = Clock::wall,
       .repetitions = 1,
       .prepare = prepare_culling});
  registry.add({.name = "valley_4km",
                .what =
                    "land of 8192x8192 m like the valley's at 1280x720, four directions, 4 km view distance, accuracy "
                    "fast, plants as cubes; counters say what it holds in memory (aim: under 2048 MiB)",
                .unit = "frames/s",
                .threads = 2,
                .clock = Clock::wall,
                .repetitions = 3,
                .reach = Reach{20, "lavapipe on 2 cores: 20 frames/s"},
                .prepare = [](BenchContext& c) { return prepare_wide(c, false); }});
  registry.add({.name = "valley_4km_impostors",
                .what = "the same, what is far from pictures of it (impostor_error_px=4) that are made before",
                .unit = "frames/s",
                .threads = 2,
                .clock = Clock::wall,
                .repetitions = 3,
                .reach = Reach{20, "lavapipe on 2 cores: 20 frames/s"},
                .prepare = [](BenchContext& c) { return prepare_wide(c, false, 4); }});
  registry.add({.name = "valley_4km_flight",
                .what = "the longest that extraction and upload take of a frame while a camera flies over it at 30 m/s",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::reported,
                .threads = 2,
                .clock = Clock::wall,
                .repetitions = 3,
                .reach = Reach{50, "no hitch above 50 ms"},
                .prepare = [](BenchContext& c) { return prepare_wide(c, true); }});
  registry.add({.name = "plants_100k",
                .what = "105,625 plants, each a shape of its own, all in the picture, 1280x720",
                .unit = "frames/s",
                .threads = 2,
                .clock = Clock::wall,
                .repetitions = 5,
                .reach = Reach{15, "lavapipe on 2 cores: 15 frames/s"},
                .prepare = [](BenchContext& c) { return prepare_plants(c, false); }});
  registry.add({.name = "plants_100k_edited",
                .what = "the same with one voxel edited before each frame",
                .unit = "frames/s",
                .threads = 2,
                .clock = Clock::wall,
                .repetitions = 5,
                .prepare = [](BenchContext& c) { return prepare_plants(c, true); }});
  registry.add({.name = "valley_whole",
                .what = "the valley at 1280x720, four directions, accuracy usual: all of it, with the sun's shadow",
                .unit = "frames/s",
                .threads = 2,
                .clock = Clock::wall,
                .repetitions = 5,
                .prepare = [](BenchContext& c) { return prepare(c, world::Accuracy::usual); }});
}

}  // namespace tools
