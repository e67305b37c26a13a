/// Draws shapes that are small on the screen by dispatches (small_shapes.shared.h), between faces of cubes that
/// FaceBlocks draws and their depth's copy: what targets hold in the end is what the pipeline of points leaves there.
#pragma once

#include <array>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "render/raster/culling.h"
#include "render/raster/face_blocks.h"
#include "render/raster/pass.h"
#include "render/raster/small_shapes.shared.h"

namespace render::raster {

class SmallShapes {
 public:
  /// Where FaceBlocks fits: whether the device and the picture's size let shapes be drawn so too.
  static bool fits(const PassContext& context);
  /// Of `list`, which has lists of faces, the points. rows: of FaceBlocks, which is prepared.
  world::Status prepare(PassContext& context, const Drawing& drawing, const DrawList& list, const BlockRows& rows);
  /// Before FaceBlocks::record_depth().
  void record(VkCommandBuffer commands, PassContext& context, std::span<const gpu::Buffer* const> page_of);
  void finish(FrameReport& report) const;
  void rest();

 private:
  world::Status fit(PassContext& context, const BlockRows& rows);
  void list_points(const Drawing& drawing, const DrawList& list);
  struct Pipelines {
    std::array<Pipeline, 2> keys;  // by kTileSides
    Pipeline blocks, pixels;
  };
  world::Result<const Pipelines*> pipelines(PassContext& context, bool blends);
  /// Shapes of a page whose squares are of one size.
  struct Range {
    uint32_t page, tile, first, count;
  };

  std::map<bool, Pipelines> made_;
  const Pipelines* by_ = nullptr;
  BlockRows rows_{};
  std::vector<ListedFace> shapes_;
  std::vector<Range> ranges_;
  bool fresh_ = false;  // nothing has been written to keys and marks
  gpu::Buffer listed_, setups_, keys_, touched_, blocks_, head_;
};

}  // namespace render::raster
