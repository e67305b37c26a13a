#include "render/raster/face_blocks.h"

#include <algorithm>
#include <array>
#include <bit>

#include "face_blocks.comp.spv.h"
#include "face_setup.comp.spv.h"
#include "face_spread.comp.spv.h"
#include "render/raster/block_lists.h"

namespace render::raster {

namespace {

constexpr VkBufferUsageFlags kStorage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
constexpr uint32_t kFewestFaces = 16384;  // that there is room for
// Until a picture says more a block's list has room for so many times the faces that there are for each, up to the
// latter.
constexpr uint64_t kUneven = 16;
constexpr uint32_t kFewestOfBlock = 64, kMostAtFirst = 1024;
constexpr uint64_t kSeenBytes = 2 * sizeof(uint32_t);

}  // namespace

bool FaceBlocks::fits(const PassContext& context) const {
  const Targets& targets = context.targets;
  const VkExtent2D blocks = blocks_of(targets.extent());
  const uint64_t row = uint64_t{blocks.width} * kBlockPixels, pixels = row * blocks.height * kBlockPixels;
  const uint64_t range = context.device.limits().maxStorageBufferRange;
  return context.device.is_processor() && !same_extent(crowded_, blocks) && targets.depth_format == kDepthFormat &&
         pixels * sizeof(float) <= range && groups_of(blocks.width * blocks.height, kBlocksInGroup) <= kMostGroups &&
         targets.seen.row_bytes >= row * kSeenBytes && targets.seen.row_bytes * targets.extent().height <= range;
}

BlockRows FaceBlocks::rows(const PassContext& context) const {
  return {blocks_, blocks_.width * kBlockPixels, static_cast<uint32_t>(context.targets.seen.row_bytes / kSeenBytes)};
}

uint64_t FaceBlocks::fewest(const PassContext& context) { return count_of(blocks_of(context.targets.extent())); }

world::Status FaceBlocks::fit(PassContext& context) {
  if (!seen_rows_.handle) {
    TRY(seen_rows_, gpu::make_buffer_over(context.device, context.targets.seen, kStorage));
  }
  const VkExtent2D blocks = blocks_of(context.targets.extent());
  if (same_extent(blocks, blocks_)) return {};
  blocks_ = blocks;
  of_block_ = kFewestOfBlock;  // small pictures have the longer lists
  const uint64_t words = count_of(blocks) * sizeof(uint32_t);
  constexpr VkBufferUsageFlags kCleared = kStorage | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  TRY(tiles_, gpu::make_texel_buffer(context.device, words, VK_FORMAT_R32_SFLOAT, kCleared, gpu::MemoryUse::device));
  TRY(block_counts_,
      gpu::make_texel_buffer(context.device, words, VK_FORMAT_R32_UINT, kCleared, gpu::MemoryUse::device));
  TRY(active_, gpu::make_texel_buffer(context.device, words, VK_FORMAT_R32_UINT, kStorage, gpu::MemoryUse::device));
  TRY(depths_,
      gpu::make_texel_buffer(context.device, words * kBlockPixels * kBlockPixels, VK_FORMAT_R32G32B32A32_SFLOAT,
                             kStorage | VK_BUFFER_USAGE_TRANSFER_SRC_BIT, gpu::MemoryUse::device));
  return {};
}

uint64_t FaceBlocks::most_of_block(const PassContext& context) const {
  return context.device.limits().maxStorageBufferRange / (count_of(blocks_) * sizeof(uint32_t));
}

world::Result<const FaceBlocks::Pipelines*> FaceBlocks::pipelines(PassContext& context, bool second,
                                                                  const Drawing& drawing, bool blends) {
  Pipelines& found = made_[{second, blends, drawing.liquid_levels}];
  if (!found.blocks) {
    const std::array constants{Constant{kSpecSecondFaces, second}, Constant{kSpecBlends, blends},
                               Constant{kSpecLiquidLevels, drawing.liquid_levels}};
    TRY(found.setup, make_compute(context.device, face_setup_comp_spv, constants));
    TRY(found.spread, make_compute(context.device, face_spread_comp_spv, constants));
    TRY(found.blocks, make_compute(context.device, face_blocks_comp_spv, constants));
  }
  return &found;
}

world::Status FaceBlocks::prepare(PassContext& context, const Drawing& drawing, const DrawList& list) {
  list_ = &list;
  TRY_STATUS(fit(context));
  TRY(first_, pipelines(context, false, drawing, list.blends));
  if (!list.candidates.empty()) {
    TRY(second_, pipelines(context, true, drawing, list.blends));
  }
  faces_ = std::max({faces_, kFewestFaces, std::bit_ceil(static_cast<uint32_t>(list.listed.size()))});
  const uint64_t wanted = kUneven * list.listed.size() / count_of(blocks_);
  const uint64_t most = std::min<uint64_t>(kMostAtFirst, std::bit_floor(most_of_block(context)));
  of_block_ = std::max(of_block_, static_cast<uint32_t>(std::min(std::bit_ceil(wanted), most)));
  TRY_STATUS(
      context.fill_texels(listed_, VK_FORMAT_R32G32_UINT, list.listed.data(), list.listed.size() * sizeof(ListedFace)));
  TRY_STATUS(fit_texels(context, second_listed_, VK_FORMAT_R32G32_UINT,
                        std::bit_ceil(uint64_t{list.second_faces} * sizeof(ListedFace))));
  TRY_STATUS(
      fit_texels(context, setups_, VK_FORMAT_R32G32B32A32_UINT, uint64_t{faces_} * kSetupTexels * sizeof(uvec4)));
  TRY_STATUS(fit_texels(context, item_list_, VK_FORMAT_R32G32B32A32_UINT, uint64_t{items_} * sizeof(uvec4)));
  TRY_STATUS(fit_texels(context, block_faces_, VK_FORMAT_R32_UINT, count_of(blocks_) * of_block_ * sizeof(uint32_t)));
  std::vector<uint32_t> heads(kPageHeads + kHeadWords * list.listed_end.size(), 0);
  for (size_t head = 0; head < heads.size(); head += kHeadWords) heads[head + 1] = heads[head + 2] = 1;
  TRY_STATUS(context.fill(heads_, heads.data(), heads.size() * sizeof heads[0],
                          kStorage | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT, gpu::MemoryUse::readback));
  Bindings& bind = context.bindings;
  bind.bind(kBindFaceSetups, setups_);
  bind.bind(kBindBlockFaces, block_faces_);
  bind.bind(kBindBlockCounts, block_counts_);
  bind.bind(kBindFaceItems, item_list_);
  bind.bind(kBindFaceHeads, heads_);
  bind.bind(kBindBlockDepths, depths_);
  bind.bind(kBindBlockDepthTexels, depths_);
  bind.bind(kBindActiveBlocks, active_);
  bind.bind(kBindTiles, tiles_);
  bind.bind(kBindSeenRows, seen_rows_);
  return {};
}

/// Spreads the items of a pass. Lists are whole after it.
void FaceBlocks::record_lists(VkCommandBuffer commands, PassContext& context, const Pipelines& by) {
  memory_barrier(commands, kComputeWrite, kComputeReadWrite | kIndirectRead);
  const bool second = &by == second_;
  const uint32_t room[] = {items_, of_block_};
  context.bindings.use(commands, by.spread);
  by.spread.push(commands, room);
  vkCmdDispatchIndirect(commands, heads_.handle, (second ? kSecondItemsHead : kItemsHead) * sizeof(uint32_t));
  memory_barrier(commands, kComputeWrite, kComputeReadWrite | kIndirectRead);
  const BlockRows across = rows(context);
  context.bindings.use(commands, by.blocks);
  const uint32_t groups_x = groups_of(blocks_.width, kBlocksInGroup);
  by.blocks.push(commands, std::array{of_block_, across.pixels, across.seen_pixels,
                                      spreading_stride(groups_x * blocks_.height / kGroupsInRun)});
  if (second)
    vkCmdDispatchIndirect(commands, heads_.handle, kActiveHead * sizeof(uint32_t));
  else
    vkCmdDispatch(commands, groups_x, blocks_.height, 1);
}

void FaceBlocks::record_first(VkCommandBuffer commands, PassContext& context,
                              std::span<const gpu::Buffer* const> page_of) {
  memory_barrier(commands, kComputeReadWrite, kClearWrite);
  vkCmdFillBuffer(commands, block_counts_.handle, 0, VK_WHOLE_SIZE, 0);
  vkCmdFillBuffer(commands, tiles_.handle, 0, VK_WHOLE_SIZE, std::bit_cast<uint32_t>(1.0f));
  memory_barrier(commands, kClearWrite, kComputeReadWrite);
  image_barrier(commands, context.targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kComputeReadWrite);
  context.bindings.bind(kBindListedFaces, listed_);
  uint32_t begin = 0;
  for (uint32_t page = 0; page < list_->listed_end.size(); begin = list_->listed_end[page++]) {
    const uint32_t count = list_->listed_end[page] - begin;
    if (count == 0) continue;
    context.bindings.bind(kBindFaces, *page_of[page]);
    context.bindings.use(commands, first_->setup);
    first_->setup.push(commands, SetupRange{begin, count, begin, page, faces_, items_, of_block_});
    vkCmdDispatch(commands, groups_of(count, kSetupGroup), 1, 1);
  }
  record_lists(commands, context, *first_);
  context.bindings.bind(kBindListedFaces, second_listed_);  // which the occlusion test writes
}

void FaceBlocks::record_second(VkCommandBuffer commands, PassContext& context,
                               std::span<const gpu::Buffer* const> page_of) {
  memory_barrier(commands, kComputeReadWrite, kClearWrite);
  vkCmdFillBuffer(commands, block_counts_.handle, 0, VK_WHOLE_SIZE, 0);
  memory_barrier(commands, kClearWrite | kComputeWrite, kComputeReadWrite | kIndirectRead);
  for (uint32_t page = 0; page < list_->second_listed.size(); ++page) {
    if (list_->candidates_end[page] == (page > 0 ? list_->candidates_end[page - 1] : 0)) continue;
    context.bindings.bind(kBindFaces, *page_of[page]);
    context.bindings.use(commands, second_->setup);
    second_->setup.push(commands, SetupRange{list_->second_listed[page], 0, 0, page, faces_, items_, of_block_});
    vkCmdDispatchIndirect(commands, heads_.handle, (kPageHeads + kHeadWords * page) * sizeof(uint32_t));
  }
  record_lists(commands, context, *second_);
}

void FaceBlocks::record_depth(VkCommandBuffer commands, PassContext& context) {
  const Targets& targets = context.targets;
  memory_barrier(commands, kComputeWrite, kCopyRead);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite, kCopyWrite);
  VkBufferImageCopy copy{};
  copy.bufferRowLength = blocks_.width * kBlockPixels;
  copy.imageSubresource = {VK_IMAGE_ASPECT_DEPTH_BIT, 0, 0, 1};
  copy.imageExtent = {targets.extent().width, targets.extent().height, 1};
  vkCmdCopyBufferToImage(commands, depths_.handle, targets.depth.handle, VK_IMAGE_LAYOUT_GENERAL, 1, &copy);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kCopyWrite, kDepthReadWrite);
  image_barrier(commands, targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeReadWrite, kColourReadWrite);
  memory_barrier(commands, kComputeWrite, kHostRead);
}

bool FaceBlocks::finish(PassContext& context, FrameReport& report) {
  const auto* heads = reinterpret_cast<const uint32_t*>(heads_.mapped());
  uint32_t second = 0;
  for (size_t page = 0; page < list_->second_listed.size(); ++page) second += heads[kPageHeads + kHeadWords * page + 3];
  const uint32_t items = std::max(heads[kItemsHead + 3], heads[kSecondItemsHead + 3]);
  const uint32_t of_block = heads[kLongestHead + 3];
  const bool had_room = second <= faces_ && items <= items_ && of_block <= of_block_;
  if (second > kMostListed || std::bit_ceil(of_block) > most_of_block(context))
    crowded_ = blocks_;
  else
    faces_ = std::max(faces_, std::bit_ceil(second)), of_block_ = std::max(of_block_, std::bit_ceil(of_block));
  items_ = std::max(items_, std::bit_ceil(items));
  report.work.push_back({"faces_listed", list_->listed.size() + second});
  for (const gpu::Buffer* buffer : buffers()) row_of(report, "faces").bytes += buffer->size;
  return had_room;
}

void FaceBlocks::rest(PassContext& context) {
  if (!heads_.handle) return;
  // The occlusion test and layers name them, whether faces are listed or not.
  for (const uint32_t binding : {kBindListedFaces, kBindFaceHeads, kBindFaceSetups, kBindBlockFaces, kBindBlockCounts})
    context.bindings.forget(binding);
  for (gpu::Buffer* buffer : buffers()) *buffer = {};
  seen_rows_ = {};
  blocks_ = {};
}

}  // namespace render::raster
