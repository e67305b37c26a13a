#include "render/gpu/memory.h"

#include <algorithm>

namespace render::gpu {

namespace {
constexpr VkDeviceSize kBlockBytes = VkDeviceSize{32} << 20;

VkDeviceSize align_up(VkDeviceSize value, VkDeviceSize alignment) {
  return (value + alignment - 1) / alignment * alignment;
}
}  // namespace

void MemoryPool::open(VkPhysicalDevice physical, VkDevice device) {
  device_ = device;
  vkGetPhysicalDeviceMemoryProperties(physical, &properties_);
}

bool MemoryPool::close() {
  for (const auto& block : blocks_) vkFreeMemory(device_, block->memory, nullptr);
  blocks_.clear();
  return used_ == 0;
}

std::optional<uint32_t> MemoryPool::choose_type(uint32_t allowed, MemoryUse use) const {
  constexpr VkMemoryPropertyFlags kVisible = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  VkMemoryPropertyFlags required = 0, wanted = 0;
  if (use == MemoryUse::device) wanted = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
  if (use == MemoryUse::upload) required = kVisible;
  if (use == MemoryUse::readback) required = kVisible, wanted = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
  for (const VkMemoryPropertyFlags flags : {required | wanted, required})
    for (uint32_t i = 0; i < properties_.memoryTypeCount; ++i)
      if ((allowed >> i & 1) && (properties_.memoryTypes[i].propertyFlags & flags) == flags) return i;
  return std::nullopt;
}

world::Result<MemoryRange> MemoryPool::allocate(const VkMemoryRequirements& needs, MemoryUse use, bool image) {
  const std::optional<uint32_t> type = choose_type(needs.memoryTypeBits, use);
  if (!type) return vulkan_error("choosing a memory type", VK_ERROR_FEATURE_NOT_PRESENT);
  const auto take = [&](MemoryBlock& block) -> std::optional<MemoryRange> {
    for (auto it = block.free.begin(); it != block.free.end(); ++it) {
      const auto [start, size] = *it;
      const VkDeviceSize offset = align_up(start, needs.alignment);
      if (offset + needs.size > start + size) continue;
      block.free.erase(it);
      if (offset > start) block.free[start] = offset - start;
      if (const VkDeviceSize rest = start + size - (offset + needs.size)) block.free[offset + needs.size] = rest;
      used_ += needs.size;
      return MemoryRange{&block, offset, needs.size};
    }
    return std::nullopt;
  };
  for (const auto& block : blocks_)
    if (block->type == *type && block->images == image)
      if (const auto range = take(*block)) return *range;

  auto block = std::make_unique<MemoryBlock>();
  block->type = *type;
  block->images = image;
  block->size = std::max(kBlockBytes, align_up(needs.size, needs.alignment));
  if (reserved_ + block->size > limit) block->size = align_up(needs.size, needs.alignment);
  if (reserved_ + block->size > limit) return vulkan_error("vkAllocateMemory", VK_ERROR_OUT_OF_DEVICE_MEMORY);
  auto info = vk_info<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  info.allocationSize = block->size;
  info.memoryTypeIndex = *type;
  VkResult made = vkAllocateMemory(device_, &info, nullptr, &block->memory);
  if (made != VK_SUCCESS && block->size > needs.size) {
    // A full heap may still have room for exactly what is needed.
    info.allocationSize = block->size = align_up(needs.size, needs.alignment);
    made = vkAllocateMemory(device_, &info, nullptr, &block->memory);
  }
  if (made != VK_SUCCESS) return vulkan_error("vkAllocateMemory", made);
  reserved_ += block->size;
  blocks_.push_back(std::move(block));
  MemoryBlock& fresh = *blocks_.back();
  fresh.free[0] = fresh.size;
  if (properties_.memoryTypes[*type].propertyFlags & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT) {
    void* mapped = nullptr;
    VK_CHECK(vkMapMemory(device_, fresh.memory, 0, VK_WHOLE_SIZE, 0, &mapped));
    fresh.mapped = static_cast<std::byte*>(mapped);
  }
  return *take(fresh);
}

void MemoryPool::release(const MemoryRange& range) {
  MemoryBlock& block = *range.block;
  used_ -= range.size;
  VkDeviceSize offset = range.offset, size = range.size;
  const auto after = block.free.lower_bound(offset);
  if (after != block.free.end() && after->first == offset + size) {
    size += after->second;
    block.free.erase(after);
  }
  const auto next = block.free.lower_bound(offset);
  if (next != block.free.begin()) {
    const auto before = std::prev(next);
    if (before->first + before->second == offset) {
      offset = before->first;
      size += before->second;
      block.free.erase(before);
    }
  }
  block.free[offset] = size;
  if (size < block.size) return;
  // An empty block goes back to the driver.
  vkFreeMemory(device_, block.memory, nullptr);
  reserved_ -= block.size;
  std::erase_if(blocks_, [&](const auto& b) { return b.get() == &block; });
}

}  // namespace render::gpu
