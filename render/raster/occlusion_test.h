/// Which clusters, and which faces of theirs, may be seen past what is drawn so far: the farthest depth of each tile of
/// pixels, then a test of each box and each face against the tiles that it covers. Conservative.
#pragma once

#include "render/raster/culling.h"
#include "render/raster/pass.h"

namespace render::raster {

class OcclusionTest {
 public:
  world::Status open(PassContext& context);
  world::Status fit(PassContext& context);
  /// `draws`: of the list, on the device. tile_depths: of what is drawn so far; null: they are found from its depth.
  world::Status prepare(PassContext& context, const DrawList& list, const gpu::Buffer& draws,
                        const gpu::Buffer* tile_depths);
  /// Lists faces (DrawList::lists_faces), or turns draws of the second pass on: those of clusters that may be seen get
  /// an instance, those of faces their number and second_indices() too. Where the device reads counts, those that are
  /// on come first and counts() says how many they are. `draws` may be in use by the draws before. `page_of`: what to
  /// bind of each page.
  void record(VkCommandBuffer commands, PassContext& context, std::span<const gpu::Buffer* const> page_of);
  const gpu::Buffer& second_indices() const { return second_indices_; }
  const gpu::Buffer& counts() const { return counts_; }
  /// By candidate: which of its records may be seen. Valid once the device is done.
  std::span<const RecordBits> visible() const;

 private:
  Pipeline tiles_, test_, lists_, pack_;
  gpu::Buffer tile_depths_, candidates_, visible_, second_indices_, counts_;
  std::vector<uint32_t> ends_, draw_ends_;  // of each page's candidates and draws
  uint32_t first_draw_ = 0;                 // of the second pass
  bool finds_tiles_ = true;
  std::vector<uint32_t> listed_;  // where the page's part of the list begins; empty: faces are drawn
  std::vector<bool> by_face_;
};

}  // namespace render::raster
