/// Pictures of the played world on a thread of their own: the window stays alive however long a picture takes.
///
/// It draws a copy of the world, which follows the simulation by the leaves that changed: so neither waits for the
/// other. The copy costs the bytes of the world's blocks once more.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <thread>

#include "render/backend.h"
#include "render/image/error_metrics.h"
#include "tools/light.h"
#include "tools/play/eye.h"
#include "tools/play/sim_thread.h"

namespace tools {

/// Everything of a world that a picture can show.
world::World copy_of(const world::World& from);

/// Whether a knob says what there is to see, the hour and the weather, and not how it is drawn.
bool is_of_moment(std::string_view knob);
/// `to` with those knobs of `from`.
render::RenderKnobs at_moment_of(const render::RenderKnobs& from, render::RenderKnobs to);

/// What a picture is made by.
struct PictureSettings {
  std::string backend = "raster";
  render::RenderKnobs knobs;
};

enum class ViewMode { single, split, error };

struct PictureRequest {
  render::Camera camera;
  world::Environment environment;
  PictureSettings settings, other;  // `other`: right of the line of a split view, the reference of an error map
  ViewMode mode = ViewMode::single;
  double split_at = 0.5;  // part of the width, [0, 1]
  int width = 0, height = 0;
  uint64_t after_request = 0;  // of the simulation: an edit that this picture should show, if it is done soon
  bool keep_linear = false;    // the picture's values too, for a file
  std::optional<PictureSettings> measured = {};  // beside the picture: what these would cost and differ by
};

struct Picture {
  int width = 0, height = 0;
  std::vector<uint8_t> rgba;  // for the display
  render::Image linear;       // where it was asked for
  render::FrameReport report, other_report;
  double ms = 0;  // all of it
  double light_ms = 0, mirror_ms = 0, display_ms = 0;
  size_t light_bytes = 0;
  double eye_ev = 0;     // stops that the eye opened, beyond the knob
  uint64_t applied = 0;  // requests of the simulation that it shows
  uint64_t number = 0;
  std::string backend;
  std::string error;                               // no picture: one sentence; else empty
  bool device_failed = false;                      // why there is no picture: the rasterizer's device
  std::optional<render::ErrorMetrics> difference;  // of split views and error maps: settings against other
  struct Measured {
    double ms = 0;
    render::ErrorMetrics difference;  // against the reference: the same backend at its most exact
    render::ErrorMetrics now;         // of `settings`, against the same
  };
  std::optional<Measured> measured;
};

/// From 0 (the same) to 1: dark blue over grey to yellow, the same to colour-blind eyes. source: Jamie Nunez,
/// Christopher Anderton, Ryan Renslow. Optimizing colormaps with consideration for color vision deficiency. 2018
/// (cividis, at five points)
std::array<uint8_t, 3> cividis(double value);
/// Differences of the displayed codes, 0 to 64 of 255 along cividis.
render::Image8 error_map(const render::Image8& a, const render::Image8& b);

class PictureMaker {
 public:
  /// `mirror` is a copy of the simulation's world as it was before its thread began.
  PictureMaker(world::World mirror, SimThread& simulation);
  ~PictureMaker();

  /// One at a time: false where the last is still being made.
  bool begin(PictureRequest request);
  bool busy() const { return busy_; }
  /// The picture that was begun, once; waits for it at most so long.
  std::optional<Picture> take(double wait_s);

  /// Calls read(world) while nothing changes it; short work only.
  void with_world(const std::function<void(const world::World&)>& read) const;

 private:
  void run();
  Picture make(const PictureRequest& request);
  world::Result<render::Frame> frame(const PictureSettings& settings, const PictureRequest& request, Picture& picture);
  void follow(const PictureRequest& request, Picture& picture);
  void follow_inhabitants(bool stand_still);
  world::Result<render::Backend*> backend(const std::string& name);

  world::World mirror_;
  SimThread& simulation_;
  void measure(const PictureRequest& request, const render::Image& drawn, Picture& picture);

  std::map<std::string, std::unique_ptr<render::Backend>> backends_;
  LightOfWorld light_, other_light_;
  LeafValuesMap changes_;
  AmountChanges amounts_;
  InhabitantRecords inhabitants_;
  uint64_t inhabitants_number_ = 0;
  render::Inhabitants drawn_inhabitants_;
  uint64_t pictures_ = 0;
  // The reference that is measured against, and what it was made for.
  struct Reference {
    render::Image image;
    render::Camera camera;
    std::string backend;
    world::Environment environment;
    uint64_t version = 0;
    render::LightModel light_model{};
    std::array<float, 5> moment{};
    float exposure = 0;
  };
  std::optional<Reference> reference_;
  std::shared_ptr<const world::SkyLight> sky_;
  double stops_of_night_ = 0;
  Eye eye_;
  uint64_t version_ = 0;  // rises with each change of the mirror

  mutable std::shared_mutex world_mutex_;  // held alone while the mirror is changed
  std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::optional<PictureRequest> request_;
  std::optional<Picture> picture_;
  std::atomic<bool> busy_{false};
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace tools
