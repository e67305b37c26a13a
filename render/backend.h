/// Three backends behind one signature: any two can be compared. A picture is linear radiance; exposure and sRGB come
/// after, in render/image/display.h, the same for all.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "render/camera.h"
#include "render/image/image.h"
#include "render/knobs.h"
#include "world/base/errors.h"
#include "world/store/light_changes.h"
#include "world/store/light_volume.h"
#include "world/store/surface_irradiance.h"
#include "world/world.h"

namespace render {

struct PassReport {
  std::string name;
  double ms = 0;
  uint64_t draws = 0, bytes = 0;
};

/// Work done for one effect of the world; 0 where the world doesn't call for it.
struct EffectWork {
  std::string name;
  uint64_t work = 0;  // rays, samples or stretches, as the effect has them
};

struct FrameReport {
  double ms = 0;             // the whole picture
  uint64_t rays = 0;         // cast
  uint64_t faces_drawn = 0;  // quads sent to the rasterizer
  std::vector<PassReport> passes;
  std::string device;  // what drew it
  // Of backends that take samples.
  uint32_t samples = 0;       // a pixel
  double relative_error = 0;  // standard error of the picture over its mean, see Film; 0: not known
  uint64_t nan_samples = 0;   // left out because they were not finite
  std::vector<EffectWork> work;
};

struct Frame {
  Image image;
  FrameReport report;
  Image variance{};  // of one sample, by pixel and band; empty where a backend takes none
};

/// What a picture by samples is told beside its knobs.
struct Sampling {
  uint64_t seed = 1;
  double error = 0;            // stops at this relative error, checked every 16 samples; 0: at the knob spp alone
  std::filesystem::path film;  // samples so far: read where it exists, written at the end and on the way; none if empty
  std::map<std::string, std::string> picture;  // kept in the film and compared, beside all that its samples depend on
  std::function<void(uint32_t samples, double relative_error)> progress;
  const std::atomic<bool>* stop = nullptr;  // set: ends after the samples at hand, and writes the film
};

/// Light that a simulation keeps for the world of a picture, and owns; what knobs.light_model asks for must be there.
struct WorldLight {
  const world::LightVolume* levels = nullptr;            // flood4, flood_rgb
  const world::SurfaceIrradiance* irradiance = nullptr;  // flux
  uint64_t version = 0;                                  // rises with each change
  world::LightChanges* changes = nullptr;                // which leaves of levels; null: all may have, at each version
};

/// A backend keeps what it derived from a world between pictures (extracted faces, pipelines) and follows the store's
/// changes; it belongs to one thread.
class Backend {
 public:
  virtual ~Backend() = default;
  Sampling sampling;  // read by backends that take samples
  WorldLight light;   // where reads_light()
  /// Whether a picture of the world reads its light: where not, light_model has no effect and nothing need be
  /// simulated.
  virtual bool reads_light(const world::World& world, const RenderKnobs& knobs) const = 0;
  virtual world::Result<Frame> render(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                                      int width, int height) = 0;
};

struct BackendInfo {
  std::string name;
  std::string what;
  std::function<world::Result<std::unique_ptr<Backend>>()> make;  // fails with ErrorKind::no_device where it can't run
};
const std::vector<BackendInfo>& backends();

}  // namespace render
