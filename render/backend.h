/// Three backends behind one signature: any two can be compared. A picture is linear radiance after the effects that
/// its knobs ask for (render/effects/chain.h); exposure and sRGB come after, in render/image/display.h, the same for
/// all.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
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
  // Of effects between radiance and the display.
  double metered_ev = 0;    // that automatic exposure added, beyond the knob `exposure`
  uint64_t not_finite = 0;  // pixels that held a NaN or an infinity
  // Of backends that take samples.
  uint32_t samples = 0;       // a pixel
  double relative_error = 0;  // standard error of the picture over its mean, see Film; 0: not known
  uint64_t nan_samples = 0;   // left out because they were not finite
  std::vector<EffectWork> work;
  std::vector<std::string> warnings;  // what was dropped or is not as asked for, a sentence each

  /// Adds those of another picture to its passes of the same names, and its faces.
  void add_passes(const FrameReport& other);
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

/// A particle in the air: a soft disk that faces the camera.
struct ParticleRecord {
  float x = 0, y = 0, z = 0;  // m from the corner of Inhabitants::origin
  float radius = 0.05f;       // m
  world::Ratio3 albedo{1, 1, 1};
  float opacity = 1;                                     // of its middle, 0..1
  world::Radiance3 emitted;                              // by itself, of its middle
  float velocity_x = 0, velocity_y = 0, velocity_z = 0;  // m/s: seen all along its way while the shutter is open
};
static_assert(sizeof(ParticleRecord) == 56);

/// A body: a box along the axes, matte.
struct BodyRecord {
  float x = 0, y = 0, z = 0;  // m from the corner of Inhabitants::origin to its middle
  float half_x = 0.5f, half_y = 0.5f, half_z = 0.5f;
  world::Ratio3 albedo{0.5f, 0.45f, 0.4f};
};

/// What a simulation has beside its blocks at the moment, and owns. Seen in pictures, opaque bodies first; it throws no
/// shadow. What of it mirrors show is among README's limits.
struct Inhabitants {
  world::VoxelPos origin;
  std::span<const ParticleRecord> particles;
  std::span<const BodyRecord> bodies;
  bool empty() const { return particles.empty() && bodies.empty(); }
};

/// A backend keeps what it derived from a world between pictures (extracted faces, pipelines) and follows the store's
/// changes; it belongs to one thread.
class Backend {
 public:
  virtual ~Backend() = default;
  Sampling sampling;  // read by backends that take samples
  WorldLight light;   // where reads_light()
  Inhabitants inhabitants;
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
