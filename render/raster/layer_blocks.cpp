#include "render/raster/layer_blocks.h"

#include <algorithm>
#include <bit>

#include "face_setup.comp.spv.h"
#include "face_spread.comp.spv.h"
#include "layer_blocks.comp.spv.h"
#include "render/raster/block_lists.h"
#include "render/raster/culling.h"

namespace render::raster {

namespace {

constexpr uint32_t kFewestLayers = 4096;  // that there is room for
/// Bytes that a layer takes in a block: its number, and a bit in each pixel's mask.
constexpr uint32_t kMaskBytes = kBlockPixels * kBlockPixels / 8;

/// What faces of cubes have bound under the same numbers.
constexpr uint32_t kBoundAnew[] = {kBindFaces,       kBindListedFaces, kBindFaceSetups, kBindBlockFaces,
                                   kBindBlockCounts, kBindFaceItems,   kBindFaceHeads,  kBindActiveBlocks};

}  // namespace

uint64_t LayerBlocks::most_of_block(const PassContext& context) const {
  return std::min<uint64_t>(context.device.limits().maxStorageBufferRange / (count_of(blocks_) * kMaskBytes),
                            kMostWords * kMaskLayers);
}

bool LayerBlocks::fits(const PassContext& context, const Drawing& drawing, const LayerDraws& draws) const {
  const VkExtent2D blocks = blocks_of(context.targets.extent());
  return context.device.is_processor() && drawing.may_list_faces && drawing.knobs.face_edges == FaceEdges::exact &&
         context.targets.depth_format == kDepthFormat && !same_extent(crowded_, blocks) &&
         count_of(blocks) * kMaskLayers * kMaskBytes <= context.device.limits().maxStorageBufferRange &&
         groups_of(blocks.width * blocks.height, kBlocksInGroup) <= kMostGroups && draws.faces <= kMostListed;
}

world::Status LayerBlocks::fit(PassContext& context) {
  const VkExtent2D blocks = blocks_of(context.targets.extent());
  if (same_extent(blocks, blocks_)) return {};
  blocks_ = blocks;
  of_block_ = kMaskLayers;
  const uint64_t words = count_of(blocks) * sizeof(uint32_t);
  TRY(block_counts_, gpu::make_texel_buffer(context.device, words, VK_FORMAT_R32_UINT,
                                            VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                            gpu::MemoryUse::device));
  TRY_STATUS(fit_texels(context, active_, VK_FORMAT_R32_UINT, words));
  block_faces_ = {}, masks_ = {};
  return {};
}

world::Status LayerBlocks::prepare(PassContext& context, const LayerDraws& draws, bool lists_tiles) {
  TRY_STATUS(fit(context));
  if (!walk_ || lists_tiles != lists_tiles_) {
    const std::array constants{Constant{kSpecLayerBlocks, 1}, Constant{kSpecListedTiles, lists_tiles}};
    TRY(setup_, make_compute(context.device, face_setup_comp_spv, constants));
    TRY(spread_, make_compute(context.device, face_spread_comp_spv, constants));
    TRY(walk_, make_compute(context.device, layer_blocks_comp_spv, constants));
    lists_tiles_ = lists_tiles;
  }
  std::vector<ListedFace> listed;
  listed.reserve(draws.faces);
  listed_end_.clear();
  for (uint32_t page = 0; page < draws.pool->pages(); ++page) {
    for (const LayerDraws::Run& run : draws.runs)
      for (uint32_t i = 0; run.page == page && i < run.count; ++i) listed.push_back({run.first + i, run.chunk});
    listed_end_.push_back(static_cast<uint32_t>(listed.size()));
  }
  layers_ = std::max({layers_, kFewestLayers, std::bit_ceil(static_cast<uint32_t>(listed.size()))});
  TRY_STATUS(context.fill_texels(listed_, VK_FORMAT_R32G32_UINT, listed.data(), listed.size() * sizeof(ListedFace)));
  TRY_STATUS(
      fit_texels(context, setups_, VK_FORMAT_R32G32B32A32_UINT, uint64_t{layers_} * kSetupTexels * sizeof(uvec4)));
  TRY_STATUS(fit_texels(context, item_list_, VK_FORMAT_R32G32B32A32_UINT, uint64_t{items_} * sizeof(uvec4)));
  TRY_STATUS(fit_texels(context, block_faces_, VK_FORMAT_R32_UINT, count_of(blocks_) * of_block_ * sizeof(uint32_t)));
  TRY_STATUS(fit_texels(context, masks_, VK_FORMAT_R32_UINT, count_of(blocks_) * of_block_ * kMaskBytes));
  std::array<uint32_t, kPageHeads> heads{};
  for (size_t head = 0; head < heads.size(); head += kHeadWords) heads[head + 1] = heads[head + 2] = 1;
  return context.fill(heads_, heads.data(), sizeof heads,
                      VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT,
                      gpu::MemoryUse::readback);
}

void LayerBlocks::record(VkCommandBuffer commands, PassContext& context, const LayerDraws& draws) {
  Bindings& bind = context.bindings;
  bound_before_.clear();
  for (const uint32_t binding : kBoundAnew) bound_before_.emplace_back(binding, bind.bound(binding));
  bind.bind(kBindListedFaces, listed_);
  bind.bind(kBindFaceSetups, setups_);
  bind.bind(kBindBlockFaces, block_faces_);
  bind.bind(kBindBlockCounts, block_counts_);
  bind.bind(kBindFaceItems, item_list_);
  bind.bind(kBindFaceHeads, heads_);
  bind.bind(kBindActiveBlocks, active_);
  bind.bind(kBindLayerMasks, masks_);
  const Bindings::Bound chunks = bind.bound(kBindChunks);
  bind.bind(kBindChunks, bind.bound(kBindLayerChunks));
  // Set layers up.
  memory_barrier(commands, kComputeReadWrite, kClearWrite);
  vkCmdFillBuffer(commands, block_counts_.handle, 0, VK_WHOLE_SIZE, 0);
  memory_barrier(commands, kClearWrite, kComputeReadWrite);
  uint32_t begin = 0;
  for (uint32_t page = 0; page < listed_end_.size(); begin = listed_end_[page++]) {
    const uint32_t count = listed_end_[page] - begin;
    if (count == 0) continue;
    bind.bind(kBindFaces, draws.pool->page(page));
    bind.use(commands, setup_);
    setup_.push(commands, SetupRange{begin, count, begin, page, layers_, items_, of_block_});
    vkCmdDispatch(commands, groups_of(count, kSetupGroup), 1, 1);
  }
  memory_barrier(commands, kComputeWrite, kComputeReadWrite | kIndirectRead);
  // Spread the large ones.
  const uint32_t room[] = {items_, of_block_};
  bind.use(commands, spread_);
  spread_.push(commands, room);
  vkCmdDispatchIndirect(commands, heads_.handle, kItemsHead * sizeof(uint32_t));
  memory_barrier(commands, kComputeWrite, kComputeReadWrite | kIndirectRead);
  // Walk over the lists.
  image_barrier(commands, context.targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite, kComputeRead);
  bind.use(commands, walk_);
  walk_.push(commands, of_block_);
  vkCmdDispatchIndirect(commands, heads_.handle, kActiveHead * sizeof(uint32_t));
  image_barrier(commands, context.targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kComputeRead, kDepthReadWrite);
  memory_barrier(commands, kComputeWrite, kComputeReadWrite | kIndirectRead | kHostRead);
  bind.bind(kBindChunks, chunks);
}

void LayerBlocks::restore(PassContext& context) const {
  for (const auto& [binding, bound] : bound_before_) context.bindings.bind(binding, bound);
}

bool LayerBlocks::finish(const PassContext& context, FrameReport& report) {
  const auto* heads = reinterpret_cast<const uint32_t*>(heads_.mapped());
  const uint32_t items = heads[kItemsHead + 3], of_block = heads[kLongestHead + 3];
  const bool had_room = items <= items_ && of_block <= of_block_;
  if (std::bit_ceil(of_block) > most_of_block(context))
    crowded_ = blocks_;
  else
    of_block_ = std::max(of_block_, std::bit_ceil(of_block));
  items_ = std::max(items_, std::bit_ceil(items));
  report.work.push_back({"layers_listed", listed_end_.empty() ? 0 : listed_end_.back()});
  for (const gpu::Buffer* buffer : buffers()) row_of(report, "transparency_resolve").bytes += buffer->size;
  return had_room;
}

void LayerBlocks::rest(PassContext& context) {
  context.bindings.forget(kBindLayerMasks);
  for (gpu::Buffer* buffer : buffers()) *buffer = {};
  blocks_ = {};
}

}  // namespace render::raster
