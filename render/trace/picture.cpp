#include "render/trace/picture.h"

#include <chrono>
#include <cmath>
#include <mutex>

#include <fmt/format.h>

#include "render/effects/chain.h"
#include "render/knob_ranges.h"
#include "render/light/light_cells.h"
#include "render/see_through.h"
#include "render/trace/film.h"
#include "render/textures/texture_set.h"
#include "render/trace/photons.h"
#include "world/base/jobs.h"

namespace render {

namespace {

/// Samples are as sharp as if so many lay side by side in a pixel, however many there will be: else a picture that goes
/// on from fewer would not be the one taken at once.
constexpr double kSamplesAcross = 4;

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

constexpr int kLargestPicture = 16384;  // pixels a side
constexpr uint32_t kPass = 16;          // samples between looks at the error
constexpr int kTile = 16;
constexpr double kFilmEveryMs = 60000;

world::Status check(const Camera& camera, const RenderKnobs& knobs, int width, int height) {
  if (width < 1 || height < 1 || width > kLargestPicture || height > kLargestPicture)
    return world::usage_error(
        fmt::format("a picture has 1 to {} pixels a side, not {}x{}", kLargestPicture, width, height));
  const double length = glm::length(camera.forward);
  if (!(length > 0.999 && length < 1.001) || !(camera.vertical_fov > 0 && camera.vertical_fov < 3.14159))
    return world::usage_error("the camera needs a direction of length 1 and a field of view between 0 and 180 degrees");
  if (!(camera.lens_radius >= 0 && camera.lens_radius < 1e6) || !(camera.focus_distance > 0))
    return world::usage_error("the camera's lens radius must be at least 0, its focus distance above 0");
  return check_ranges(knobs);
}

std::vector<EffectWork> work_of(const TraceCounts& c) {
  return {{"camera_rays", c.camera_rays},      {"scattered_rays", c.scattered_rays},
          {"shadow_rays", c.shadow_rays},      {"photon_rays", c.photon_rays},
          {"meshes", c.mesh_queries},          {"media", c.media_intervals},
          {"luminaires", c.luminaire_samples}, {"block_light", c.block_light_samples},
          {"transmission", c.transmissions}};
}

/// Gathers what a film's samples depend on into one number.
class Fingerprint {
 public:
  template <class... Values>
  void add(const Values&... values) {
    (add_one(values), ...);
  }
  std::string text() const { return fmt::format("{:016x}", hash_); }

 private:
  void add_one(const std::string& text) { add_bytes(text.data(), text.size()); }
  template <class T>
  requires std::is_arithmetic_v<T>
  void add_one(const T& value) { add_bytes(&value, sizeof value); }
  void add_one(const Vec3f& v) { add(v.x, v.y, v.z); }
  void add_one(const Vec3d& v) { add(v.x, v.y, v.z); }
  void add_one(const glm::vec2& v) { add(v.x, v.y); }
  template <class U>
  void add_one(const world::Bands3<U>& v) {
    add(v.r, v.g, v.b);
  }
  void add_one(const shared::DrawnBox& b) { add_bytes(&b, sizeof b); }
  void add_one(const world::WorldPoint& p) { add(p.voxel.x, p.voxel.y, p.voxel.z, p.fraction); }
  void add_bytes(const void* data, size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (size_t i = 0; i < size; ++i) hash_ = world::hash_combine(hash_, bytes[i]);
    hash_ = world::hash_combine(hash_, size);
  }
  uint64_t hash_ = 0;
};

std::string fingerprint(const world::World& w, const Camera& c, std::span<const shared::DrawnBox> bodies) {
  Fingerprint f;
  for (const shared::DrawnBox& b : bodies) f.add(b);
  f.add(c.position, c.forward, c.vertical_fov, c.lens_radius, c.focus_distance);
  const PictureWindow& window = c.window;
  if (window != PictureWindow{}) f.add(window.x, window.y, window.whole_width, window.whole_height);
  f.add(w.store.content_hash());
  for (size_t id = 0; id < w.palette->size(); ++id)
    f.add(world::toml_from_block((*w.palette)[static_cast<world::BlockId>(id)]));
  const world::Environment& e = w.environment;
  f.add(e.sun_direction, e.sun_irradiance, e.sky_zenith, e.sky_horizon, e.sky_ground);
  const world::Clouds& clouds = e.clouds;
  if (clouds.cover > 0)
    f.add(clouds.cover, clouds.height, clouds.thickness, clouds.size, clouds.extinction, clouds.drifted, clouds.seed);
  for (const world::Luminaire& l : w.luminaires) {
    f.add(l.kind, l.position, l.axis, l.up, l.power, l.irradiance, l.radiance, l.extent, l.radius, l.half_angle,
          l.inner_half_angle, l.attenuation, l.at_infinity, l.whole_sphere, l.uniform_area, l.lambertian, l.glossy,
          l.global_illumination, l.shadows, l.enabled, l.visible);
    if (l.light_image)
      for (const world::Radiance3& p : l.light_image->pixels) f.add(p);
    for (const Vec3f& corner : l.triangles) f.add(corner);
  }
  for (const world::Medium& m : w.media) {
    f.add(m.name, m.kind, m.absorption, m.scattering, m.anisotropy, m.emission, m.position, m.half_extent, m.normal,
          m.scale_height, m.voxel_size, static_cast<int>(m.sampling));
    // A density grid is known by its size and by what it holds along a diagonal.
    Vec3d low(0), high(0);
    if (m.field) m.field->bounds(low, high), f.add(low, high, m.field->max());
    for (int i = 0; m.field && i < 256; ++i) f.add(m.field->density(low + (high - low) * ((i + 0.5) / 256)));
  }
  for (const world::MeshInstance& m : w.meshes) {
    f.add(m.position, m.transform[0], m.transform[1], m.transform[2], m.block_id, m.null_surface, m.interior_medium,
          m.radiance, m.smooth, m.checker_id, m.checkers);
    for (const Vec3f& p : m.mesh->positions) f.add(p);
    f.add(m.mesh->triangles.size());
  }
  return f.text();
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
    // By the pixel of the whole picture, so that tiles of it don't repeat one pattern.
    const auto pixel = [](int at, double first) { return static_cast<uint32_t>(at + static_cast<int>(first)); };
    const Sampler sampler(knobs.sample_sequence, seed_, pixel(x, camera_.window.x), pixel(y, camera_.window.y), index);
    TraceRay ray;
    // One sample of an integrator that needs none but the pixel's looks where the other backends look.
    const bool centre =
        knobs.spp == 1 && (integrator_ == direct_radiance || integrator_ == ambient_occlusion_radiance ||
                           integrator_ == whitted_radiance);
    ray.ray = camera_ray(camera_, rays_, x, y, sampler, centre);
    const double length = glm::length(ray.ray.direction);
    ray.ray.direction /= length;
    // Of several samples each stands for its part of the pixel.
    const double part = 1 / (length * (knobs.spp == 1 ? 1.0 : kSamplesAcross));
    transport.pixel_x = Vec3f(rays_.step_x * part), transport.pixel_y = Vec3f(rays_.step_y * part);
    transport.column = static_cast<uint32_t>(x), transport.row = static_cast<uint32_t>(y);
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

/// Of transports that ask luminaires one by one, where there are more than a few. The knob's share is that of all that
/// is left out together, so that ten thousand dim ones aren't lost (hard case L17); where the lists would be too long
/// for that, of each, as it is for the rasterizer.
world::Result<std::optional<LightCells>> light_cells(const TraceScene& scene, const RenderKnobs& knobs) {
  const bool one_by_one = knobs.light_transport == LightTransport::direct ||
                          knobs.light_transport == LightTransport::ambient_occlusion ||
                          knobs.light_transport == LightTransport::whitted;
  if (!one_by_one || scene.luminaires().size() <= LightCells::kFew || knobs.luminaire_cutoff == 0)
    return std::optional<LightCells>();
  std::vector<LightCells::Light> lights;
  for (const SceneLuminaire& s : scene.luminaires()) {
    TRY(const world::LuminaireTables tables, world::luminaire_tables(*s.luminaire));
    lights.push_back(LightCells::light_of(*s.luminaire, tables));
  }
  const double share = LightCells::cutoff_of(knobs.luminaire_cutoff, knobs.exposure);
  LightCells together = LightCells::make(lights, share / static_cast<double>(lights.size()));
  if (together.cutoff() <= share) return std::optional(std::move(together));
  return std::optional(LightCells::make(lights, share));
}

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
                                   const Sampling& sampling, int width, int height,
                                   std::span<const shared::DrawnBox> bodies, const WorldLitSource* source) {
  TRY_STATUS(check(camera, knobs, width, height));
  const Clock::time_point start = Clock::now();
  std::shared_ptr<const world::SkyLight> made;
  TRY(const SkyView sky, sky_view(view, knobs, made, camera.position));
  // Paths follow what fog scatters themselves.
  const FogLight fog = knobs.light_transport == LightTransport::path ? FogLight::none : knobs.fog_light;
  TRY(const TraceScene scene, TraceScene::build(view, static_cast<uint32_t>(knobs.gloss_lobe), sky, knobs, fog));
  TextureSet textures;
  TRY_STATUS(textures.follow(view.palette(), knobs));
  const LightSet lights = LightSet::build(scene, knobs.light_transport == LightTransport::photons);
  TRY(const std::optional<LightCells> cells, light_cells(scene, knobs));
  const double prepare_ms = ms_since(start);

  Film film(width, height);
  std::map<std::string, std::string> key = sampling.picture;  // what the film's samples depend on
  key["seed"] = std::to_string(sampling.seed);
  if (source) key["light"] = "of the world";
  if (!sampling.film.empty()) key["content"] = fingerprint(view.world(), camera, bodies);
  const RenderKnobs of_samples = without_effects(knobs);  // the rest comes after the samples
  for (const auto& row : render_knobs().rows())
    if (row.name != "spp" && row.name != "exposure") key["knob " + row.name] = row.get(of_samples);
  std::error_code ignored;
  if (!sampling.film.empty() && std::filesystem::exists(sampling.film, ignored)) {
    TRY(film, Film::load(sampling.film, width, height, key));
  }

  const SeeThroughKinds kinds(view.palette());
  const bool any = kinds.called_for(view.store().census());
  const bool straight = any && knobs.transparency != Transparency::opaque;
  std::optional<WorldLit> lit;
  if (source) lit.emplace(*source, view, sky, knobs);
  const TransportScene of_threads{&scene,
                                  &lights,
                                  knobs,
                                  textures.empty() ? nullptr : &textures,
                                  nullptr,
                                  straight ? &kinds : nullptr,
                                  TracedBodies(bodies, camera.position),
                                  lit ? &*lit : nullptr,
                                  any && tints_sun(knobs) ? &kinds : nullptr,
                                  cells ? &*cells : nullptr};
  Picture picture(of_threads, camera, sampling.seed, film);
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
