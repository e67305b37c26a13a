#include "tools/bench/sight_lines.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tools/bench/reference_cache.h"
#include "tools/light.h"
#include "tools/picture.h"
#include "world/base/jobs.h"
#include "world/base/random.h"

namespace tools {

using world::Vec3d;

namespace {

constexpr size_t kLinesAtOnce = 32;

double sum_of(const Vec3d& v) { return v.x + v.y + v.z; }

}  // namespace

Result<std::shared_ptr<const SightLines>> SightLines::make(const world::Scene& scene, int width, int height) {
  world::ImportReport report;
  TRY(world::World made, build_picture_world(scene, report));
  std::shared_ptr<SightLines> lines(new SightLines(std::move(made)));
  TRY(render::TraceScene traced, render::TraceScene::build(lines->view_));
  lines->scene_ = std::make_unique<const render::TraceScene>(std::move(traced));
  lines->lights_ = std::make_unique<const render::LightSet>(render::LightSet::build(*lines->scene_));
  TRY(const world::CameraPlacement placement, world::camera_of(lines->world_, ""));
  const render::Camera camera = render::Camera::from(placement);
  lines->camera_ = camera, lines->width_ = width, lines->height_ = height;
  const render::PixelRays pixels(camera, width, height);
  render::Tracer tracer(*lines->scene_);
  std::vector<render::Crossing> crossings;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Line line{{}, static_cast<uint32_t>(x), static_cast<uint32_t>(y)};
      line.ray.ray = world::GridRay(camera.position, glm::normalize(pixels.direction(x + 0.5, y + 0.5)));
      line.ray.around = tracer.around(camera.position);
      const render::Surface met = tracer.intersect(line.ray, crossings);
      if (!met.hit() || met.kind == render::SurfaceKind::luminaire) continue;
      const render::TraceScene::Material& material = lines->scene_->materials()[met.block];
      if (material.finite && !material.transmits) lines->lines_.push_back(line);
    }
  if (lines->lines_.empty())
    return world::input_error("the camera of scene " + scene.name + " sees no surface that scatters");
  return std::shared_ptr<const SightLines>(std::move(lines));
}

std::vector<Vec3d> SightLines::radiance(render::LightTransport light_transport, render::RenderKnobs knobs, int samples,
                                        uint64_t seed) const {
  knobs.light_transport = light_transport;
  const render::Integrator integrator = render::integrator_of(light_transport);
  std::vector<Vec3d> means(lines_.size());
  const render::TransportScene shared{scene_.get(), lights_.get(), knobs};
  world::parallel_ranges(lines_.size(), kLinesAtOnce, [&](size_t begin, size_t end) {
    render::Transport transport(shared);
    for (size_t i = begin; i < end; ++i) {
      Vec3d sum(0);
      for (int s = 0; s < samples; ++s)
        sum += integrator(
            transport, lines_[i].ray,
            render::Sampler(knobs.sample_sequence, seed, lines_[i].x, lines_[i].y, static_cast<uint32_t>(s)));
      means[i] = sum / double(samples);
    }
  });
  return means;
}

Result<std::vector<Vec3d>> SightLines::picture(render::Backend& backend, const render::RenderKnobs& knobs) const {
  TRY(const render::Frame frame, backend.render(view_, camera_, knobs, width_, height_));
  std::vector<Vec3d> seen;
  seen.reserve(lines_.size());
  for (const Line& line : lines_) {
    const render::Rgb c = frame.image.at(static_cast<int>(line.x), static_cast<int>(line.y));
    seen.emplace_back(c.r, c.g, c.b);
  }
  return seen;
}

std::function<std::vector<Vec3d>()> SightLines::raycaster(const render::RenderKnobs& knobs) const {
  auto backend = make_backend("raycast");
  CHECK(backend.ok());
  const auto light = std::make_shared<LightOfWorld>();
  auto made = light->follow(world_, camera_.position, knobs);
  CHECK(made.ok());
  (*backend)->light = *made;
  return [this, knobs, light, backend = std::shared_ptr<render::Backend>(std::move(*backend))] {
    auto seen = picture(*backend, knobs);
    CHECK(seen.ok());
    return std::move(*seen);
  };
}

LineHalves line_halves(const SightLines& lines, render::RenderKnobs knobs, int scatterings, int samples,
                       uint64_t seed) {
  knobs.max_depth = scatterings;
  knobs.sample_sequence = render::SampleSequence::sobol;
  // One sample of it is a fingerprint of world, camera, knobs and code.
  const auto radiance = [&](int count, uint64_t salt) {
    return lines.radiance(render::LightTransport::path, knobs, count, world::hash_combine(seed, salt));
  };
  uint64_t key = world::hash_combine(world::hash_combine(seed, static_cast<uint64_t>(samples)),
                                     static_cast<uint64_t>(scatterings));
  for (const Vec3d& v : radiance(1, 0xf))
    for (int c = 0; c < 3; ++c) key = world::hash_combine(key, std::bit_cast<uint64_t>(v[c]));
  const std::vector<double> kept = cached_reference(key, 6 * lines.size(), [&] {
    std::vector<double> values;
    values.reserve(6 * lines.size());
    for (const uint64_t salt : {0xa, 0xb})
      for (const Vec3d& v : radiance(samples, salt)) values.insert(values.end(), {v.x, v.y, v.z});
    return values;
  });
  LineHalves halves;
  for (size_t i = 0; i < lines.size(); ++i) {
    const double* const a = &kept[3 * i];
    const double* const b = &kept[3 * (lines.size() + i)];
    halves.a.emplace_back(a[0], a[1], a[2]);
    halves.b.emplace_back(b[0], b[1], b[2]);
  }
  for (size_t i = 0; i < halves.a.size(); ++i) halves.mean += sum_of(halves.a[i]) + sum_of(halves.b[i]);
  halves.mean /= 6.0 * static_cast<double>(halves.a.size());
  return halves;
}

double relative_rms(const std::vector<Vec3d>& seen, const LineHalves& truth) {
  double sum = 0;
  for (size_t i = 0; i < seen.size(); ++i) sum += glm::dot(seen[i] - truth.a[i], seen[i] - truth.b[i]);
  return std::sqrt(std::max(sum, 0.0) / (3.0 * static_cast<double>(seen.size()))) / truth.mean;
}

double relative_bias(const std::vector<Vec3d>& seen, const LineHalves& truth) {
  double sum = 0;
  for (size_t i = 0; i < seen.size(); ++i) sum += sum_of(seen[i]) - 0.5 * (sum_of(truth.a[i]) + sum_of(truth.b[i]));
  return sum / (3.0 * static_cast<double>(seen.size())) / truth.mean;
}

double relative_noise(const LineHalves& truth) {
  double sum = 0;
  for (size_t i = 0; i < truth.a.size(); ++i) {
    const double variance = glm::dot(truth.a[i] - truth.b[i], truth.a[i] - truth.b[i]) / 2;
    sum += variance * variance;
  }
  return std::sqrt(std::sqrt(sum) / (3.0 * static_cast<double>(truth.a.size()))) / truth.mean;
}

ErrorSample line_errors(const std::vector<Vec3d>& seen, const LineHalves& truth) {
  std::vector<double> errors;
  for (size_t i = 0; i < seen.size(); ++i)
    errors.push_back(glm::length(seen[i] - 0.5 * (truth.a[i] + truth.b[i])) / std::sqrt(3.0) / truth.mean);
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  return {{relative_rms(seen, truth), errors[errors.size() / 2]}, relative_bias(seen, truth), relative_noise(truth)};
}

std::vector<std::string> line_metrics() {
  return {"RMS error of radiance (relative)", "median error of a point (relative)"};
}

}  // namespace tools
