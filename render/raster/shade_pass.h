/// Turns what each pixel sees into radiance: one compute pass over bands of rows. Compiled for what a picture asks for.
#pragma once

#include <map>

#include "render/raster/pass.h"

namespace render::raster {

class ShadePass : public Pass {
 public:
  static PassKind kind();
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;

 private:
  std::map<std::vector<Constant>, Pipeline> pipelines_;
  const Pipeline* pipeline_ = nullptr;
  gpu::Buffer materials_;
};

}  // namespace render::raster
