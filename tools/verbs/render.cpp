/// loam render SCENE or WORLD: one picture, or a row of them along a camera path.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>

#include <fmt/format.h>

#include "tools/interrupt.h"
#include "tools/json_text.h"
#include "tools/light.h"
#include "tools/picture.h"
#include "tools/progress.h"
#include "tools/verb.h"
#include "world/base/jobs.h"
#include "world/scenes/fog.h"

namespace tools {

namespace {

constexpr const char* kUsualBackend = "raster";
constexpr int kLapFrames = 600;
constexpr int kMostPixelsASide = 16384;
constexpr int kFogSamples = 16;        // of a fog volume alone: 12 s of a core at 640 x 480
constexpr int kReferenceSamples = 64;  // where nothing says how many
constexpr int kMostSamples = 1 << 24;  // where an error is asked for instead

struct RenderOptions {
  std::string scene, output, backend, size = "1280x720", camera, accuracy = "usual", frames;
  std::vector<std::string> settings, environment_settings;
  std::map<std::string, std::string> knobs;  // given by their own flags
  std::vector<double> position, look_at;
  double fov_deg = 0, error = 0;
  uint64_t seed = 1;
  std::string resume;
  int threads = 0;
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

world::Result<render::Camera> choose_camera(const RenderOptions& options, const world::World& world,
                                            std::string& name) {
  TRY(const world::CameraPlacement placement, world::camera_of(world, options.camera));
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

/// Whether a scene, the environment or a flag says what the knob is.
bool sets_knob(const RenderOptions& options, const std::map<std::string, std::string>& of_the_world,
               const std::string& knob) {
  const auto names = [&](const std::string& setting) { return setting.starts_with(knob + "="); };
  return of_the_world.contains(knob) || std::any_of(options.settings.begin(), options.settings.end(), names) ||
         std::any_of(options.environment_settings.begin(), options.environment_settings.end(), names);
}

world::Result<render::RenderKnobs> choose_knobs(const RenderOptions& options,
                                                const std::map<std::string, std::string>& of_the_world) {
  TRY(render::RenderKnobs knobs,
      resolve_knobs(options.accuracy, of_the_world, options.environment_settings, options.settings));
  if (options.backend == "reference" && !sets_knob(options, of_the_world, "spp"))
    knobs.spp = options.error > 0 ? kMostSamples : kReferenceSamples;
  if (options.backend == "raster" && knobs.spp != 1)
    return world::usage_error("--spp other than 1 needs a backend that takes samples: raycast or reference");
  return knobs;
}

/// The rasterizer, but where the world is a fog volume, which it cannot draw; makes such a world look like fog.
world::Status choose_backend(RenderOptions& options, world::World& world) {
  const bool fog = world::is_fog(world);
  if (options.backend.empty()) options.backend = fog ? "raycast" : kUsualBackend;
  if (!fog) return {};
  if (options.backend != "raster") {
    // Light from sources only would leave it black.
    if (options.backend == "raycast") world.knobs.try_emplace("light_transport", "path");
    if (options.backend == "raycast") world.knobs.try_emplace("spp", std::to_string(kFogSamples));
    return world::show_fog(world);
  }
  std::cerr << "warning: the rasterizer draws no media: the fog is shown as solid where it is active\n";
  return {};
}

world::Result<int> run_render(RenderOptions options) {
  int width = 0, height = 0, first = 0, last = 0;
  TRY_STATUS(parse_size(options.size, width, height));
  if (!options.frames.empty()) TRY_STATUS(parse_frames(options.frames, first, last));
  TRY_STATUS(check_picture_path(options.output));
  if (!options.resume.empty() && !options.frames.empty())
    return world::usage_error("--resume keeps the samples of one picture; it doesn't go with --frames");
  const world::ThreadLimit limit(options.threads);
  if (!options.backend.empty()) {
    TRY([[maybe_unused]] const auto known, make_backend(options.backend));
  }
  TRY(const world::Scene scene, world::load_scene(options.scene));
  // Before the work: settings that can't be should not cost a world.
  TRY_STATUS(choose_knobs(options, scene.knobs));
  world::ImportReport imported;
  Progress progress;
  progress.stage("building the world of " + scene.name);
  TRY(world::World world, build_picture_world(scene, imported));
  progress.stage("");
  for (const std::string& warning : imported.warnings) std::cerr << "warning: " << warning << '\n';
  if (world.store.voxel_count() == 0 && world.meshes.empty() && world.media.empty())
    std::cerr << "warning: the world is empty: there is nothing but sky to see\n";
  TRY_STATUS(choose_backend(options, world));
  TRY(const std::unique_ptr<render::Backend> backend, make_backend(options.backend));
  TRY(const render::RenderKnobs knobs, choose_knobs(options, world.knobs));
  std::string camera_name;
  TRY(const render::Camera start, choose_camera(options, world, camera_name));
  const uint64_t hash = world.store.content_hash();
  LightOfWorld light;
  const bool reads_light = backend->reads_light(world, knobs);
  if (!reads_light && knobs.light_model != render::LightModel::none && sets_knob(options, {}, "light_model"))
    std::cerr << "light_model has no effect here: " << options.backend
              << " follows light itself and reads none of the world's\n";
  const world::WorldView view(world);
  const StopOnInterrupt stop;
  render::Sampling& sampling = backend->sampling;
  sampling.seed = options.seed;
  sampling.error = options.error;
  sampling.film = options.resume;
  sampling.stop = &stop.asked();
  sampling.progress = [&](uint32_t samples, double error) {
    progress.stage(fmt::format("{} of {} samples a pixel, relative error {:.3g}", samples, knobs.spp, error));
  };
  nlohmann::json reports = nlohmann::json::array();
  for (int frame = first; frame <= last; ++frame) {
    const bool moving = !options.frames.empty();
    const render::Camera camera = moving ? camera_on_path(world, start, frame, kLapFrames) : start;
    render::PictureText text = picture_text(scene, camera_name, camera, knobs, options.backend, hash);
    sampling.picture = text;
    for (const char* other : {"knobs", "commit"}) sampling.picture.erase(other);  // the film has the knobs themselves
    if (reads_light) {
      TRY(backend->light, light.follow(world, camera.position, knobs));
    }
    TRY(const render::Frame picture, backend->render(view, camera, knobs, width, height));
    if (picture.report.samples > 0) {
      text["spp"] = std::to_string(picture.report.samples);
      text["seed"] = std::to_string(options.seed);
      text["relative_error"] = fmt::format("{}", picture.report.relative_error);
    }
    const std::string path = moving ? frame_path(options.output, frame) : options.output;
    TRY_STATUS(write_picture(path, picture.image, knobs, text));
    reports.push_back(report_json(picture.report, world));
    if (!light.report().is_null()) reports.back()["light"] = light.report();
    if (stop.asked()) break;
    if (moving) progress.stage(fmt::format("frame {} of {}..{}", frame, first, last));
    if (!options.json && !moving) {
      std::printf("%s: %dx%d by %s on %s, %.1f ms\n", path.c_str(), width, height, options.backend.c_str(),
                  picture.report.device.c_str(), picture.report.ms);
      for (const render::PassReport& pass : picture.report.passes)
        std::printf("  %-16s %8.2f ms %8llu draws %12llu bytes\n", pass.name.c_str(), pass.ms,
                    static_cast<unsigned long long>(pass.draws), static_cast<unsigned long long>(pass.bytes));
      if (!light.report().is_null()) std::printf("  light: %s\n", light.report().dump().c_str());
      if (picture.report.samples > 0)
        std::printf("  %u samples a pixel, relative error %.3g, %llu samples left out\n", picture.report.samples,
                    picture.report.relative_error, static_cast<unsigned long long>(picture.report.nan_samples));
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
  verb->add_option("--backend", options->backend,
                   "raster, raycast or reference; usually raster, of a fog volume raycast")
      ->envname("LOAM_BACKEND");
  verb->add_option("--size", options->size, "WIDTHxHEIGHT")->envname("LOAM_SIZE")->capture_default_str();
  verb->add_option("--camera", options->camera, "a camera of the scene, or overview");
  verb->add_option("--position", options->position, "camera position X Y Z in metres")->expected(3);
  verb->add_option("--look-at", options->look_at, "point X Y Z that the camera looks at")->expected(3);
  verb->add_option("--fov", options->fov_deg, "vertical field of view in degrees")->check(CLI::Range(1.0, 179.0));
  verb->add_option("--seed", options->seed, "of the samples")->capture_default_str();
  verb->add_option("--error", options->error, "stop at this relative error, within --spp samples; 0: take them all")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--resume", options->resume,
                   "a file of samples: goes on with those in it, where it exists, and keeps all in it");
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
