/// Barriers of buffers and of images.
#pragma once

#include "render/gpu/vulkan.h"

namespace render::gpu {

/// A stage of the pipeline and what it does to memory.
struct Access {
  VkPipelineStageFlags2 stages;
  VkAccessFlags2 access;
};

/// Of all buffers.
void memory_barrier(VkCommandBuffer commands, Access from, Access to);
/// Of all levels and layers of an image: from one layout and access to another.
void layout_barrier(VkCommandBuffer commands, VkImage image, VkImageAspectFlags aspect, VkImageLayout from_layout,
                    Access from, VkImageLayout to_layout, Access to);

}  // namespace render::gpu
