#include "tools/picture.h"

#include <filesystem>

#include <fmt/format.h>

#include "commit.h"
#include "render/image/display.h"
#include "render/sky_view.h"
#include "render/light_files.h"
#include "tools/knob_settings.h"
#include "world/scenes/effects.h"

namespace tools {

using world::usage_error;

namespace {

bool has_extension(const std::string& path, const char* extension) {
  std::string have = std::filesystem::path(path).extension().string();
  for (char& c : have) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return have == extension;
}

world::Vec3d spline(const world::Vec3d& a, const world::Vec3d& b, const world::Vec3d& c, const world::Vec3d& d,
                    double t) {
  // Catmull and Rom. A Class of Local Interpolating Splines. 1974: passes b at t = 0 and c at t = 1.
  return 0.5 *
         (2.0 * b + (c - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t + (3.0 * (b - c) + d - a) * t * t * t);
}

}  // namespace

world::Result<render::RenderKnobs> resolve_knobs(const std::string& accuracy,
                                                 const std::map<std::string, std::string>& of_the_world,
                                                 const std::vector<std::string>& environment_settings,
                                                 const std::vector<std::string>& flag_settings) {
  TRY(const world::Accuracy preset, world::accuracy_from_name(accuracy));
  render::RenderKnobs knobs = render::render_knobs().preset(preset);
  for (const auto& [name, value] : of_the_world) {
    const world::Status set = render::render_knobs().set(knobs, name, value);
    if (!set.ok()) return world::input_error("the scene's knobs: " + set.error().message);
  }
  TRY_STATUS(set_knobs(render::render_knobs(), knobs, environment_settings));
  TRY_STATUS(set_knobs(render::render_knobs(), knobs, flag_settings));
  return knobs;
}

world::Result<std::unique_ptr<render::Backend>> make_backend(const std::string& name) {
  std::string known;
  for (const render::BackendInfo& info : render::backends()) {
    if (info.name == name) return info.make();
    known += (known.empty() ? "" : ", ") + info.name;
  }
  return usage_error("there is no backend \"" + name + "\"; the backends are: " + known);
}

world::Result<world::World> build_picture_world(const world::Scene& scene, world::ImportReport& report) {
  TRY(world::World world, world::build_world(scene, report));
  TRY_STATUS(render::load_light_files(world));
  return world;
}

world::Status set_time_of_day(const render::RenderKnobs& knobs, world::World& world) {
  std::shared_ptr<const world::SkyLight> made;
  TRY(const render::SkyView sky, render::sky_view(world.environment, knobs, made));
  world.environment = sky.environment;
  return {};
}

render::PictureText picture_text(const world::Scene& scene, const std::string& camera_name,
                                 const render::Camera& camera, const render::RenderKnobs& knobs,
                                 const std::string& backend, uint64_t world_hash) {
  std::string settings;
  for (const auto& row : render::render_knobs().rows())
    settings += (settings.empty() ? "" : " ") + row.name + "=" + row.get(knobs);
  const auto& p = camera.position;
  return {{"scene", scene.name},
          {"camera", camera_name},
          {"camera_voxel", fmt::format("{} {} {}", p.voxel.x, p.voxel.y, p.voxel.z)},
          {"camera_fraction", fmt::format("{} {} {}", p.fraction.x, p.fraction.y, p.fraction.z)},
          {"camera_forward", fmt::format("{} {} {}", camera.forward.x, camera.forward.y, camera.forward.z)},
          {"camera_vertical_fov", fmt::format("{}", camera.vertical_fov)},
          {"knobs", settings},
          {"backend", backend},
          {"commit", LOAM_COMMIT},
          {"world_hash", hash_text(world_hash)}};
}

world::Status check_picture_path(const std::string& path) {
  if (has_extension(path, ".png") || has_extension(path, ".exr")) return {};
  return usage_error(path + ": pictures are written as .png or .exr");
}

world::Status write_picture(const std::string& path, const render::Image& image, const render::RenderKnobs& knobs,
                            const render::PictureText& text) {
  TRY_STATUS(check_picture_path(path));
  if (has_extension(path, ".exr")) return render::write_exr(path, image, text);
  return render::write_png(path, render::display_image(image, knobs.exposure), text);
}

nlohmann::json report_json(const render::FrameReport& report, const world::World& world) {
  nlohmann::json j{
      {"ms", report.ms}, {"rays", report.rays}, {"faces_drawn", report.faces_drawn}, {"device", report.device}};
  j["passes"] = nlohmann::json::array();
  for (const render::PassReport& pass : report.passes)
    j["passes"].push_back({{"name", pass.name}, {"ms", pass.ms}, {"draws", pass.draws}, {"bytes", pass.bytes}});
  if (!report.warnings.empty()) j["warnings"] = report.warnings;
  if (report.metered_ev != 0) j["metered_ev"] = report.metered_ev;
  if (report.not_finite > 0) j["not_finite"] = report.not_finite;
  if (report.samples > 0) {
    j["spp"] = report.samples;
    j["relative_error"] = report.relative_error;
    j["nan_samples"] = report.nan_samples;
  }
  if (!report.work.empty()) {
    j["work"] = nlohmann::json::object();
    for (const render::EffectWork& effect : report.work) j["work"][effect.name] = effect.work;
  }
  j["effects"] = nlohmann::json::array();
  for (const world::EffectCall& effect : world::called_effects(world))
    j["effects"].push_back({{"name", effect.name}, {"called_for", effect.called_for}, {"why", effect.why}});
  return j;
}

render::Camera camera_on_path(const world::World& world, const render::Camera& start, int frame, int frames) {
  const double turn = static_cast<double>(frame % frames) / frames;
  const size_t n = world.cameras.size();
  render::Camera camera = start;
  if (n < 2) {
    const world::VoxelBox box = world.store.bounds();
    if (box.empty()) return camera;
    const world::WorldPoint corner{box.min, world::Vec3d(0.0)};
    const world::WorldPoint middle = corner + 0.5 * (world::WorldPoint{box.max, world::Vec3d(1.0)} - corner);
    const auto around = [&](const world::Vec3d& v) {
      const double a = turn * 2 * 3.14159265358979323846, c = std::cos(a), s = std::sin(a);
      return world::Vec3d(c * v.x + s * v.z, v.y, c * v.z - s * v.x);
    };
    camera.position = middle + around(start.position - middle);
    camera.forward = around(start.forward);
    return camera;
  }
  const double at = turn * static_cast<double>(n);
  const size_t leg = static_cast<size_t>(at);
  const auto key = [&](size_t i) -> const world::CameraPlacement& { return world.cameras[(leg + n + i - 1) % n]; };
  const world::WorldPoint base = key(1).position;
  const auto offset = [&](size_t i) { return key(i).position - base; };
  const double t = at - static_cast<double>(leg);
  camera.position = base + spline(offset(0), offset(1), offset(2), offset(3), t);
  const world::Vec3d forward = spline(key(0).forward, key(1).forward, key(2).forward, key(3).forward, t);
  if (glm::length(forward) > 1e-6) camera.forward = glm::normalize(forward);
  return camera;
}

std::string hash_text(uint64_t hash) { return fmt::format("{:016x}", hash); }

}  // namespace tools
