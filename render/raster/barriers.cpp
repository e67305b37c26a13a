#include "render/raster/barriers.h"

namespace render::raster {

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
  gpu::layout_barrier(commands, image, aspect, VK_IMAGE_LAYOUT_GENERAL, from, VK_IMAGE_LAYOUT_GENERAL, to);
}

void image_discard(VkCommandBuffer commands, VkImage image, VkImageAspectFlags aspect, Access from, Access to) {
  gpu::layout_barrier(commands, image, aspect, VK_IMAGE_LAYOUT_UNDEFINED, from, VK_IMAGE_LAYOUT_GENERAL, to);
}

}  // namespace render::raster
