/// Draws extracted faces of cubes and of shapes: which face each pixel sees, and its depth. Indirect draws of what the
/// last picture saw first, face by face of cubes, with impostors of what is far; then of what the depth of that leaves
/// visible of the rest.
#pragma once

#include "render/raster/billboards.h"
#include "render/raster/culling.h"
#include "render/raster/face_blocks.h"
#include "render/raster/face_pool.h"
#include "render/raster/heightfields.h"
#include "render/raster/impostors.h"
#include "render/raster/occlusion_test.h"
#include "render/raster/pass.h"

#include <tuple>
#include "render/raster/shape_table.h"
#include "render/raster/small_shapes.h"

namespace render::raster {

class FacesPass : public Pass {
 public:
  static PassKind kind();
  world::Status open(PassContext& context) override;
  world::Status fit(PassContext& context) override;
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;
  bool again() const override { return again_; }

 private:
  world::Status fit_indices(PassContext& context, uint32_t largest);
  enum class Drawn { cubes, shapes, points };  // points: of shapes
  world::Result<const Pipeline*> pipeline(PassContext& context, const Drawing& drawing, Drawn what, bool blends);
  void record_draws(VkCommandBuffer commands, PassContext& context, bool second, bool clear);
  void record_blocks(VkCommandBuffer commands, PassContext& context);

  std::map<std::tuple<FaceEdges, Drawn, bool, bool, bool, bool>, Pipeline> pipelines_;
  OcclusionTest occlusion_;
  FaceBlocks blocks_;         // draws faces of cubes in place of pipelines, where the device does it faster
  SmallShapes small_shapes_;  // draws points where it does
  Impostors impostors_;       // of what is far, where the knob asks for them
  const Pipeline* makes_impostors_ = nullptr;
  bool draws_impostors_ = false;
  Billboards billboards_;  // of trees that are far, where the knob asks for them
  bool draws_billboards_ = false;
  Heightfields heightfields_;  // of land that is far, where the knob asks for them
  bool draws_heightfields_ = false;
  std::vector<CulledPool> pools_;          // cubes by level, then shapes, then those of them that are points
  std::vector<const Pipeline*> drawn_by_;  // of each pool
  ShapeTable table_;
  gpu::Buffer indices_;        // of rectangles
  gpu::Buffer point_indices_;  // 0, 1, 2, ...
  gpu::Buffer first_indices_;  // of the faces that the first pass draws, where they are tested one by one
  std::vector<const gpu::Buffer*> page_of_;
  gpu::Buffer chunks_, draws_;
  uint32_t indexed_records_ = 0;
  bool again_ = false;
  DrawList list_;
};

}  // namespace render::raster
