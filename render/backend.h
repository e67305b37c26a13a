/// Three backends behind one signature: any two can be compared. A picture is linear radiance; exposure and sRGB come
/// after, in render/image/display.h, the same for all.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "render/camera.h"
#include "render/image/image.h"
#include "render/knobs.h"
#include "world/base/errors.h"
#include "world/world.h"

namespace render {

struct PassReport {
  std::string name;
  double ms = 0;
  uint64_t draws = 0, bytes = 0;
};

struct FrameReport {
  double ms = 0;             // the whole picture
  uint64_t rays = 0;         // cast
  uint64_t faces_drawn = 0;  // quads sent to the rasterizer
  std::vector<PassReport> passes;
  std::string device;  // what drew it
};

struct Frame {
  Image image;
  FrameReport report;
};

/// A backend keeps what it derived from a world between pictures (extracted faces, pipelines) and follows the store's
/// changes; it belongs to one thread.
class Backend {
 public:
  virtual ~Backend() = default;
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
