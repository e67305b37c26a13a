#include "render/raster/occlusion_test.h"

#include "depth_tiles.comp.spv.h"
#include "occlusion.comp.spv.h"

namespace render::raster {

world::Status OcclusionTest::open(PassContext& context) {
  TRY(tiles_, make_compute(context.device, depth_tiles_comp_spv));
  TRY(test_, make_compute(context.device, occlusion_comp_spv));
  return {};
}

world::Status OcclusionTest::fit(PassContext& context) {
  const VkExtent2D extent = context.targets.extent();
  const uint64_t tiles =
      uint64_t{(extent.width + kTilePixels - 1) / kTilePixels} * ((extent.height + kTilePixels - 1) / kTilePixels);
  TRY(tile_depths_, gpu::make_buffer(context.device, tiles * sizeof(float), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                                     gpu::MemoryUse::device));
  return {};
}

world::Status OcclusionTest::prepare(PassContext& context, std::span<const Candidate> candidates,
                                     const gpu::Buffer& draws) {
  count_ = static_cast<uint32_t>(candidates.size());
  TRY_STATUS(context.fill(candidates_, candidates.data(), candidates.size_bytes(), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  TRY_STATUS(context.fill(visible_, nullptr, candidates.size() * sizeof(uint32_t), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                          gpu::MemoryUse::readback));
  context.bindings.bind(kBindTiles, tile_depths_);
  context.bindings.bind(kBindCandidates, candidates_);
  context.bindings.bind(kBindVisible, visible_);
  context.bindings.bind(kBindDraws, draws);
  return {};
}

void OcclusionTest::record(VkCommandBuffer commands, PassContext& context) {
  const Targets& targets = context.targets;
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite, kComputeRead);
  const auto tiles = [](int pixels) { return (static_cast<uint32_t>(pixels) + kTilePixels - 1) / kTilePixels; };
  context.bindings.use(commands, tiles_);
  vkCmdDispatch(commands, (tiles(targets.width) + 15) / 16, (tiles(targets.height) + 3) / 4, 1);
  // The test writes into draws that earlier ones may still read.
  memory_barrier(commands, kComputeWrite | kIndirectRead, kComputeReadWrite);
  context.bindings.use(commands, test_);
  test_.push(commands, count_);
  vkCmdDispatch(commands, (count_ + 63) / 64, 1, 1);
  memory_barrier(commands, kComputeWrite, kIndirectRead | kHostRead);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kComputeRead, kDepthReadWrite);
}

std::span<const uint32_t> OcclusionTest::visible() const {
  return {reinterpret_cast<const uint32_t*>(visible_.mapped()), count_};
}

}  // namespace render::raster
