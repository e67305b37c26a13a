/// Vulkan 1.3 through volk: the loader is opened at run time, so that a machine without one gets a sentence, not a
/// link error.
#pragma once

#ifndef VK_NO_PROTOTYPES
#define VK_NO_PROTOTYPES
#endif
#include <volk.h>

#include <string>

#include "world/base/errors.h"

namespace render::gpu {

const char* result_name(VkResult result);
/// The error of a failed call: kind no_device, naming the call and the code.
world::Error vulkan_error(const char* call, VkResult result);

/// A parameter structure of Vulkan, zero but for its type and what follows it.
template <class Info>
Info vk_info(VkStructureType type, void* next = nullptr) {
  Info info{};
  info.sType = type;
  info.pNext = next;
  return info;
}

}  // namespace render::gpu

/// Returns from the function with an Error that names the call and the code.
#define VK_CHECK(call)                                                                 \
  do {                                                                                 \
    const VkResult vk_result = (call);                                                 \
    if (vk_result != VK_SUCCESS) return ::render::gpu::vulkan_error(#call, vk_result); \
  } while (0)
