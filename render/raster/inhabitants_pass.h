/// Draws bodies and particles over the shaded picture: boxes with depth, then balls from far to near, which look up how
/// far each pixel's surface is. See render/inhabitants.h.
#pragma once

#include "render/inhabitants.h"
#include "render/raster/pass.h"

namespace render::raster {

class InhabitantsPass : public Pass {
 public:
  static PassKind kind();
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;

 private:
  Pipeline ball_pipeline_, box_pipeline_;  // made where there are any
  gpu::Buffer balls_, boxes_;
  uint32_t ball_count_ = 0, box_count_ = 0;
};

}  // namespace render::raster
