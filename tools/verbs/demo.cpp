/// loam demo: the main job. Generates the valley, draws it with both backends, compares the two, says which effects ran
/// and what each step cost, and leaves the pictures in out/.
#include <chrono>
#include <cstdio>
#include <filesystem>

#include "render/image/display.h"
#include "render/image/error_metrics.h"
#include "render/image/flip.h"
#include "tools/light.h"
#include "tools/picture.h"
#include "tools/verb.h"
#include "world/base/text.h"
#include "world/scenes/effects.h"

namespace tools {

namespace {

class Stopwatch {
 public:
  double ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void print_row(const std::string& what, double ms, const std::string& note) {
  std::printf("  %-28s %10.1f ms   %s\n", what.c_str(), ms, note.c_str());
}

world::Result<int> run_demo(const std::string& scene_name, const std::string& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return world::input_error(folder + ": the folder for the pictures could not be made: " + failed.message());
  TRY(const world::Scene scene, world::load_scene(scene_name));
  std::printf("%s: %s\n", scene.name.c_str(), scene.what.c_str());

  Stopwatch generate;
  world::ImportReport report;
  TRY(const world::World world, build_picture_world(scene, report));
  TRY(const render::RenderKnobs knobs, resolve_knobs("usual", world.knobs, {}, {}));
  const world::VoxelBox box = world.store.bounds();
  print_row("generate", generate.ms(),
            world::with_thousands(world.store.voxel_count()) + " voxels, " +
                world::bytes_text(double(world.store.bytes_memory())));
  TRY(const world::CameraPlacement placement, world::camera_of(world, ""));
  const render::Camera camera = render::Camera::from(placement);
  const uint64_t hash = world.store.content_hash();
  const world::WorldView view(world);

  LightOfWorld light;
  std::vector<render::Image> images;
  for (const char* name : {"raster", "raycast"}) {
    Stopwatch whole;
    TRY(const std::unique_ptr<render::Backend> backend, make_backend(name));
    TRY(backend->light, light.follow(world, camera.position, knobs));
    TRY(render::Frame frame, backend->render(view, camera, knobs, 1280, 720));
    print_row(name, whole.ms(), frame.report.device);
    for (const render::PassReport& pass : frame.report.passes) print_row("  " + pass.name, pass.ms, "");
    const std::string path = folder + "/" + scene.name + "-" + name + ".png";
    TRY_STATUS(write_picture(path, frame.image, knobs, picture_text(scene, placement.name, camera, knobs, name, hash)));
    images.push_back(std::move(frame.image));
  }
  Stopwatch compare;
  const render::Image8 raster = render::display_image(images[0], knobs.exposure),
                       raycast = render::display_image(images[1], knobs.exposure);
  const render::ImageComparison difference = render::compare_images(raster, raycast);
  print_row("compare", compare.ms(), "");
  std::printf("\nraster against raycast: %.4f %% of pixels within 1/255, PSNR %.1f dB, SSIM %.6f, FLIP %.6f\n",
              100 * difference.metrics.fraction_within_1, difference.metrics.psnr, difference.metrics.ssim,
              difference.metrics.flip);
  TRY_STATUS(render::write_png(folder + "/" + scene.name + "-difference.png", render::heat_picture(difference.flip),
                               {{"shows", "FLIP of raster against raycast: black 0 to white 1"}}));
  std::printf("\neffects\n");
  for (const world::EffectCall& effect : world::called_effects(world))
    std::printf("  %-16s %-4s %s\n", effect.name.c_str(), effect.called_for ? "yes" : "no", effect.why.c_str());
  std::printf("\nbounds (%d, %d, %d) .. (%d, %d, %d), world hash %s\npictures in %s/\n", box.min.x, box.min.y,
              box.min.z, box.max.x, box.max.y, box.max.z, hash_text(hash).c_str(), folder.c_str());
  return 0;
}

}  // namespace

void add_demo_verb(CommandLine& command) {
  auto scene = std::make_shared<std::string>("valley"), folder = std::make_shared<std::string>("out");
  CLI::App* verb = command.verb("demo", "the main job: generate, draw with both backends, compare");
  verb->add_option("SCENE", *scene, "what to show")->capture_default_str();
  verb->add_option("--out", *folder, "where the pictures go")->capture_default_str();
  command.action(verb, [scene, folder] { return run_demo(*scene, *folder); });
}

}  // namespace tools
