/// loam render SCENE or WORLD: one picture, or a row of them along a camera path.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "render/effects/chain.h"
#include "render/raster/rasterizer.h"
#include "render/raster/raster.h"
#include "tools/budget.h"
#include "tools/inhabitants.h"
#include "tools/interrupt.h"
#include "tools/json_text.h"
#include "tools/light.h"
#include "tools/picture.h"
#include "tools/picture_forms.h"
#include "tools/progress.h"
#include "tools/verb.h"
#include "world/base/jobs.h"
#include "world/scenes/fog.h"
#include "world/scenes/scene_reactions.h"

namespace tools {

namespace {

constexpr const char* kUsualBackend = "raster";
constexpr const char* kFitted = "auto";  // --accuracy: what fits --budget
constexpr const char* kUsualBudget = "16ms";
constexpr int kLapFrames = 600;
constexpr int kBudgetRuns = 3;
constexpr int kMostPixelsASide = 16384;
constexpr int kFogSamples = 16;        // of a fog volume alone: 12 s of a core at 640 x 480
constexpr int kReferenceSamples = 64;  // where nothing says how many
constexpr int kMostSamples = 1 << 24;  // where an error is asked for instead

struct RenderOptions {
  std::string scene, output, backend, size = "1280x720", camera, accuracy = "usual", frames, budget;
  std::vector<std::string> settings, environment_settings;
  std::map<std::string, std::string> knobs;  // given by their own flags
  std::vector<double> position, look_at;
  std::vector<int32_t> outline;
  double fov_deg = 0, error = 0;
  uint64_t seed = 1;
  std::string resume, outputs;
  int threads = 0, sheet = 0, strip_rows = 0, ticks = 0;
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

struct Shot {
  std::string name;
  render::Camera camera;
};

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
  // auto begins with everything at its best.
  TRY(render::RenderKnobs knobs, resolve_knobs(options.accuracy == kFitted ? "exact" : options.accuracy, of_the_world,
                                               options.environment_settings, options.settings));
  if (options.backend == "reference" && !sets_knob(options, of_the_world, "spp"))
    knobs.spp = options.error > 0 ? kMostSamples : kReferenceSamples;
  if (options.backend == "raster" && knobs.spp != 1)
    return world::usage_error("--spp other than 1 needs a backend that takes samples: raycast or reference");
  return knobs;
}

/// The cheapest knobs for the budget; those that somebody has set stay as they are.
world::Result<BudgetFit> fit_knobs(const RenderOptions& options, const world::WorldView& view, render::Backend& backend,
                                   const render::Camera& camera, const render::RenderKnobs& best, int width,
                                   int height) {
  TRY(const double budget_ms, parse_budget(options.budget.empty() ? kUsualBudget : options.budget));
  std::vector<std::string> fixed;
  for (const auto& row : render::render_knobs().rows())
    if (sets_knob(options, view.world().knobs, row.name)) fixed.push_back(row.name);
  LightOfWorld light;
  return fit_to_budget(best, budget_ms, fixed, [&](const render::RenderKnobs& knobs) -> world::Result<DrawnPicture> {
    if (backend.reads_light(view.world(), knobs)) {
      TRY(backend.light, light.follow(view.world(), camera.position, knobs));
    }
    DrawnPicture drawn;
    drawn.ms = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kBudgetRuns; ++i) {  // the first makes what later ones keep
      TRY(render::Frame frame, backend.render(view, camera, knobs, width, height));
      if (i > 0) drawn.ms = std::min(drawn.ms, frame.report.ms);
      drawn.image = std::move(frame.image);
    }
    return drawn;
  });
}

/// As the block that a player points at.
world::Status outline_block(const RenderOptions& options, render::Backend& backend) {
  if (options.outline.empty()) return {};
  auto* const raster = dynamic_cast<render::RasterBackend*>(&backend);
  if (!raster) return world::usage_error("--outline needs the backend raster");
  raster->rasterizer().selected.emplace();
  raster->rasterizer().selected->low.voxel = {options.outline[0], options.outline[1], options.outline[2]};
  return {};
}

/// The rasterizer, but where the world is a fog volume, whose light paths show best; makes such a world look like fog.
world::Status choose_backend(RenderOptions& options, world::World& world) {
  const bool fog = world::is_fog(world);
  if (options.backend.empty()) options.backend = fog ? "raycast" : kUsualBackend;
  if (!fog) return {};
  if (options.backend == "raycast") {
    world.knobs.try_emplace("light_transport", "path");
    world.knobs.try_emplace("spp", std::to_string(kFogSamples));
  }
  return world::show_fog(world);
}

/// What a run has made ready: a world, what draws it and how.
struct Studio {
  const RenderOptions& options;
  const world::Scene& scene;
  world::World& world;
  render::Backend& backend;
  render::RenderKnobs knobs;
  int width, height;
  uint64_t hash;
  bool reads_light;
  LightOfWorld light;
  Progress& progress;
  const sim::Matter* matter;  // null: nothing moves in the world
  InhabitantRecords records;

  render::PictureText text(const Shot& shot) {
    render::PictureText t = picture_text(scene, shot.name, shot.camera, knobs, options.backend, hash);
    const auto tick = world.metadata.find("simulated_ticks");
    const uint64_t saved = tick == world.metadata.end() ? 0 : std::strtoull(tick->second.c_str(), nullptr, 10);
    t["tick"] = std::to_string(saved + static_cast<uint64_t>(options.ticks));
    const auto seed = world.metadata.find("seed");
    t["world_seed"] = seed == world.metadata.end() ? std::to_string(world.simulation.seed) : seed->second;
    render::Sampling& sampling = backend.sampling;
    sampling.picture = t;
    for (const char* other : {"knobs", "commit"}) sampling.picture.erase(other);  // the film has the knobs themselves
    return t;
  }

  void take_inhabitants(const Shot& shot) {
    if (!matter) return;
    records.take(*matter, shot.camera.position.voxel);
    backend.inhabitants = records.view();
  }

  world::Status follow_light(const Shot& shot) {
    if (!reads_light) return {};
    TRY(backend.light, light.follow(world, shot.camera.position, knobs));
    return {};
  }

  world::Result<render::Frame> draw(const world::WorldView& view, const Shot& shot, render::PictureText& t) {
    t = text(shot);
    take_inhabitants(shot);
    TRY(render::Frame picture, backend.render(view, shot.camera, knobs, width, height));
    if (picture.report.samples > 0) {
      t["spp"] = std::to_string(picture.report.samples);
      t["seed"] = std::to_string(options.seed);
      t["relative_error"] = fmt::format("{}", picture.report.relative_error);
    }
    return picture;
  }
};

void print_report(const std::string& path, const Studio& studio, const render::FrameReport& report) {
  std::printf("%s: %dx%d by %s on %s, %.1f ms\n", path.c_str(), studio.width, studio.height,
              studio.options.backend.c_str(), report.device.c_str(), report.ms);
  for (const render::PassReport& pass : report.passes)
    std::printf("  %-16s %8.2f ms %8llu draws %12llu bytes\n", pass.name.c_str(), pass.ms,
                static_cast<unsigned long long>(pass.draws), static_cast<unsigned long long>(pass.bytes));
  if (!studio.light.report().is_null()) std::printf("  light: %s\n", studio.light.report().dump().c_str());
  if (report.metered_ev != 0) std::printf("  automatic exposure: %+.2f EV\n", report.metered_ev);
  if (report.not_finite > 0)
    std::printf("  %llu pixels weren't finite\n", static_cast<unsigned long long>(report.not_finite));
  if (report.samples > 0)
    std::printf("  %u samples a pixel, relative error %.3g, %llu samples left out\n", report.samples,
                report.relative_error, static_cast<unsigned long long>(report.nan_samples));
}

/// The cameras of a run: of each frame, or of a sheet without frames all of the world's, or one.
world::Result<std::vector<Shot>> choose_shots(const RenderOptions& options, const world::World& world, int first,
                                              int last) {
  std::vector<Shot> shots;
  const auto path = CameraPath::of(world, options.camera);
  if (path && options.frames.empty() && options.sheet == 0)
    return std::vector<Shot>{{options.camera, path->at(path->first_frame())}};
  if (path) {
    if (options.frames.empty()) first = path->first_frame(), last = path->last_frame();
    for (int frame = first; frame <= last; ++frame)
      shots.push_back({fmt::format("{}@{}", options.camera, frame), path->at(frame)});
    return shots;
  }
  if (options.sheet > 0 && options.frames.empty() && options.camera.empty()) {
    for (const world::CameraPlacement& camera : world.cameras)
      shots.push_back({camera.name, render::Camera::from(camera)});
    if (!shots.empty()) return shots;
  }
  std::string name;
  TRY(const render::Camera start, choose_camera(options, world, name));
  if (options.frames.empty()) return std::vector<Shot>{{name, start}};
  for (int frame = first; frame <= last; ++frame)
    shots.push_back({name, camera_on_path(world, start, frame, kLapFrames)});
  return shots;
}

world::Status check_forms(const RenderOptions& options, int width, int height) {
  const bool many = !options.frames.empty() || options.sheet > 0;
  if (!options.resume.empty() && many)
    return world::usage_error("--resume keeps the samples of one picture; it doesn't go with --frames or --sheet");
  if (!options.outputs.empty() && options.sheet > 0)
    return world::usage_error("--outputs belong to one picture; they don't go with --sheet");
  const bool strips = options.strip_rows > 0 || int64_t{width} * height > kPixelsAtOnce;
  if (strips && (many || !options.outputs.empty() || !options.resume.empty()))
    return world::usage_error(fmt::format(
        "a picture of {}x{} is drawn in strips, which goes with none of --frames, --sheet, --outputs and --resume",
        width, height));
  return {};
}

/// Which of a path's frames a sheet shows: at most so many, evenly.
constexpr size_t kMostOnASheet = 64;
void thin_out(std::vector<Shot>& shots) {
  if (shots.size() <= kMostOnASheet) return;
  std::vector<Shot> some;
  for (size_t i = 0; i < kMostOnASheet; ++i) some.push_back(shots[i * (shots.size() - 1) / (kMostOnASheet - 1)]);
  shots = std::move(some);
}

world::Result<int> run_render(RenderOptions options) {
  int width = 0, height = 0, first = 0, last = 0;
  TRY_STATUS(parse_size(options.size, width, height));
  if (!options.frames.empty()) TRY_STATUS(parse_frames(options.frames, first, last));
  TRY_STATUS(check_picture_path(options.output));
  if (!options.budget.empty() && options.accuracy != kFitted)
    return world::usage_error("--budget goes with --accuracy auto");
  TRY(const std::vector<std::string> layers, parse_layers(options.outputs));
  TRY_STATUS(check_forms(options, width, height));
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
  if (options.ticks > 0) TRY_STATUS(world::add_scene_reactions(options.scene, world));
  if (options.ticks > 0) progress.stage(fmt::format("simulating {} ticks", options.ticks));
  TRY(const std::unique_ptr<sim::Matter> matter, simulate_before(world, static_cast<uint64_t>(options.ticks)));
  progress.stage("");
  if (world.store.voxel_count() == 0 && world.meshes.empty() && world.media.empty())
    std::cerr << "warning: the world is empty: there is nothing but sky to see\n";
  TRY_STATUS(choose_backend(options, world));
  TRY(const std::unique_ptr<render::Backend> backend, make_backend(options.backend));
  TRY(render::RenderKnobs knobs, choose_knobs(options, world.knobs));
  TRY_STATUS(set_time_of_day(knobs, world));
  const bool exr = std::filesystem::path(options.output).extension() == ".exr";
  if (exr) knobs = render::without_display_effects(knobs);  // radiance is kept as it is
  TRY(std::vector<Shot> shots, choose_shots(options, world, first, last));
  TRY_STATUS(outline_block(options, *backend));
  const bool reads_light = backend->reads_light(world, knobs);
  if (!reads_light && knobs.light_model != render::LightModel::none && sets_knob(options, {}, "light_model"))
    std::cerr << "light_model has no effect here: " << options.backend
              << " follows light itself and reads none of the world's\n";
  nlohmann::json fitted;
  if (options.accuracy == kFitted) {
    progress.stage("measuring what knobs cost here");
    const world::WorldView view(world);
    TRY(const BudgetFit fit, fit_knobs(options, view, *backend, shots.front().camera, knobs, width, height));
    progress.stage("");
    std::cerr << budget_text(fit);
    knobs = fit.knobs, fitted = budget_json(fit);
  }
  Studio studio{options,     scene, world,    *backend,     knobs, width, height, world.store.content_hash(),
                reads_light, {},    progress, matter.get(), {}};
  const StopOnInterrupt stop;
  render::Sampling& sampling = backend->sampling;
  sampling.seed = options.seed;
  sampling.error = options.error;
  sampling.film = options.resume;
  sampling.stop = &stop.asked();
  sampling.progress = [&](uint32_t samples, double error) {
    progress.stage(fmt::format("{} of {} samples a pixel, relative error {:.3g}", samples, knobs.spp, error));
  };
  const world::WorldView view(world);
  nlohmann::json reports = nlohmann::json::array();
  const auto report_on = [&](const render::FrameReport& report) {
    if (reports.empty())
      for (const std::string& warning : report.warnings) std::cerr << "warning: " << warning << '\n';
    reports.push_back(report_json(report, world));
    if (!studio.light.report().is_null()) reports.back()["light"] = studio.light.report();
  };
  const bool moving = !options.frames.empty();
  if (options.sheet > 0) {
    thin_out(shots);
    std::vector<render::Image> cells;
    for (const Shot& shot : shots) {
      render::PictureText unused;
      TRY_STATUS(studio.follow_light(shot));
      TRY(render::Frame picture, studio.draw(view, shot, unused));
      report_on(picture.report);
      cells.push_back(std::move(picture.image));
      progress.stage(fmt::format("picture {} of {}", cells.size(), shots.size()));
      if (stop.asked()) break;
    }
    const render::Image sheet = contact_sheet(cells, options.sheet);
    render::PictureText text = studio.text(shots.front());
    for (size_t i = 0; i < cells.size(); ++i) text[fmt::format("cell_{:03}", i)] = shots[i].name;
    TRY_STATUS(write_picture(options.output, sheet, knobs, text));
    if (!options.json) std::printf("%s: %zu pictures of %dx%d\n", options.output.c_str(), cells.size(), width, height);
  } else if (options.strip_rows > 0 || int64_t{width} * height > kPixelsAtOnce) {
    TRY_STATUS(studio.follow_light(shots.front()));
    studio.take_inhabitants(shots.front());
    TRY(const render::FrameReport report,
        write_in_strips(options.output, *backend, view, shots.front().camera, knobs, width, height, options.strip_rows,
                        studio.text(shots.front())));
    report_on(report);
    if (!options.json) print_report(options.output, studio, report);
  } else {
    for (size_t i = 0; i < shots.size() && !stop.asked(); ++i) {
      const int frame = first + static_cast<int>(i);
      if (moving) studio.knobs.grain_seed = knobs.grain_seed + frame;  // grain of film is new in each picture
      render::PictureText text;
      TRY_STATUS(studio.follow_light(shots[i]));
      TRY(const render::Frame picture, studio.draw(view, shots[i], text));
      const std::string path = moving ? frame_path(options.output, frame) : options.output;
      if (layers.empty() || !exr) TRY_STATUS(write_picture(path, picture.image, knobs, text));
      if (!layers.empty()) TRY_STATUS(write_layers(path, layers, view, shots[i].camera, knobs, picture.image, text));
      report_on(picture.report);
      if (moving) progress.stage(fmt::format("frame {} of {}..{}", frame, first, last));
      if (!options.json && !moving) print_report(path, studio, picture.report);
    }
  }
  progress.stage("");
  if (options.json) {
    nlohmann::json j = reports.front();
    j["hash"] = hash_text(studio.hash);
    if (!fitted.is_null()) j["budget"] = fitted;
    if (reports.size() > 1) j["frames"] = reports;
    std::cout << json_text(j) << '\n';
  }
  return 0;
}

}  // namespace

void add_render_verb(CommandLine& command) {
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
  verb->add_option("--camera", options->camera,
                   "a camera of the scene, or overview; or a path, whose key frames are the cameras NAME@FRAME");
  verb->add_option("--position", options->position, "camera position X Y Z in metres")->expected(3);
  verb->add_option("--look-at", options->look_at, "point X Y Z that the camera looks at")->expected(3);
  verb->add_option("--outline", options->outline, "raster: outlines the block at X Y Z")->expected(3);
  verb->add_option("--fov", options->fov_deg, "vertical field of view in degrees")->check(CLI::Range(1.0, 179.0));
  verb->add_option("--seed", options->seed, "of the samples")->capture_default_str();
  verb->add_option("--error", options->error, "stop at this relative error, within --spp samples; 0: take them all")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--resume", options->resume,
                   "a file of samples: goes on with those in it, where it exists, and keeps all in it");
  verb->add_option("--accuracy", options->accuracy,
                   "fast, usual or exact; auto: what fits --budget on this scene and machine, measured")
      ->envname("LOAM_ACCURACY")
      ->capture_default_str();
  verb->add_option("--budget", options->budget, "with --accuracy auto: the time of a picture, for instance 33ms");
  verb->add_option("--set", options->settings, "KNOB=VALUE; again for more")->take_all();
  verb->add_option("--frames", options->frames,
                   "FIRST..LAST of the path that --camera names, or of a lap of 600 frames along the scene's cameras");
  verb->add_option("--sheet", options->sheet,
                   "one picture of many, so many in a row: of --frames, of the path that --camera names, or of all "
                   "cameras; at most 64")
      ->check(CLI::Range(1, 64));
  verb->add_option("--outputs", options->outputs,
                   "depth, normal, id, separated by commas: as OUT.depth.png and so on, or channels of an EXR");
  verb->add_option("--ticks", options->ticks,
                   "simulate so many ticks of 1/20 s first: what has moved, fallen and is in the air")
      ->check(CLI::Range(0, 1 << 30));
  verb->add_option("--strip-rows", options->strip_rows,
                   "draw and write so many rows at a time; of more than 16 million pixels always done, to bound memory")
      ->check(CLI::Range(1, 16384));
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
