/// Which boxes may be seen past what is drawn so far: the farthest depth of each tile of pixels, then a test of each
/// box against the tiles that it covers. Conservative.
#pragma once

#include "render/raster/culling.h"
#include "render/raster/pass.h"

namespace render::raster {

class OcclusionTest {
 public:
  world::Status open(PassContext& context);
  world::Status fit(PassContext& context);
  world::Status prepare(PassContext& context, std::span<const Candidate> candidates, const gpu::Buffer& draws);
  /// Turns draws on (instanceCount 1) whose box may be seen. `draws` may be in use by the draws before.
  void record(VkCommandBuffer commands, PassContext& context);
  /// By candidate: whether it may be seen. Valid once the device is done.
  std::span<const uint32_t> visible() const;

 private:
  Pipeline tiles_, test_;
  gpu::Buffer tile_depths_, candidates_, visible_;
  uint32_t count_ = 0;
};

}  // namespace render::raster
