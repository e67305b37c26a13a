#include "tools/play/thumbnails.h"

#include <chrono>
#include <cstdlib>
#include <filesystem>

#include "commit.h"
#include "render/image/display.h"
#include "render/image/png_exr.h"
#include "tools/light.h"
#include "tools/picture.h"

namespace tools {

namespace {

std::filesystem::path cache_folder() {
  if (const char* all = std::getenv("LOAM_DATA"); all && *all) return std::filesystem::path(all) / "thumbnails";
  const char *xdg = std::getenv("XDG_CACHE_HOME"), *home = std::getenv("HOME");
  const std::filesystem::path base =
      xdg && *xdg == '/' ? std::filesystem::path(xdg) : std::filesystem::path(home && *home ? home : "/tmp") / ".cache";
  return base / "loam" / "thumbnails";
}

world::Result<render::Image8> draw(const std::string& name) {
  TRY(const world::Scene scene, world::load_scene(name));
  world::ImportReport report;
  TRY(const world::World world, build_picture_world(scene, report));
  TRY(const world::CameraPlacement placement, world::camera_of(world, ""));
  const render::Camera camera = render::Camera::from(placement);
  std::map<std::string, std::string> knobs = world.knobs;
  // One sample a pixel of direct light: a thumbnail, not a study.
  knobs["spp"] = "1";
  knobs.emplace("light_model", "flood_rgb");
  TRY(render::RenderKnobs settings, resolve_knobs("usual", knobs, {}, {}));
  if (settings.light_model == render::LightModel::flux) settings.light_model = render::LightModel::flood_rgb;
  TRY(const auto backend, make_backend("raycast"));
  LightOfWorld light;
  if (backend->reads_light(world, settings)) {
    TRY(backend->light, light.follow(world, camera.position, settings));
  }
  TRY(const render::Frame frame,
      backend->render(world::WorldView(world), camera, settings, kThumbnailWidth, kThumbnailHeight));
  return render::display_image(frame.image, settings.exposure);
}

}  // namespace

Thumbnails::Thumbnails() : thread_([this] { run(); }) {}

Thumbnails::~Thumbnails() {
  stop_ = true;
  thread_.join();
}

std::vector<Thumbnails::Made> Thumbnails::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(made_, {});
}

void Thumbnails::run() {
  const std::filesystem::path folder = cache_folder();
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  for (const bool from_cache : {true, false})
    for (const std::string& name : world::scene_names()) {
      while (paused_ && !stop_) std::this_thread::sleep_for(std::chrono::milliseconds(50));
      if (stop_) return;
      const std::filesystem::path path = folder / (name + ".png");
      auto kept = render::read_png(path);
      const bool current = kept && kept->text["commit"] == LOAM_COMMIT && kept->width == kThumbnailWidth;
      if (from_cache != current) continue;
      render::Image8 image;
      if (current) {
        image = render::image8_from_png(*kept);
      } else {
        auto drawn = draw(name);
        if (!drawn) continue;
        image = std::move(*drawn);
        (void)render::write_png(path, image, {{"commit", LOAM_COMMIT}}).ok();
      }
      const std::lock_guard lock(mutex_);
      made_.push_back({name, std::move(image)});
    }
}

}  // namespace tools
