#include "render/gpu/device.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <iostream>

#include "render/gpu/owned.h"

namespace render::gpu {

namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

world::Error no_device(const std::string& what) {
  return {world::ErrorKind::no_device, "cannot draw with Vulkan: " + what};
}

VKAPI_ATTR VkBool32 VKAPI_CALL collect_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                               const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  auto* messages = static_cast<DeviceMessages*>(user);
  const std::lock_guard lock(messages->mutex);
  messages->texts.push_back(data->pMessage);
  if (messages->print) std::cerr << data->pMessage << '\n';
  return VK_FALSE;
}

/// Of processors: no other device is asked for it.
constexpr const char* kAtomic64 = "shaderBufferInt64Atomics";

/// What the program uses of Vulkan 1.3; all of it exists in lavapipe of Debian 12.
struct Features {
  VkPhysicalDeviceVulkan13Features v13 =
      vk_info<VkPhysicalDeviceVulkan13Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES);
  VkPhysicalDeviceVulkan12Features v12 =
      vk_info<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES, &v13);
  VkPhysicalDeviceFeatures2 all =
      vk_info<VkPhysicalDeviceFeatures2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &v12);

  /// Calls see(name, flag) for each feature that the program can't do without.
  template <class See>
  void each(See see) {
    see("drawIndirectFirstInstance", all.features.drawIndirectFirstInstance);
    see("fragmentStoresAndAtomics", all.features.fragmentStoresAndAtomics);
    see("scalarBlockLayout", v12.scalarBlockLayout);
    see("dynamicRendering", v13.dynamicRendering);
    see("synchronization2", v13.synchronization2);
    see("maintenance4", v13.maintenance4);
  }
  /// Calls see(name, flag, what happens without it) for each that it can.
  template <class See>
  void each_optional(See see) {
    see("multiDrawIndirect", all.features.multiDrawIndirect, "each draw is a call of its own");
    see("drawIndirectCount", v12.drawIndirectCount, "draws of what is hidden are read, and draw nothing");
    see("largePoints", all.features.largePoints, "small faces of shapes are drawn as rectangles too");
    see(kAtomic64, all.features.shaderInt64 && v12.shaderBufferInt64Atomics, "small shapes are drawn by pipelines");
  }
};

int preference(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 4;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 3;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return 1;
    default:
      return 0;
  }
}

bool asked_by_environment() {
  const char* value = std::getenv("LOAM_VALIDATION");
  return value && *value && std::strcmp(value, "0") != 0;
}

/// The submission at which the environment wants each device lost; 0: none.
long loss_by_environment() {
  const char* value = std::getenv("LOAM_LOSE_DEVICE");
  return value ? std::strtol(value, nullptr, 10) : 0;
}

}  // namespace

world::Result<std::unique_ptr<Device>> Device::make(const DeviceOptions& options) {
  std::unique_ptr<Device> device(new Device);
  TRY_STATUS(device->open(options));
  return device;
}

world::Status Device::open_instance(bool validation, const DeviceOptions& options) {
  if (volkInitialize() != VK_SUCCESS)
    return no_device(
        "the Vulkan loader is not installed; install the Debian packages libvulkan1 and mesa-vulkan-drivers");
  if (volkGetInstanceVersion() < VK_API_VERSION_1_3)
    return no_device("the Vulkan loader is older than 1.3; install libvulkan1 and mesa-vulkan-drivers of Debian 12");

  auto application = vk_info<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
  application.pApplicationName = "loam";
  application.apiVersion = VK_API_VERSION_1_3;
  auto info = vk_info<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
  info.pApplicationInfo = &application;

  const char* layers[] = {kValidationLayer};
  std::vector<const char*> extensions;
  for (const std::string& name : options.instance_extensions) extensions.push_back(name.c_str());
  const VkValidationFeatureEnableEXT checks[] = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
  auto features = vk_info<VkValidationFeaturesEXT>(VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT);
  features.enabledValidationFeatureCount = 1;
  features.pEnabledValidationFeatures = checks;
  auto messenger = vk_info<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
  messenger.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  messenger.pfnUserCallback = collect_message;
  messenger.pUserData = messages_.get();
  if (validation) {
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = layers;
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    info.pNext = &features;
    features.pNext = &messenger;
  }
  info.enabledExtensionCount = static_cast<uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  const VkResult made = vkCreateInstance(&info, nullptr, &instance_);
  if (made == VK_ERROR_LAYER_NOT_PRESENT)
    return no_device(
        "validation was asked for, but its layer is missing; install the Debian package vulkan-validationlayers");
  if (made != VK_SUCCESS)
    return no_device(std::string("no driver was found (vkCreateInstance returned ") + result_name(made) +
                     "); install the Debian package mesa-vulkan-drivers");
  volkLoadInstance(instance_);
  if (validation) VK_CHECK(vkCreateDebugUtilsMessengerEXT(instance_, &messenger, nullptr, &messenger_));
  if (options.make_surface) VK_CHECK(options.make_surface(instance_, &surface_));
  return {};
}

world::Status Device::choose_physical(const std::vector<std::string>& without) {
  uint32_t count = 0;
  std::vector<VkPhysicalDevice> all;
  if (vkEnumeratePhysicalDevices(instance_, &count, nullptr) == VK_SUCCESS) {
    all.resize(count);
    vkEnumeratePhysicalDevices(instance_, &count, all.data());
    all.resize(count);
  }
  if (all.empty()) return no_device("no graphics driver was found; install the Debian package mesa-vulkan-drivers");

  int best = -1;
  std::string refused;
  for (const VkPhysicalDevice candidate : all) {
    auto driver = vk_info<VkPhysicalDeviceDriverProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES);
    auto properties = vk_info<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &driver);
    vkGetPhysicalDeviceProperties2(candidate, &properties);
    const VkPhysicalDeviceProperties& p = properties.properties;
    Features features;
    std::string missing;
    if (p.apiVersion < VK_API_VERSION_1_3) {
      missing = "Vulkan 1.3";
    } else {
      vkGetPhysicalDeviceFeatures2(candidate, &features.all);
      features.each([&](const char* name, VkBool32 there) {
        if (!there) missing = name;
      });
    }
    uint32_t families = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(candidate, &families, nullptr);
    std::vector<VkQueueFamilyProperties> queues(families);
    vkGetPhysicalDeviceQueueFamilyProperties(candidate, &families, queues.data());
    constexpr VkQueueFlags kNeeded = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
    uint32_t family = 0;
    while (family < families && (queues[family].queueFlags & kNeeded) != kNeeded) ++family;
    if (family == families) missing = "a queue for graphics and compute";
    VkBool32 presents = VK_TRUE;
    if (surface_ && missing.empty()) vkGetPhysicalDeviceSurfaceSupportKHR(candidate, family, surface_, &presents);
    if (!presents) missing = "a way to show pictures in this window";
    if (!missing.empty()) {
      refused = std::string(p.deviceName) + " lacks " + missing;
      continue;
    }
    if (preference(p.deviceType) <= best) continue;
    best = preference(p.deviceType);
    physical_ = candidate;
    family_ = family;
    limits_ = p.limits;
    is_processor_ = p.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
    counts_draws_ = true;
    has_atomic64_ = is_processor_;
    warnings_.clear();
    features.each_optional([&](const char* name, VkBool32 there, const char* else_what) {
      if (std::strcmp(name, kAtomic64) == 0 && !is_processor_) return;
      if (there && std::find(without.begin(), without.end(), name) == without.end()) return;
      warnings_.push_back(std::string(p.deviceName) + " lacks " + name + ": " + else_what);
      if (std::strcmp(name, "multiDrawIndirect") == 0) limits_.maxDrawIndirectCount = 1;
      if (std::strcmp(name, "drawIndirectCount") == 0) counts_draws_ = false;
      if (std::strcmp(name, kAtomic64) == 0) has_atomic64_ = false;
      if (std::strcmp(name, "largePoints") == 0) limits_.pointSizeRange[1] = 1;
    });
    name_ = std::string(p.deviceName) + ", " + driver.driverInfo;
  }
  if (!physical_) return no_device(refused + "; install the Debian package mesa-vulkan-drivers");
  return {};
}

world::Status Device::open(const DeviceOptions& options) {
  lose_device_ = options.lose_device;
  if (const long at = loss_by_environment(); at > 0 && !lose_device_)
    lose_device_ = [left = at]() mutable { return --left == 0; };
  messages_->print = asked_by_environment();
  TRY_STATUS(open_instance(options.validation || asked_by_environment(), options));
  TRY_STATUS(choose_physical(options.without));
  without_formats_ = options.without_formats;

  Features features;
  features.each([](const char*, VkBool32& flag) { flag = VK_TRUE; });
  if (limits_.maxDrawIndirectCount > 1) features.all.features.multiDrawIndirect = VK_TRUE;
  if (counts_draws_) features.v12.drawIndirectCount = VK_TRUE;
  if (limits_.pointSizeRange[1] > 1) features.all.features.largePoints = VK_TRUE;
  if (has_atomic64_) features.all.features.shaderInt64 = features.v12.shaderBufferInt64Atomics = VK_TRUE;
  const float priority = 1;
  auto queue = vk_info<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueFamilyIndex = family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  auto info = vk_info<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, &features.all);
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  const char* swapchain[] = {VK_KHR_SWAPCHAIN_EXTENSION_NAME};
  if (surface_) info.enabledExtensionCount = 1, info.ppEnabledExtensionNames = swapchain;
  VK_CHECK(vkCreateDevice(physical_, &info, nullptr, &device_));
  vkGetDeviceQueue(device_, family_, 0, &queue_);
  memory_.open(physical_, device_);
  const bool validates = options.validation || asked_by_environment();
  const std::filesystem::path cache = options.cache_folder ? *options.cache_folder
                                      : validates          ? std::filesystem::path()
                                                           : PipelineCache::usual_folder();
  pipelines_.open(physical_, device_, cache);
  shaders_.open(cache);
  if (!pipelines_.warning().empty()) warnings_.push_back(pipelines_.warning());

  auto pool = vk_info<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  pool.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
  pool.queueFamilyIndex = family_;
  VK_CHECK(vkCreateCommandPool(device_, &pool, nullptr, &pool_));
  auto commands = vk_info<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
  commands.commandPool = pool_;
  commands.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  commands.commandBufferCount = 1;
  VK_CHECK(vkAllocateCommandBuffers(device_, &commands, &commands_));
  auto fence = vk_info<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
  VK_CHECK(vkCreateFence(device_, &fence, nullptr, &finished_));
  return {};
}

Device::~Device() {
  if (device_) {
    vkDeviceWaitIdle(device_);
    collect(submitted_);
    pipelines_.close();
    vkDestroyFence(device_, finished_, nullptr);
    vkDestroyCommandPool(device_, pool_, nullptr);
    // What still owns memory now would free it on a dead device.
    CHECK(memory_.close());
    vkDestroyDevice(device_, nullptr);
  }
  // Devices that were made meanwhile may have replaced what the loader gave for this instance, by nothing too.
  const auto of_instance = [&](const char* name) { return vkGetInstanceProcAddr(instance_, name); };
  if (surface_)
    reinterpret_cast<PFN_vkDestroySurfaceKHR>(of_instance("vkDestroySurfaceKHR"))(instance_, surface_, nullptr);
  if (messenger_)
    reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(of_instance("vkDestroyDebugUtilsMessengerEXT"))(
        instance_, messenger_, nullptr);
  if (instance_) vkDestroyInstance(instance_, nullptr);
}

std::vector<std::string> Device::warnings() const {
  std::vector<std::string> all = warnings_;
  if (std::string of_shaders = shaders_.warning(); !of_shaders.empty()) all.push_back(std::move(of_shaders));
  return all;
}

std::vector<std::string> Device::messages() const {
  const std::lock_guard lock(messages_->mutex);
  return messages_->texts;
}

world::Status Device::run(const std::function<void(VkCommandBuffer)>& record) {
  return run_checked([&](VkCommandBuffer commands) -> world::Status {
    record(commands);
    return {};
  });
}

world::Status Device::run_checked(const std::function<world::Status(VkCommandBuffer)>& record) {
  const auto checked = [&]() -> world::Status {
    if (lost_) return vulkan_error("an earlier submission", VK_ERROR_DEVICE_LOST);
    VK_CHECK(vkResetCommandPool(device_, pool_, 0));
    auto begin = vk_info<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    VK_CHECK(vkBeginCommandBuffer(commands_, &begin));
    TRY_STATUS(record(commands_));
    VK_CHECK(vkEndCommandBuffer(commands_));

    auto buffer = vk_info<VkCommandBufferSubmitInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO);
    buffer.commandBuffer = commands_;
    auto submit = vk_info<VkSubmitInfo2>(VK_STRUCTURE_TYPE_SUBMIT_INFO_2);
    submit.commandBufferInfoCount = 1;
    submit.pCommandBufferInfos = &buffer;
    VK_CHECK(vkResetFences(device_, 1, &finished_));
    VkResult result =
        lose_device_ && lose_device_() ? VK_ERROR_DEVICE_LOST : vkQueueSubmit2(queue_, 1, &submit, finished_);
    if (result == VK_SUCCESS) {
      ++submitted_;
      result = vkWaitForFences(device_, 1, &finished_, VK_TRUE, UINT64_MAX);
    }
    lost_ = lost_ || result == VK_ERROR_DEVICE_LOST;
    if (result != VK_SUCCESS) return vulkan_error("submitting work and waiting for it", result);
    return {};
  };
  TRY_STATUS(checked());
  collect(submitted_);
  return {};
}

bool Device::has_format(VkFormat format, VkFormatFeatureFlags needed) const {
  if (std::find(without_formats_.begin(), without_formats_.end(), format) != without_formats_.end()) return false;
  VkFormatProperties has{};
  vkGetPhysicalDeviceFormatProperties(physical_, format, &has);
  return (has.optimalTilingFeatures & needed) == needed;
}

void Device::retire(VkObjectType type, uint64_t handle) { retired_.push_back({submitted_, type, handle, {}}); }
void Device::retire(const MemoryRange& range) {
  retired_.push_back({submitted_, VK_OBJECT_TYPE_DEVICE_MEMORY, 0, range});
}

void Device::collect(uint64_t reached) {
  while (!retired_.empty() && retired_.front().after <= reached) {
    destroy(retired_.front());
    retired_.pop_front();
  }
}

void Device::destroy(const Retired& r) {
  switch (r.type) {
    case VK_OBJECT_TYPE_DEVICE_MEMORY:
      return memory_.release(r.range);
    case VK_OBJECT_TYPE_BUFFER:
      return vkDestroyBuffer(device_, reinterpret_cast<VkBuffer>(r.handle), nullptr);
    case VK_OBJECT_TYPE_BUFFER_VIEW:
      return vkDestroyBufferView(device_, reinterpret_cast<VkBufferView>(r.handle), nullptr);
    case VK_OBJECT_TYPE_IMAGE:
      return vkDestroyImage(device_, reinterpret_cast<VkImage>(r.handle), nullptr);
    case VK_OBJECT_TYPE_IMAGE_VIEW:
      return vkDestroyImageView(device_, reinterpret_cast<VkImageView>(r.handle), nullptr);
    case VK_OBJECT_TYPE_PIPELINE:
      return vkDestroyPipeline(device_, reinterpret_cast<VkPipeline>(r.handle), nullptr);
    case VK_OBJECT_TYPE_PIPELINE_LAYOUT:
      return vkDestroyPipelineLayout(device_, reinterpret_cast<VkPipelineLayout>(r.handle), nullptr);
    case VK_OBJECT_TYPE_SHADER_MODULE:
      return vkDestroyShaderModule(device_, reinterpret_cast<VkShaderModule>(r.handle), nullptr);
    case VK_OBJECT_TYPE_DESCRIPTOR_SET_LAYOUT:
      return vkDestroyDescriptorSetLayout(device_, reinterpret_cast<VkDescriptorSetLayout>(r.handle), nullptr);
    case VK_OBJECT_TYPE_DESCRIPTOR_POOL:
      return vkDestroyDescriptorPool(device_, reinterpret_cast<VkDescriptorPool>(r.handle), nullptr);
    case VK_OBJECT_TYPE_SAMPLER:
      return vkDestroySampler(device_, reinterpret_cast<VkSampler>(r.handle), nullptr);
    case VK_OBJECT_TYPE_QUERY_POOL:
      return vkDestroyQueryPool(device_, reinterpret_cast<VkQueryPool>(r.handle), nullptr);
    default:
      CHECK(!"a handle type that Device::destroy does not know");
  }
}

namespace {

world::Result<Buffer> make_without_memory(Device& device, VkDeviceSize size, VkBufferUsageFlags usage) {
  auto info = vk_info<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = size;
  info.usage = usage;
  VkBuffer handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreateBuffer(device.handle(), &info, nullptr, &handle));
  Buffer buffer;
  buffer.size = size;
  buffer.handle = Owned<VkBuffer>(device, handle);
  return buffer;
}

}  // namespace

world::Result<Buffer> make_buffer(Device& device, VkDeviceSize size, VkBufferUsageFlags usage, MemoryUse use) {
  TRY(Buffer buffer, make_without_memory(device, std::max<VkDeviceSize>(size, 16), usage));
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(device.handle(), buffer.handle, &needs);
  TRY(const MemoryRange range, device.memory().allocate(needs, use, false));
  buffer.memory = OwnedMemory(device, range);
  VK_CHECK(vkBindBufferMemory(device.handle(), buffer.handle, range.block->memory, range.offset));
  return buffer;
}

world::Result<Buffer> make_texel_buffer(Device& device, VkDeviceSize size, VkFormat format, VkBufferUsageFlags usage,
                                        MemoryUse use) {
  TRY(Buffer buffer, make_buffer(device, size, usage | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT, use));
  auto info = vk_info<VkBufferViewCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO);
  info.buffer = buffer.handle;
  info.format = format;
  info.range = VK_WHOLE_SIZE;
  VkBufferView view = VK_NULL_HANDLE;
  VK_CHECK(vkCreateBufferView(device.handle(), &info, nullptr, &view));
  buffer.texels = Owned<VkBufferView>(device, view);
  return buffer;
}

world::Status fill(Device& device, Buffer& buffer, const void* data, size_t bytes, VkBufferUsageFlags usage,
                   MemoryUse use) {
  if (buffer.size < bytes || !buffer.handle) {
    TRY(buffer, make_buffer(device, bytes + bytes / 2, usage, use));
  }
  if (bytes && data) std::memcpy(buffer.mapped(), data, bytes);
  return {};
}

world::Status fill_texels(Device& device, Buffer& buffer, VkFormat format, const void* data, size_t bytes) {
  if (buffer.size < bytes || !buffer.handle) {
    const size_t most = device.limits().maxTexelBufferElements;  // a texel is at least a byte
    const size_t room = std::max(bytes, std::min(bytes + bytes / 2, most));
    TRY(buffer, make_texel_buffer(device, room, format, 0, MemoryUse::upload));
  }
  if (bytes) std::memcpy(buffer.mapped(), data, bytes);
  return {};
}

namespace {

world::Result<DeviceImage> make_tiled_image(Device& device, VkExtent2D extent, VkFormat format, VkImageUsageFlags usage,
                                            VkImageAspectFlags aspect, VkImageTiling tiling) {
  auto info = vk_info<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = format;
  info.extent = {extent.width, extent.height, 1};
  info.mipLevels = info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.tiling = tiling;
  info.usage = usage;
  VkImage handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreateImage(device.handle(), &info, nullptr, &handle));
  DeviceImage image;
  image.extent = extent;
  image.format = format;
  image.handle = Owned<VkImage>(device, handle);
  const bool linear = tiling == VK_IMAGE_TILING_LINEAR;
  VkMemoryRequirements needs;
  vkGetImageMemoryRequirements(device.handle(), handle, &needs);
  TRY(const MemoryRange range, device.memory().allocate(needs, linear ? MemoryUse::readback : MemoryUse::device, true));
  image.memory = OwnedMemory(device, range);
  VK_CHECK(vkBindImageMemory(device.handle(), handle, range.block->memory, range.offset));
  if (linear) {
    const VkImageSubresource all{aspect, 0, 0};
    VkSubresourceLayout layout{};
    vkGetImageSubresourceLayout(device.handle(), handle, &all, &layout);
    image.first_row = layout.offset, image.row_bytes = layout.rowPitch;
  }
  auto view = vk_info<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
  view.image = handle;
  view.viewType = VK_IMAGE_VIEW_TYPE_2D;
  view.format = format;
  view.subresourceRange = {aspect, 0, 1, 0, 1};
  VkImageView view_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreateImageView(device.handle(), &view, nullptr, &view_handle));
  image.view = Owned<VkImageView>(device, view_handle);
  return image;
}

}  // namespace

world::Result<DeviceImage> make_image(Device& device, VkExtent2D extent, VkFormat format, VkImageUsageFlags usage,
                                      VkImageAspectFlags aspect) {
  return make_tiled_image(device, extent, format, usage, aspect, VK_IMAGE_TILING_OPTIMAL);
}

world::Result<Buffer> make_buffer_over(Device& device, const DeviceImage& image, VkBufferUsageFlags usage) {
  TRY(Buffer buffer, make_without_memory(device, image.row_bytes * image.extent.height, usage));
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(device.handle(), buffer.handle, &needs);
  const MemoryRange& rows = image.memory.range();
  CHECK((rows.offset + image.first_row) % needs.alignment == 0);
  VK_CHECK(vkBindBufferMemory(device.handle(), buffer.handle, rows.block->memory, rows.offset + image.first_row));
  return buffer;
}

world::Result<DeviceImage> make_host_image(Device& device, VkExtent2D extent, VkFormat format,
                                           VkImageUsageFlags usage) {
  VkImageFormatProperties can{};
  const bool in_rows = device.is_processor() &&
                       vkGetPhysicalDeviceImageFormatProperties(device.physical(), format, VK_IMAGE_TYPE_2D,
                                                                VK_IMAGE_TILING_LINEAR, usage, 0, &can) == VK_SUCCESS &&
                       can.maxExtent.width >= extent.width && can.maxExtent.height >= extent.height;
  return make_tiled_image(device, extent, format, usage, VK_IMAGE_ASPECT_COLOR_BIT,
                          in_rows ? VK_IMAGE_TILING_LINEAR : VK_IMAGE_TILING_OPTIMAL);
}

}  // namespace render::gpu
