/// One Vulkan device, its queue and its memory, headless unless a window asks for one (window.h). What it makes dies
/// before it (see owned.h).
#pragma once

#include <filesystem>
#include <functional>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "render/gpu/memory.h"
#include "render/gpu/pipeline_cache.h"
#include "render/gpu/shader_cache.h"

namespace render::gpu {

struct DeviceOptions {
  /// Loads the validation layer with synchronization validation; fails where it is not installed. LOAM_VALIDATION=1 in
  /// the environment does the same and prints what the layer says.
  bool validation = false;
  /// For tests: asked at each submission; true loses the device there. LOAM_LOSE_DEVICE=N in the environment loses each
  /// device at its Nth.
  std::function<bool()> lose_device = {};
  /// Where compiled pipelines are kept; none: where the environment says, but nowhere with validation.
  std::optional<std::filesystem::path> cache_folder = {};
  /// For tests: optional features that the device is taken to lack.
  std::vector<std::string> without = {};
  /// The same of formats of images that not every device has.
  std::vector<VkFormat> without_formats = {};
  /// Of a window: extensions of the instance, and what makes the surface that the device must be able to present to.
  std::vector<std::string> instance_extensions = {};
  std::function<VkResult(VkInstance, VkSurfaceKHR*)> make_surface = {};
};

/// What the validation layer said, warnings and errors. Lives on the heap: the driver holds its address.
struct DeviceMessages {
  std::mutex mutex;
  std::vector<std::string> texts;
  bool print = false;  // to stderr too: where the environment asked for validation
};

class Device {
 public:
  /// Prefers a discrete, then an integrated GPU, then anything that has Vulkan 1.3 and the features used. Fails with
  /// ErrorKind::no_device and one sentence that names the Debian package to install.
  static world::Result<std::unique_ptr<Device>> make(const DeviceOptions& options = {});
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  VkDevice handle() const { return device_; }
  // For the window.
  VkInstance instance() const { return instance_; }
  VkPhysicalDevice physical() const { return physical_; }
  VkQueue queue() const { return queue_; }
  VkSurfaceKHR surface() const { return surface_; }  // null without a window
  const std::string& name() const { return name_; }
  const VkPhysicalDeviceLimits& limits() const { return limits_; }
  /// Whether images of that format, tiled as the device likes, can be used so.
  bool has_format(VkFormat format, VkFormatFeatureFlags needed) const;
  /// Whether it is software.
  bool is_processor() const { return is_processor_; }
  /// Whether how many indirect draws there are may lie in a buffer.
  bool counts_draws() const { return counts_draws_; }
  /// Whether shaders have atomic numbers of 64 bits; asked of a processor alone.
  bool has_atomic64() const { return has_atomic64_; }
  MemoryPool& memory() { return memory_; }
  std::vector<std::string> messages() const;
  /// What is not as it could be, a sentence each: a feature that the driver lacks, a cache that was left out.
  std::vector<std::string> warnings() const;
  /// For every pipeline that is made.
  VkPipelineCache pipeline_cache() const { return pipelines_.handle(); }
  ShaderCache& shader_cache() { return shaders_; }

  /// Records commands, submits them and waits; on a lost device the error says so and everything later fails too.
  world::Status run(const std::function<void(VkCommandBuffer)>& record);
  /// The same; nothing is submitted where recording fails.
  world::Status run_checked(const std::function<world::Status(VkCommandBuffer)>& record);
  bool lost() const { return lost_; }

  /// Destroys a handle, or frees memory, once the work submitted so far has finished.
  template <class Handle>
  void retire(Handle handle);
  void retire(const MemoryRange& range);

 private:
  struct Retired {
    uint64_t after;  // so many submissions
    VkObjectType type;
    uint64_t handle;
    MemoryRange range;
  };
  Device() = default;
  world::Status open(const DeviceOptions& options);
  world::Status open_instance(bool validation, const DeviceOptions& options);
  world::Status choose_physical(const std::vector<std::string>& without);
  void retire(VkObjectType type, uint64_t handle);
  void destroy(const Retired& retired);
  void collect(uint64_t reached);

  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  VkSurfaceKHR surface_ = VK_NULL_HANDLE;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  uint32_t family_ = 0;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  VkFence finished_ = VK_NULL_HANDLE;  // the submission that is waited for
  uint64_t submitted_ = 0;
  bool lost_ = false;
  std::function<bool()> lose_device_;
  std::string name_;
  VkPhysicalDeviceLimits limits_{};
  std::vector<VkFormat> without_formats_;
  bool is_processor_ = false, counts_draws_ = false, has_atomic64_ = false;
  MemoryPool memory_;
  PipelineCache pipelines_;
  ShaderCache shaders_;
  std::vector<std::string> warnings_;
  std::deque<Retired> retired_;
  std::unique_ptr<DeviceMessages> messages_ = std::make_unique<DeviceMessages>();
};

template <class Handle>
constexpr VkObjectType object_type();
template <>
constexpr VkObjectType object_type<VkBuffer>() {
  return VK_OBJECT_TYPE_BUFFER;
}
template <>
constexpr VkObjectType object_type<VkBufferView>() {
  return VK_OBJECT_TYPE_BUFFER_VIEW;
}
template <>
constexpr VkObjectType object_type<VkImage>() {
  return VK_OBJECT_TYPE_IMAGE;
}
template <>
constexpr VkObjectType object_type<VkImageView>() {
  return VK_OBJECT_TYPE_IMAGE_VIEW;
}
template <>
constexpr VkObjectType object_type<VkPipeline>() {
  return VK_OBJECT_TYPE_PIPELINE;
}
template <>
constexpr VkObjectType object_type<VkPipelineLayout>() {
  return VK_OBJECT_TYPE_PIPELINE_LAYOUT;
}
template <>
constexpr VkObjectType object_type<VkShaderModule>() {
  return VK_OBJECT_TYPE_SHADER_MODULE;
}
template <>
constexpr VkObjectType object_type<VkDescriptorSetLayout>() {
  return VK_OBJECT_TYPE_DESCRIPTOR_SET_LAYOUT;
}
template <>
constexpr VkObjectType object_type<VkDescriptorPool>() {
  return VK_OBJECT_TYPE_DESCRIPTOR_POOL;
}
template <>
constexpr VkObjectType object_type<VkSampler>() {
  return VK_OBJECT_TYPE_SAMPLER;
}
template <>
constexpr VkObjectType object_type<VkQueryPool>() {
  return VK_OBJECT_TYPE_QUERY_POOL;
}

template <class Handle>
void Device::retire(Handle handle) {
  retire(object_type<Handle>(), reinterpret_cast<uint64_t>(handle));
}

/// Sole owner of a range of device memory.
class OwnedMemory {
 public:
  OwnedMemory() = default;
  OwnedMemory(Device& device, const MemoryRange& range) : device_(&device), range_(range) {}
  OwnedMemory(OwnedMemory&& o) noexcept : device_(o.device_), range_(std::exchange(o.range_, MemoryRange{})) {}
  OwnedMemory& operator=(OwnedMemory&& o) noexcept {
    std::swap(device_, o.device_);
    std::swap(range_, o.range_);
    return *this;
  }
  ~OwnedMemory() {
    if (range_.block) device_->retire(range_);
  }
  const MemoryRange& range() const { return range_; }
  std::byte* mapped() const {
    return range_.block && range_.block->mapped ? range_.block->mapped + range_.offset : nullptr;
  }

 private:
  Device* device_ = nullptr;
  MemoryRange range_;
};

}  // namespace render::gpu
