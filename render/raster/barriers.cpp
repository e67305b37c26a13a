#include "render/raster/barriers.h"

namespace render::raster {

void image_barrier(VkCommandBuffer commands, VkImage image, VkImageAspectFlags aspect, Access from, Access to) {
  gpu::layout_barrier(commands, image, aspect, VK_IMAGE_LAYOUT_GENERAL, from, VK_IMAGE_LAYOUT_GENERAL, to);
}

void image_discard(VkCommandBuffer commands, VkImage image, VkImageAspectFlags aspect, Access from, Access to) {
  gpu::layout_barrier(commands, image, aspect, VK_IMAGE_LAYOUT_UNDEFINED, from, VK_IMAGE_LAYOUT_GENERAL, to);
}

}  // namespace render::raster
