/// Sole owners of what a driver made. Lifetimes are members: no destroy lists elsewhere.
#pragma once

#include <utility>

#include "render/gpu/device.h"

namespace render::gpu {

/// Sole owner of a Vulkan handle. The driver object dies when the last work that may still read it has finished.
template <class Handle>
class Owned {
 public:
  Owned() = default;
  Owned(Device& device, Handle handle) : device_(&device), handle_(handle) {}
  Owned(Owned&& o) noexcept : device_(o.device_), handle_(std::exchange(o.handle_, Handle{})) {}
  Owned& operator=(Owned&& o) noexcept {
    std::swap(device_, o.device_);
    std::swap(handle_, o.handle_);
    return *this;
  }
  ~Owned() {
    if (handle_) device_->retire(handle_);
  }
  operator Handle() const { return handle_; }
  const Handle* address() const { return &handle_; }

 private:
  Device* device_ = nullptr;
  Handle handle_{};
};

/// A buffer and its memory. `mapped` is null in memory that the processor cannot see.
struct Buffer {
  OwnedMemory memory;  // dies last
  Owned<VkBuffer> handle;
  Owned<VkBufferView> texels;  // of make_texel_buffer()
  VkDeviceSize size = 0;

  std::byte* mapped() const { return memory.mapped(); }
};

/// A 2D image of one level, its memory and the view of all of it.
struct DeviceImage {
  OwnedMemory memory;  // dies last
  Owned<VkImage> handle;
  Owned<VkImageView> view;
  VkExtent2D extent{};
  VkFormat format = VK_FORMAT_UNDEFINED;
  VkDeviceSize row_bytes = 0;  // of make_host_image(), from row to row

  const std::byte* row(uint32_t y) const { return memory.mapped() + first_row + y * row_bytes; }
  VkDeviceSize first_row = 0;
};

/// `size` 0 makes a buffer of 16 bytes, so that an empty world needs no special case.
world::Result<Buffer> make_buffer(Device& device, VkDeviceSize size, VkBufferUsageFlags usage, MemoryUse use);
/// A buffer that shaders read texel by texel, in this format: by the path of textures, which software reads many lanes
/// at once, while it reads storage buffers lane by lane.
world::Result<Buffer> make_texel_buffer(Device& device, VkDeviceSize size, VkFormat format, VkBufferUsageFlags usage,
                                        MemoryUse use);
world::Result<DeviceImage> make_image(Device& device, VkExtent2D extent, VkFormat format, VkImageUsageFlags usage,
                                      VkImageAspectFlags aspect);
/// A buffer over the rows of an image of make_host_image(), which must have such and outlive it: a shader writes them
/// as it writes any buffer.
world::Result<Buffer> make_buffer_over(Device& device, const DeviceImage& image, VkBufferUsageFlags usage);
/// Puts bytes into a buffer, which is made anew, with room for half as many more, where they don't fit. Without data it
/// only grows.
world::Status fill(Device& device, Buffer& buffer, const void* data, size_t bytes, VkBufferUsageFlags usage,
                   MemoryUse use = MemoryUse::upload);
/// The same for a buffer of texels, within what the device reads of one.
world::Status fill_texels(Device& device, Buffer& buffer, VkFormat format, const void* data, size_t bytes);
/// One of colour whose rows the processor reads where they lie, if the device is a processor itself, which places
/// texels row by row anyway; any other gets that of make_image(), with row_bytes 0.
world::Result<DeviceImage> make_host_image(Device& device, VkExtent2D extent, VkFormat format, VkImageUsageFlags usage);

}  // namespace render::gpu
