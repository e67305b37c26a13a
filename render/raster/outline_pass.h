/// The outline of a box that is picked, as wide in pixels everywhere: what of the box is seen goes into the stencil,
/// then the box once more, moved by the line's width in eight directions, is drawn where the stencil doesn't hold it.
/// Things before the box hide both.
#pragma once

#include "render/raster/stencil.h"

namespace render::raster {

class OutlinePass : public Pass {
 public:
  static PassKind kind();
  world::Status open(PassContext&) override { return {}; }
  world::Status fit(PassContext& context) override { return fit_stencil(context); }
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;

 private:
  struct Push {
    vec4 low, high;  // relative to the camera; low.w: width of the line, px
    vec4 colour;     // times its opacity
  };
  Pipeline mark_, draw_;
  Push push_{};
};

}  // namespace render::raster
