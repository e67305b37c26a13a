/// One point of a scene for each pixel of a small picture, and what any integrator says of it: for subjects that
/// compare lights and shadows without the noise of pixels' edges.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "render/backend.h"
#include "render/camera.h"
#include "render/trace/transport.h"
#include "tools/bench/benchmark.h"
#include "world/scenes/scene.h"

namespace tools {

/// Rays through the centres of pixels, those whose first surface scatters, and lets nothing through: water and glass
/// show other things than light that comes straight. Owns its world.
class SightLines {
 public:
  /// The scene's first camera.
  static Result<std::shared_ptr<const SightLines>> make(const world::Scene& scene, int width, int height);

  /// Radiance by line, the mean of `samples` calls, on all threads that loops are held to. `light_transport`: in place
  /// of the knobs'.
  std::vector<world::Vec3d> radiance(render::LightTransport light_transport, render::RenderKnobs knobs, int samples,
                                     uint64_t seed) const;
  size_t size() const { return lines_.size(); }
  /// The same lines as a backend draws them, one ray a pixel.
  Result<std::vector<world::Vec3d>> picture(render::Backend& backend, const render::RenderKnobs& knobs) const;
  /// The same by a raycast backend of its own, with the light that the knobs ask for: a call is one picture, and the
  /// first makes what later ones find.
  std::function<std::vector<world::Vec3d>()> raycaster(const render::RenderKnobs& knobs) const;
  /// Its first picture.
  std::vector<world::Vec3d> raycast(const render::RenderKnobs& knobs) const { return raycaster(knobs)(); }
  const world::World& world() const { return world_; }
  const render::Camera& camera() const { return camera_; }

 private:
  struct Line {
    render::TraceRay ray;
    uint32_t x = 0, y = 0;
  };
  explicit SightLines(world::World world) : world_(std::move(world)), view_(world_) {}

  world::World world_;
  world::WorldView view_;
  std::unique_ptr<const render::TraceScene> scene_;
  std::unique_ptr<const render::LightSet> lights_;
  std::vector<Line> lines_;
  render::Camera camera_;
  int width_ = 0, height_ = 0;
};

/// The truth of lines as two halves of `samples` each, by path tracing with at most `scatterings`.
struct LineHalves {
  std::vector<world::Vec3d> a, b;
  double mean = 0;
};
LineHalves line_halves(const SightLines& lines, render::RenderKnobs knobs, int scatterings, int samples, uint64_t seed);

/// Over the mean of the truth: the root mean square error over lines and bands, whose mean is free of the halves'
/// noise; and the mean error.
double relative_rms(const std::vector<world::Vec3d>& seen, const LineHalves& truth);
double relative_bias(const std::vector<world::Vec3d>& seen, const LineHalves& truth);
/// What relative_rms is of the truth itself: the standard error of its mean square, as an error. 0 of equal halves.
double relative_noise(const LineHalves& truth);
/// RMS error, the median of the lines' errors, bias and noise floor; and the metrics' names.
ErrorSample line_errors(const std::vector<world::Vec3d>& seen, const LineHalves& truth);
std::vector<std::string> line_metrics();

}  // namespace tools
