/// Where a picture taken from behind a mirror may be seen in it (knob reflection=planar): the plane's water, glass and
/// mirrors, by leaves of 8 x 8 voxels, as 1 into the stencil, and 2 where more than the sky is seen.
/// Shading then leaves out all other pixels.
/// error  none: what is left out no pixel of the eye's picture asks for
#pragma once

#include "render/raster/stencil.h"

namespace render::raster {

class MirrorStencilPass : public Pass {
 public:
  static PassKind kind();
  world::Status open(PassContext& context) override;
  world::Status fit(PassContext& context) override;
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;

 private:
  /// Leaves in a row, on the plane: [u0, u1) x [v, v + 1), u and v the axes after the plane's own.
  struct Strip {
    int32_t u0, u1, v;
  };
  void follow(const world::WorldView& view, const MirrorPlane& plane);

  Pipeline pipeline_, seen_;
  std::vector<Strip> strips_;
  MirrorPlane plane_;
  uint64_t store_ = 0;  // identity, that subscriber_ follows
  int subscriber_ = 0;
  gpu::Buffer strips_buffer_;
  uint32_t drawn_ = 0;
};

}  // namespace render::raster
