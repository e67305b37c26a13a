/// Device memory in blocks of 32 MiB and more, cut into ranges by first fit. Vulkan allows as few as 4096 allocations,
/// and each costs a call to the kernel.
///
/// Buffers and images never share a block, so bufferImageGranularity does not matter.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "render/gpu/vulkan.h"

namespace render::gpu {

class Device;

enum class MemoryUse {
  device,    // fastest for the device; may not be visible to the processor
  upload,    // written by the processor, read by the device; coherent
  readback,  // written by the device, read by the processor; coherent, cached where the device offers it
};

struct MemoryBlock {
  VkDeviceMemory memory = VK_NULL_HANDLE;
  VkDeviceSize size = 0;
  uint32_t type = 0;
  bool images = false;
  std::byte* mapped = nullptr;
  std::map<VkDeviceSize, VkDeviceSize> free;  // offset -> size, neighbours merged
};

struct MemoryRange {
  MemoryBlock* block = nullptr;
  VkDeviceSize offset = 0, size = 0;
};

class MemoryPool {
 public:
  void open(VkPhysicalDevice physical, VkDevice device);
  /// Frees every block; `true` where nothing was still in use.
  bool close();

  world::Result<MemoryRange> allocate(const VkMemoryRequirements& needs, MemoryUse use, bool image);
  void release(const MemoryRange& range);
  VkDeviceSize bytes_used() const { return used_; }
  /// Bytes that the pool may ask of the driver; tests lower it.
  VkDeviceSize limit = ~VkDeviceSize{0};

 private:
  std::optional<uint32_t> choose_type(uint32_t allowed, MemoryUse use) const;

  VkDevice device_ = VK_NULL_HANDLE;
  VkPhysicalDeviceMemoryProperties properties_{};
  std::vector<std::unique_ptr<MemoryBlock>> blocks_;
  VkDeviceSize used_ = 0, reserved_ = 0;
};

}  // namespace render::gpu
