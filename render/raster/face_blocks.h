/// Draws faces of cubes by dispatches (face_blocks.shared.h): what targets.seen and targets.depth hold after is what
/// the pipeline of faces with exact edges leaves there, but for the last bits of depth.
#pragma once

#include <array>
#include <map>
#include <tuple>

#include "render/raster/culling.h"
#include "render/raster/face_blocks.shared.h"
#include "render/raster/pass.h"

namespace render::raster {

/// Of the picture's pixels in buffers.
struct BlockRows {
  VkExtent2D blocks;
  uint32_t pixels, seen_pixels;  // from row to row: of whole blocks; of targets.seen
};

class FaceBlocks {
 public:
  /// Whether pictures of this size can be drawn so, and the device is one that does it faster.
  bool fits(const PassContext& context) const;
  /// Fewer faces cost a pipeline less than to look at all blocks of a picture: one a block. Measured on two cores with
  /// lavapipe, 18,000 faces of the valley take 12 ms for 14 in 3,600 blocks, 28 for 31 in 14,400, but 50 for 36 in
  /// 32,400.
  static uint64_t fewest(const PassContext& context);
  /// `list` has lists of faces. Binds tile depths, which the first pass leaves for the occlusion test.
  world::Status prepare(PassContext& context, const Drawing& drawing, const DrawList& list);
  /// The targets are new.
  void forget_targets() { seen_rows_ = {}; }
  /// All of the picture: what lies behind no face is 0. page_of: what to bind of each page.
  void record_first(VkCommandBuffer commands, PassContext& context, std::span<const gpu::Buffer* const> page_of);
  /// Faces that the occlusion test has listed.
  void record_second(VkCommandBuffer commands, PassContext& context, std::span<const gpu::Buffer* const> page_of);
  /// Into targets.depth; after that both targets are attachments again.
  void record_depth(VkCommandBuffer commands, PassContext& context);
  /// Once the device is done: whether there was room for all of the lists. Else the picture must be drawn again.
  bool finish(PassContext& context, FrameReport& report);
  const gpu::Buffer& tile_depths() const { return tiles_; }
  BlockRows rows(const PassContext& context) const;
  void rest(PassContext& context);

 private:
  world::Status fit(PassContext& context);
  /// Faces of a block that a buffer of them can hold.
  uint64_t most_of_block(const PassContext& context) const;
  /// All that it made for itself.
  std::array<gpu::Buffer*, 10> buffers() {
    return {&listed_,    &second_listed_, &setups_, &block_faces_, &block_counts_,
            &item_list_, &heads_,         &depths_, &active_,      &tiles_};
  }
  struct Pipelines {
    Pipeline setup, spread, blocks;
  };
  world::Result<const Pipelines*> pipelines(PassContext& context, bool second, const Drawing& drawing, bool blends);
  void record_lists(VkCommandBuffer commands, PassContext& context, const Pipelines& by);

  std::map<std::tuple<bool, bool, bool>, Pipelines> made_;
  const Pipelines *first_ = nullptr, *second_ = nullptr;
  const DrawList* list_ = nullptr;
  VkExtent2D blocks_{};
  VkExtent2D crowded_{};  // as blocks_: pictures of that size had longer lists than a buffer holds; pipelines draw them
  uint32_t faces_ = 0, items_ = 4096, of_block_ = 0;  // room
  gpu::Buffer listed_, second_listed_, setups_, block_faces_, block_counts_, item_list_, heads_, depths_, active_,
      tiles_;
  gpu::Buffer seen_rows_;  // the memory of targets.seen
};

}  // namespace render::raster
