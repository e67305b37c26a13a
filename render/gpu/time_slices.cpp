#include "render/gpu/time_slices.h"

#include <algorithm>
#include <cmath>

#include "render/gpu/barrier.h"

namespace render::gpu {

namespace {

/// Squares of a picture that is drawn; groups of lists are as large.
constexpr uint32_t kSquarePixels = 8;

uint64_t divided_up(uint64_t a, uint64_t b) { return (a + b - 1) / b; }

/// Calls slice(x, y, width, height) for rows of groups, or for parts of a row where a slice has less than one. Returns
/// the most groups of a slice, and how many slices there are.
std::pair<uint64_t, uint64_t> each_slice(uint32_t groups_x, uint32_t groups_y, uint64_t of_slice,
                                         const TimeSlices::Slice& slice) {
  uint32_t width = groups_x, height = groups_y;
  if (of_slice < groups_x) {
    width = static_cast<uint32_t>(of_slice), height = 1;
  } else if (of_slice < uint64_t{groups_x} * groups_y) {
    height = static_cast<uint32_t>(of_slice / groups_x);
    // Software draws by tiles of 64 x 64 pixels, and is slower where a scissor cuts them: up to seven rows more.
    if (height > 8) height = std::min((height + 7) / 8 * 8, groups_y);
  }
  uint64_t slices = 0;
  for (uint32_t y = 0; y < groups_y; y += height)
    for (uint32_t x = 0; x < groups_x; x += width, ++slices)
      slice(x, y, std::min(width, groups_x - x), std::min(height, groups_y - y));
  return {uint64_t{width} * height, slices};
}

}  // namespace

uint64_t groups_of_slice(uint64_t groups, double group_ms) {
  const double fit = std::clamp(std::floor(kSliceAimMs / group_ms), 1.0, std::max(1.0, static_cast<double>(groups)));
  const uint64_t slices = divided_up(groups, static_cast<uint64_t>(fit));
  return slices ? divided_up(groups, slices) : 1;
}

void TimeSlices::begin_picture() {
  uses_.clear();
  rows_ = 0;
}

void TimeSlices::end_picture(std::span<const double> row_ms) {
  row_ms_.assign(1, 0);
  row_ms_.insert(row_ms_.end(), row_ms.begin(), row_ms.end());
  // What a pipeline did in a row is one pass, such as bands of a picture. Of a list nothing is known yet.
  std::map<std::pair<VkPipeline, size_t>, uint64_t> groups;
  for (const Use& use : uses_) groups[{use.pipeline, use.row}] += use.groups;
  for (const auto& [of, sum] : groups)
    if (sum) group_ms_[of.first] = row_ms_[of.second] / static_cast<double>(sum);
}

double TimeSlices::foreseen(VkPipeline pipeline) const {
  const auto found = group_ms_.find(pipeline);
  return found == group_ms_.end() ? kUnmeasuredGroupMs : found->second;
}

uint64_t TimeSlices::of_slice(uint64_t groups, double group_ms) const {
  return forced ? std::max<uint64_t>(divided_up(groups, forced), 1) : groups_of_slice(groups, group_ms);
}

void TimeSlices::cut(VkPipeline pipeline, VkExtent2D picture, const Slice& slice) {
  const uint32_t across = (picture.width + kSquarePixels - 1) / kSquarePixels;
  const uint32_t down = (picture.height + kSquarePixels - 1) / kSquarePixels;
  const uint64_t groups = uint64_t{across} * down;
  const double group_ms = foreseen(pipeline);
  const auto [most, slices] = each_slice(across, down, of_slice(groups, group_ms), slice);
  uses_.push_back({pipeline, rows_, groups, most, slices, group_ms});
}

void TimeSlices::draw(VkCommandBuffer commands, VkPipeline pipeline, VkExtent2D picture) {
  cut(pipeline, picture, [&](uint32_t x, uint32_t y, uint32_t width, uint32_t height) {
    const uint32_t left = x * kSquarePixels, top = y * kSquarePixels;
    const VkRect2D slice{{static_cast<int32_t>(left), static_cast<int32_t>(top)},
                         {std::min(width * kSquarePixels, picture.width - left),
                          std::min(height * kSquarePixels, picture.height - top)}};
    vkCmdSetScissor(commands, 0, 1, &slice);
    vkCmdDraw(commands, 3, 1, 0, 0);
  });
  const VkRect2D whole{{0, 0}, picture};
  vkCmdSetScissor(commands, 0, 1, &whole);
}

void TimeSlices::dispatch(VkCommandBuffer commands, VkPipeline pipeline, VkExtent2D picture,
                          const std::function<void(const std::array<uint32_t, 2>&)>& push) {
  cut(pipeline, picture, [&](uint32_t x, uint32_t y, uint32_t width, uint32_t height) {
    push({x, y});
    vkCmdDispatch(commands, width, height, 1);
  });
}

world::Status ListDispatch::prepare(Device& device, const TimeSlices& slices, VkPipeline pipeline, uint64_t groups) {
  use_ = {pipeline, 0, 0, 1, 1, slices.foreseen(pipeline)};
  use_.of_slice = std::max(slices.of_slice(groups, use_.group_ms), divided_up(groups, kMostSlices));
  use_.of_slice = std::min<uint64_t>(use_.of_slice, device.limits().maxComputeWorkGroupCount[0]);
  use_.slices = std::max<uint64_t>(divided_up(groups, use_.of_slice), 1);
  const size_t bytes = sizeof(shared::ListHead) + use_.slices * shared::kSliceWords * sizeof(uint32_t);
  TRY_STATUS(fill(device, arguments_, nullptr, bytes,
                  VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
                      VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                  MemoryUse::device));
  return fill(device, head_, nullptr, sizeof(shared::ListHead), VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::readback);
}

void ListDispatch::clear(VkCommandBuffer commands) const {
  std::vector<uint32_t> words{static_cast<uint32_t>(use_.of_slice), 0, 0};
  for (uint64_t slice = 0; slice < use_.slices; ++slice) words.insert(words.end(), {0, 1, 1});
  vkCmdUpdateBuffer(commands, arguments_.handle, 0, words.size() * sizeof words[0], words.data());
}

void ListDispatch::record(VkCommandBuffer commands, TimeSlices& slices,
                          const std::function<void(uint32_t)>& push) const {
  for (uint64_t slice = 0; slice < use_.slices; ++slice) {
    push(static_cast<uint32_t>(slice * use_.of_slice));
    vkCmdDispatchIndirect(commands, arguments_.handle,
                          sizeof(shared::ListHead) + slice * shared::kSliceWords * sizeof(uint32_t));
  }
  slices.uses_.push_back(use_);
  slices.uses_.back().row = slices.rows_;
  read_head(commands);
}

void ListDispatch::read_head(VkCommandBuffer commands) const {
  memory_barrier(commands,
                 {VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT | VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT,
                  VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT},
                 {VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_READ_BIT});
  const VkBufferCopy all{0, 0, sizeof(shared::ListHead)};
  vkCmdCopyBuffer(commands, arguments_.handle, head_.handle, 1, &all);
  memory_barrier(commands, {VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT},
                 {VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT});
}

void ListDispatch::finish(TimeSlices& slices, uint64_t groups) const {
  for (TimeSlices::Use& use : slices.uses_) {
    if (use.pipeline != use_.pipeline) continue;
    use.groups = groups;
    if (groups) slices.group_ms_[use.pipeline] = slices.row_ms_[use.row] / static_cast<double>(groups);
  }
}

}  // namespace render::gpu
