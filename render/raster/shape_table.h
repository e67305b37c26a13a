/// The faces of shapes on the device, and how each is lit by sky and sun.
#pragma once

#include "render/raster/pass.h"

namespace render::raster {

class ShapeTable {
 public:
  /// Sends and binds what the picture's shapes need, where it has any.
  world::Status prepare(PassContext& context, const Drawing& drawing);

 private:
  gpu::Buffer quads_, lit_;
};

}  // namespace render::raster
