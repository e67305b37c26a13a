#include "render/trace/picture.h"

#include <chrono>
#include <cmath>
#include <mutex>

#include <fmt/format.h>

#include "render/trace/film.h"
#include "render/trace/photons.h"
#include "world/base/jobs.h"

namespace render {

namespace {

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

constexpr int kLargestPicture = 16384;  // pixels a side
constexpr uint32_t kPass = 16;          // samples between looks at the error
constexpr int kTile = 16;
constexpr double kFilmEveryMs = 60000;

using Integrator = Vec3d (*)(Transport&, const TraceRay&, const Sampler&);
Integrator integrator_of(LightTransport transport) {
  switch (transport) {
    case LightTransport::direct:
      return direct_radiance;
    case LightTransport::ambient_occlusion:
      return ambient_occlusion_radiance;
    case LightTransport::whitted:
      return whitted_radiance;
    case LightTransport::path:
      return path_radiance;
    case LightTransport::photons:
      return photons_radiance;
  }
  return path_radiance;
}

world::Status check(const Camera& camera, const RenderKnobs& knobs, int width, int height) {
  if (width < 1 || height < 1 || width > kLargestPicture || height > kLargestPicture)
    return world::usage_error(
        fmt::format("a picture has 1 to {} pixels a side, not {}x{}", kLargestPicture, width, height));
  const double length = glm::length(camera.forward);
  if (!(length > 0.999 && length < 1.001) || !(camera.vertical_fov > 0 && camera.vertical_fov < 3.14159))
    return world::usage_error("the camera needs a direction of length 1 and a field of view between 0 and 180 degrees");
  if (!(camera.lens_radius >= 0 && camera.lens_radius < 1e6) || !(camera.focus_distance > 0))
    return world::usage_error("the camera's lens radius must be at least 0, its focus distance above 0");
  const auto at_least = [](const char* knob, double value, double least) -> world::Status {
    if (value >= least) return {};
    return world::usage_error(fmt::format("the knob {} is {}, but must be at least {}", knob, value, least));
  };
  TRY_STATUS(at_least("spp", knobs.spp, 1));
  TRY_STATUS(at_least("max_depth", knobs.max_depth, 0));
  TRY_STATUS(at_least("light_samples", knobs.light_samples, 1));
  TRY_STATUS(at_least("photons", knobs.photons, 1));
  TRY_STATUS(at_least("occlusion_distance", knobs.occlusion_distance, 0));
  return at_least("photon_radius", knobs.photon_radius, 1e-6);
}

std::vector<EffectWork> work_of(const TraceCounts& c) {
  return {{"camera_rays", c.camera_rays},      {"scattered_rays", c.scattered_rays},
          {"shadow_rays", c.shadow_rays},      {"photon_rays", c.photon_rays},
          {"meshes", c.mesh_queries},          {"media", c.media_intervals},
          {"luminaires", c.luminaire_samples}, {"block_light", c.block_light_samples},
          {"transmission", c.transmissions}};
}

class Picture {
 public:
  Picture(const TransportScene& shared, const Camera& camera, uint64_t seed, Film& film)
      : shared_(shared),
        camera_(camera),
        rays_(camera, film.width(), film.height()),
        seed_(seed),
        film_(film),
        integrator_(integrator_of(shared.knobs.light_transport)),
        around_(Tracer(*shared.scene).around(camera.position)) {}

  /// Samples [begin, end) of every pixel.
  void take(uint32_t begin, uint32_t end) {
    if (shared_.knobs.light_transport != LightTransport::photons) return pass(begin, end);
    for (uint32_t sample = begin; sample < end; ++sample) {
      const PhotonMap photons = PhotonMap::trace(shared_, seed_, sample, counts);
      shared_.photons = &photons;
      pass(sample, sample + 1);
    }
  }

  TraceCounts counts;

 private:
  void pass(uint32_t begin, uint32_t end) {
    const size_t columns = tiles(film_.width()), rows = tiles(film_.height());
    world::parallel_for(columns * rows, [&](size_t tile) {
      Transport transport(shared_);
      const int x0 = static_cast<int>(tile % columns) * kTile, y0 = static_cast<int>(tile / columns) * kTile;
      for (int y = y0; y < std::min(y0 + kTile, film_.height()); ++y)
        for (int x = x0; x < std::min(x0 + kTile, film_.width()); ++x)
          for (uint32_t s = begin; s < end; ++s) film_.at(x, y).add(sample(transport, x, y, s));
      const std::lock_guard lock(adding_);
      counts.add(transport.tracer.counts);
    });
    film_.samples = end;
  }

  static size_t tiles(int pixels) { return static_cast<size_t>((pixels + kTile - 1) / kTile); }

  Vec3d sample(Transport& transport, int x, int y, uint32_t index) const {
    const RenderKnobs& knobs = shared_.knobs;
    const Sampler sampler(knobs.sample_sequence, seed_, static_cast<uint32_t>(x), static_cast<uint32_t>(y), index);
    TraceRay ray;
    // One sample of an integrator that needs none but the pixel's looks where the other backends look.
    const bool centre =
        knobs.spp == 1 && (integrator_ == direct_radiance || integrator_ == ambient_occlusion_radiance ||
                           integrator_ == whitted_radiance);
    ray.ray = camera_ray(camera_, rays_, x, y, sampler, centre);
    const double length = glm::length(ray.ray.direction);
    ray.ray.direction /= length;
    ray.ray.t_max = knobs.view_distance;
    ray.around = around_;
    return integrator_(transport, ray, sampler);
  }

  TransportScene shared_;
  const Camera& camera_;
  const PixelRays rays_;
  const uint64_t seed_;
  Film& film_;
  const Integrator integrator_;
  const MeshesAround around_;
  std::mutex adding_;
};

}  // namespace

world::GridRay camera_ray(const Camera& camera, const PixelRays& rays, int x, int y, const Sampler& sampler,
                          bool centre) {
  const glm::vec2 jitter = centre ? glm::vec2(0.5f) : sampler.two(kPixelDimension);
  const Vec3d direction = rays.direction(x + double{jitter.x}, y + double{jitter.y});
  if (!(camera.lens_radius > 0)) return world::GridRay(camera.position, direction);
  // A point of the lens, uniform over its disk; what it sees of the plane in focus is what the centre sees there.
  const glm::vec2 u = sampler.two(kLensDimension);
  const double r = camera.lens_radius * std::sqrt(double{u.x}), angle = 2 * 3.14159265358979323846 * double{u.y};
  const Vec3d on_lens = r * std::cos(angle) * rays.right + r * std::sin(angle) * rays.up;
  return world::GridRay(camera.position + on_lens, direction - on_lens / camera.focus_distance);
}

world::Result<Frame> trace_picture(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                                   const Sampling& sampling, int width, int height) {
  TRY_STATUS(check(camera, knobs, width, height));
  const Clock::time_point start = Clock::now();
  TRY(const TraceScene scene, TraceScene::build(view));
  const LightSet lights = LightSet::build(scene, knobs.light_transport == LightTransport::photons);
  const double prepare_ms = ms_since(start);

  Film film(width, height);
  std::map<std::string, std::string> key = sampling.picture;
  key["seed"] = std::to_string(sampling.seed);
  for (const auto& row : render_knobs().rows())
    if (row.name != "spp" && row.name != "exposure") key["knob " + row.name] = row.get(knobs);
  std::error_code ignored;
  if (!sampling.film.empty() && std::filesystem::exists(sampling.film, ignored)) {
    TRY(film, Film::load(sampling.film, width, height, key));
  }

  const TransportScene shared{&scene, &lights, knobs};
  Picture picture(shared, camera, sampling.seed, film);
  Clock::time_point saved = Clock::now();
  const uint32_t wanted = static_cast<uint32_t>(knobs.spp);
  while (film.samples < wanted) {
    // Passes end at multiples of kPass, so that a picture that goes on looks at its error where one that never stopped
    // would.
    const uint32_t end = std::min(wanted, (film.samples / kPass + 1) * kPass);
    picture.take(film.samples, end);
    const double error = film.relative_error();
    if (sampling.progress) sampling.progress(film.samples, error);
    if (sampling.stop && *sampling.stop) break;
    if (sampling.error > 0 && film.samples % kPass == 0 && error <= sampling.error) break;
    if (!sampling.film.empty() && ms_since(saved) > kFilmEveryMs) {
      TRY_STATUS(film.save(sampling.film, key));
      saved = Clock::now();
    }
  }
  if (!sampling.film.empty()) TRY_STATUS(film.save(sampling.film, key));

  Frame frame{film.mean(), {}, film.variance()};
  FrameReport& report = frame.report;
  report.ms = ms_since(start);
  report.rays = picture.counts.rays();
  report.passes = {{"prepare", prepare_ms, 0, scene.bytes() + lights.bytes()},
                   {std::string(knob_choices(LightTransport{})[static_cast<size_t>(knobs.light_transport)]),
                    report.ms - prepare_ms}};
  report.device = fmt::format("CPU, {} thread{}", world::thread_count(), world::thread_count() == 1 ? "" : "s");
  report.samples = film.samples;
  report.relative_error = film.samples > 1 ? film.relative_error() : 0;
  report.nan_samples = film.rejected();
  report.work = work_of(picture.counts);
  return frame;
}

}  // namespace render
