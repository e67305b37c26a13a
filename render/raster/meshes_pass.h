/// Draws the triangles that a world has beside its voxels (triangles.h): which one each pixel sees, and its depth, over
/// what the faces have left. Shading puts their pixels off to a dispatch of its own.
#pragma once

#include "render/raster/pass.h"
#include "render/raster/triangles.h"

namespace render::raster {

class MeshesPass : public Pass {
 public:
  static PassKind kind();
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;
  void rest() override;

 private:
  Pipeline pipelines_[2];  // the second: of what is seen in a mirror
  gpu::Buffer indices_;    // 0, 1, 2, ...
  std::vector<DrawnTriangles::Run> runs_;
  uint64_t bytes_ = 0;
};

}  // namespace render::raster
