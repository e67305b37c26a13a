/// Faces between see-through blocks rasterized by dispatches, for transparency=lists where the device is a processor:
/// they are set up and listed by block of 8 x 8 pixels as faces of cubes are (face_blocks.shared.h), and a walk over
/// each list says of each pixel which of its block's layers it may see: those that its ray meets, but for what lies
/// behind all that is seen by more than depths are rounded. Which it sees the distances along its ray say.
///
///   setups       [layers] 2 uvec4           packed interface, plane, edges whose line is within, offset; rectangle
///   block_faces  [blocks][room] uint        of each block its layers
///   masks        [blocks][room / 32][64] uint  of each pixel a bit a layer
///
/// So no pixel asks for a number that all share, and what reads the masks finds a block's layers beside each other.
/// Where a list doesn't fit, the picture is drawn again with room for it.
#pragma once

#include <array>

#include "render/raster/face_blocks.shared.h"
#include "render/raster/transparency_pass.h"

namespace render::raster {

class LayerBlocks {
 public:
  /// Whether pictures of this size can be drawn so, and the device is one that does it faster.
  bool fits(const PassContext& context, const Drawing& drawing, const LayerDraws& draws) const;
  /// lists_tiles: blocks where some pixel sees a layer are to be listed as tiles.
  world::Status prepare(PassContext& context, const LayerDraws& draws, bool lists_tiles);
  /// Lists and masks. Leaves bound what reads them; `restore` binds again what was.
  void record(VkCommandBuffer commands, PassContext& context, const LayerDraws& draws);
  void restore(PassContext& context) const;
  /// Layers of a block that there is room for.
  uint32_t of_block() const { return of_block_; }
  /// Once the device is done: whether there was room for all of the lists.
  bool finish(const PassContext& context, FrameReport& report);
  void rest(PassContext& context);

 private:
  world::Status fit(PassContext& context);
  std::array<gpu::Buffer*, 8> buffers() {
    return {&listed_, &setups_, &block_faces_, &block_counts_, &item_list_, &heads_, &active_, &masks_};
  }
  /// Layers of a block that buffers of them can hold.
  uint64_t most_of_block(const PassContext& context) const;

  Pipeline setup_, spread_, walk_;
  bool lists_tiles_ = false;
  VkExtent2D blocks_{};
  VkExtent2D crowded_{};              // as blocks_: pictures of that size had longer lists than a buffer holds
  std::vector<uint32_t> listed_end_;  // by page
  uint32_t layers_ = 0, items_ = 1024, of_block_ = 0;  // room
  gpu::Buffer listed_, setups_, block_faces_, block_counts_, item_list_, heads_, active_, masks_;
  std::vector<std::pair<uint32_t, Bindings::Bound>> bound_before_;
};

}  // namespace render::raster
