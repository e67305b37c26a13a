#include "render/raster/barriers.h"

namespace render::raster {

namespace {

void barrier_of(VkCommandBuffer commands, VkImage image, VkImageAspectFlags aspect, VkImageLayout layout, Access from,
                Access to) {
  auto barrier = gpu::vk_info<VkImageMemoryBarrier2>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2);
  barrier.srcStageMask = from.stages;
  barrier.srcAccessMask = from.access;
  barrier.dstStageMask = to.stages;
  barrier.dstAccessMask = to.access;
  barrier.oldLayout = layout;
  barrier.newLayout = VK_IMAGE_LAYOUT_GENERAL;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image;
  barrier.subresourceRange = {aspect, 0, VK_REMAINING_MIP_LEVELS, 0, VK_REMAINING_ARRAY_LAYERS};
  auto info = gpu::vk_info<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  info.imageMemoryBarrierCount = 1;
  info.pImageMemoryBarriers = &barrier;
  vkCmdPipelineBarrier2(commands, &info);
}

}  // namespace

void memory_barrier(VkCommandBuffer commands, Access from, Access to) {
  auto barrier = gpu::vk_info<VkMemoryBarrier2>(VK_STRUCTURE_TYPE_MEMORY_BARRIER_2);
  barrier.srcStageMask = from.stages;
  barrier.srcAccessMask = from.access;
  barrier.dstStageMask = to.stages;
  barrier.dstAccessMask = to.access;
  auto info = gpu::vk_info<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  info.memoryBarrierCount = 1;
  info.pMemoryBarriers = &barrier;
  vkCmdPipelineBarrier2(commands, &info);
}

void image_barrier(VkCommandBuffer commands, VkImage image, VkImageAspectFlags aspect, Access from, Access to) {
  barrier_of(commands, image, aspect, VK_IMAGE_LAYOUT_GENERAL, from, to);
}

void image_discard(VkCommandBuffer commands, VkImage image, VkImageAspectFlags aspect, Access from, Access to) {
  barrier_of(commands, image, aspect, VK_IMAGE_LAYOUT_UNDEFINED, from, to);
}

}  // namespace render::raster
