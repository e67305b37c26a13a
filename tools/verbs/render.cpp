/// loam render SCENE or WORLD: one picture, or a row of them along a camera path.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>

#include <fmt/format.h>

#include "tools/json_text.h"
#include "tools/picture.h"
#include "tools/progress.h"
#include "tools/verb.h"
#include "world/base/jobs.h"

namespace tools {

namespace {

constexpr int kLapFrames = 600;
constexpr int kMostPixelsASide = 16384;

struct RenderOptions {
  std::string scene, output, backend = "raster", size = "1280x720", camera, accuracy = "usual", frames;
  std::vector<std::string> settings, environment_settings;
  std::map<std::string, std::string> knobs;  // given by their own flags
  std::vector<double> position, look_at;
  double fov_deg = 0;
  int samples = 1, threads = 0;
  bool json = false;
};

world::Status parse_size(const std::string& text, int& width, int& height) {
  char x = 0, rest = 0;
  if (std::sscanf(text.c_str(), "%d%c%d%c", &width, &x, &height, &rest) != 3 || (x != 'x' && x != 'X') || width < 1 ||
      height < 1 || width > kMostPixelsASide || height > kMostPixelsASide)
    return world::usage_error("--size takes WIDTHxHEIGHT, each from 1 to 16384, for instance 1280x720, not \"" + text +
                              "\"");
  return {};
}

world::Status parse_frames(const std::string& text, int& first, int& last) {
  char rest = 0;
  if (std::sscanf(text.c_str(), "%d..%d%c", &first, &last, &rest) != 2 || first < 0 || last < first)
    return world::usage_error("--frames takes FIRST..LAST, for instance 0..599, not \"" + text + "\"");
  return {};
}

/// The output of one frame: the run of # becomes the number, or it is put before the extension.
std::string frame_path(const std::string& pattern, int frame) {
  const size_t first = pattern.find('#');
  if (first == std::string::npos) {
    const std::filesystem::path p(pattern);
    return (p.parent_path() / fmt::format("{}_{:04}{}", p.stem().string(), frame, p.extension().string())).string();
  }
  size_t last = first;
  while (last < pattern.size() && pattern[last] == '#') ++last;
  return pattern.substr(0, first) + fmt::format("{:0{}}", frame, last - first) + pattern.substr(last);
}

world::Result<render::Camera> choose_camera(const RenderOptions& options, const world::Scene& scene,
                                            const world::World& world, std::string& name) {
  TRY(const world::CameraPlacement placement, world::scene_camera(scene, world, options.camera));
  render::Camera camera = render::Camera::from(placement);
  name = placement.name;
  const auto point = [](const std::vector<double>& v) { return world::WorldPoint::from(v[0], v[1], v[2]); };
  for (const auto* given : {&options.position, &options.look_at})
    for (double c : *given)
      if (!(std::abs(c) < world::kWorldBorder))
        return world::usage_error("--position and --look-at must lie within the world's border of +-1073737728");
  if (!options.position.empty()) camera.position = point(options.position), name = "custom";
  if (!options.look_at.empty()) {
    const world::Vec3d to = point(options.look_at) - camera.position;
    if (glm::length(to) == 0) return world::usage_error("--look-at must differ from the camera's position");
    camera.forward = glm::normalize(to), name = "custom";
  }
  if (options.fov_deg > 0) camera.vertical_fov = options.fov_deg * 3.14159265358979323846 / 180;
  return camera;
}

world::Result<int> run_render(const RenderOptions& options) {
  int width = 0, height = 0, first = 0, last = 0;
  TRY_STATUS(parse_size(options.size, width, height));
  if (!options.frames.empty()) TRY_STATUS(parse_frames(options.frames, first, last));
  TRY_STATUS(check_picture_path(options.output));
  if (options.samples != 1)
    return world::usage_error(
        "--spp other than 1 needs a backend that takes samples; raster and raycast look through pixel centres");
  const world::ThreadLimit limit(options.threads);
  TRY(const std::unique_ptr<render::Backend> backend, make_backend(options.backend));
  TRY(const world::Scene scene, world::load_scene(options.scene));
  TRY(const render::RenderKnobs knobs,
      resolve_knobs(options.accuracy, scene, options.environment_settings, options.settings));
  world::ImportReport imported;
  Progress progress;
  progress.stage("building the world of " + scene.name);
  TRY(const world::World world, build_picture_world(scene, imported));
  progress.stage("");
  for (const std::string& warning : imported.warnings) std::cerr << "warning: " << warning << '\n';
  std::string camera_name;
  TRY(const render::Camera start, choose_camera(options, scene, world, camera_name));
  const uint64_t hash = world.store.content_hash();
  const world::WorldView view(world);
  nlohmann::json reports = nlohmann::json::array();
  for (int frame = first; frame <= last; ++frame) {
    const bool moving = !options.frames.empty();
    const render::Camera camera = moving ? camera_on_path(scene, world, start, frame, kLapFrames) : start;
    TRY(const render::Frame picture, backend->render(view, camera, knobs, width, height));
    const std::string path = moving ? frame_path(options.output, frame) : options.output;
    TRY_STATUS(write_picture(path, picture.image, knobs,
                             picture_text(scene, camera_name, camera, knobs, options.backend, hash)));
    reports.push_back(report_json(picture.report, world));
    if (moving) progress.stage(fmt::format("frame {} of {}..{}", frame, first, last));
    if (!options.json && !moving) {
      std::printf("%s: %dx%d by %s on %s, %.1f ms\n", path.c_str(), width, height, options.backend.c_str(),
                  picture.report.device.c_str(), picture.report.ms);
      for (const render::PassReport& pass : picture.report.passes)
        std::printf("  %-16s %8.2f ms %8llu draws %12llu bytes\n", pass.name.c_str(), pass.ms,
                    static_cast<unsigned long long>(pass.draws), static_cast<unsigned long long>(pass.bytes));
    }
  }
  progress.stage("");
  if (options.json) {
    nlohmann::json j = reports.front();
    j["hash"] = hash_text(hash);
    if (reports.size() > 1) j["frames"] = reports;
    std::cout << json_text(j) << '\n';
  }
  return 0;
}

}  // namespace

void add_render_verb(Command& command) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* verb = command.verb("render", "a picture of a scene or world");
  verb->add_option("SCENE", options->scene, "a scene's name, a scene .toml, a world, or an importable file")
      ->required();
  verb->add_option("-o,--output", options->output, "OUT.png or OUT.exr; with --frames, a run of # is the number")
      ->required();
  verb->add_option("--backend", options->backend, "raster or raycast")->envname("LOAM_BACKEND")->capture_default_str();
  verb->add_option("--size", options->size, "WIDTHxHEIGHT")->envname("LOAM_SIZE")->capture_default_str();
  verb->add_option("--camera", options->camera, "a camera of the scene, or overview");
  verb->add_option("--position", options->position, "camera position X Y Z in metres")->expected(3);
  verb->add_option("--look-at", options->look_at, "point X Y Z that the camera looks at")->expected(3);
  verb->add_option("--fov", options->fov_deg, "vertical field of view in degrees")->check(CLI::Range(1.0, 179.0));
  verb->add_option("--spp", options->samples, "samples a pixel")->check(CLI::PositiveNumber);
  verb->add_option("--accuracy", options->accuracy, "fast, usual or exact")
      ->envname("LOAM_ACCURACY")
      ->capture_default_str();
  verb->add_option("--set", options->settings, "KNOB=VALUE; again for more")->take_all();
  verb->add_option("--frames", options->frames, "FIRST..LAST of a lap of 600 frames along the scene's cameras");
  verb->add_option("-t,--threads", options->threads, "threads to use; 0 is all")
      ->envname("LOAM_THREADS")
      ->check(CLI::NonNegativeNumber);
  verb->add_flag("--json", options->json, "one JSON object on stdout");
  for (const auto& row : render::render_knobs().rows())
    verb->add_option("--" + row.name, options->knobs[row.name],
                     fmt::format("{} (fast {}, usual {}, exact {}{}{})", row.what, row.fast, row.usual, row.exact,
                                 row.unit.empty() ? "" : " ", row.unit))
        ->group("Knobs");
  verb->footer("LOAM_SET holds further settings KNOB=VALUE, separated by commas; flags win.");
  command.action(verb, [options] {
    if (const char* set = std::getenv("LOAM_SET")) {
      std::string text = set;
      for (size_t at = 0; at < text.size();) {
        const size_t comma = std::min(text.find(',', at), text.size());
        if (comma > at) options->environment_settings.push_back(text.substr(at, comma - at));
        at = comma + 1;
      }
    }
    for (const auto& [knob, value] : options->knobs)
      if (!value.empty()) options->settings.push_back(knob + "=" + value);
    return run_render(*options);
  });
}

}  // namespace tools
