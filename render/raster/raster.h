/// The rasterizing backend: follows a world's visible faces and draws them with Vulkan. Headless.
#pragma once

#include "render/backend.h"
#include "render/gpu/device.h"

namespace render {

namespace raster {
class Rasterizer;
}

class RasterBackend : public Backend {
 public:
  /// What the validation layer said since the start.
  virtual std::vector<std::string> messages() const = 0;
  virtual raster::Rasterizer& rasterizer() = 0;
  /// See Rasterizer::bare.
  virtual void draw_bare(bool bare) = 0;
};

/// Fails with ErrorKind::no_device where no Vulkan 1.3 device is found; the message names the package to install.
world::Result<std::unique_ptr<RasterBackend>> make_raster(const gpu::DeviceOptions& options);
world::Result<std::unique_ptr<Backend>> make_raster_backend();

}  // namespace render
