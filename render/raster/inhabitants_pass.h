/// Bodies and particles over the shaded picture, see render/inhabitants.h. Boxes come with depth, before see-through
/// blocks, which may lie before them; balls from far to near at the end: they look up how far each pixel's surface is.
#pragma once

#include <map>
#include <vector>

#include "render/inhabitants.h"
#include "render/raster/pass.h"

namespace render::raster {

class BodiesPass : public Pass {
 public:
  static PassKind kind();
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;

 private:
  std::map<std::vector<Constant>, Pipeline> pipelines_;
  const Pipeline* drawn_by_ = nullptr;
  gpu::Buffer boxes_;
  uint32_t count_ = 0;
};

class ParticlesPass : public Pass {
 public:
  static PassKind kind();
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;

 private:
  Pipeline pipeline_;
  gpu::Buffer balls_;
  uint32_t count_ = 0;
};

}  // namespace render::raster
