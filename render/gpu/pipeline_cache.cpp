#include "render/gpu/pipeline_cache.h"

#include <cstdlib>
#include <cstring>

#include <fmt/format.h>
#include <xxhash.h>

#include "world/base/file.h"

namespace render::gpu {

namespace {

constexpr char kMagic[8] = {'L', 'O', 'A', 'M', 'P', 'I', 'P', 'E'};
constexpr uint32_t kVersion = 1;
constexpr uint64_t kMostBytes = uint64_t{1} << 28;

struct Header {
  char magic[8];
  uint32_t version, zero;
  uint64_t bytes, hash;
};
static_assert(sizeof(Header) == 32);

/// What is wrong with a file; empty where it is whole and of this device.
std::string fault_of(const std::vector<uint8_t>& file, const VkPhysicalDeviceProperties& device) {
  Header h;
  if (file.size() < sizeof h) return "it ends within its header";
  std::memcpy(&h, file.data(), sizeof h);
  if (std::memcmp(h.magic, kMagic, sizeof kMagic) != 0 || h.version != kVersion) return "it isn't one of this program";
  const uint8_t* data = file.data() + sizeof h;
  if (h.bytes != file.size() - sizeof h) return "it doesn't have the bytes that it claims";
  if (XXH64(data, h.bytes, 0) != h.hash) return "its bytes have changed";
  VkPipelineCacheHeaderVersionOne of_driver;
  if (h.bytes < sizeof of_driver) return "it lacks the driver's header";
  std::memcpy(&of_driver, data, sizeof of_driver);
  if (of_driver.headerVersion != VK_PIPELINE_CACHE_HEADER_VERSION_ONE || of_driver.vendorID != device.vendorID ||
      of_driver.deviceID != device.deviceID ||
      std::memcmp(of_driver.pipelineCacheUUID, device.pipelineCacheUUID, VK_UUID_SIZE) != 0)
    return "it is of another driver";
  return {};
}

}  // namespace

std::filesystem::path PipelineCache::usual_folder() {
  if (const char* set = std::getenv("XDG_CACHE_HOME"); set && *set == '/') return std::filesystem::path(set) / "loam";
  if (const char* home = std::getenv("HOME"); home && *home == '/')
    return std::filesystem::path(home) / ".cache" / "loam";
  return {};
}

void PipelineCache::open(VkPhysicalDevice physical, VkDevice device, const std::filesystem::path& folder) {
  device_ = device;
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(physical, &properties);
  std::vector<uint8_t> file;
  if (!folder.empty()) {
    file_ = folder / fmt::format("pipelines-{:08x}-{:08x}.bin", properties.vendorID, properties.deviceID);
    std::error_code ignored;
    if (std::filesystem::exists(file_, ignored)) {
      auto read = world::read_file(file_, kMostBytes);
      const std::string fault = read.ok() ? fault_of(*read, properties) : read.error().message;
      if (fault.empty())
        file = std::move(*read);
      else
        warning_ = fmt::format("the pipeline cache {} is left out: {}; it will be made anew", file_.string(), fault);
    }
  }
  auto info = vk_info<VkPipelineCacheCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO);
  if (!file.empty())
    info.initialDataSize = file.size() - sizeof(Header), info.pInitialData = file.data() + sizeof(Header);
  read_ = info.initialDataSize;
  // Without one pipelines are made as well.
  if (vkCreatePipelineCache(device, &info, nullptr, &cache_) != VK_SUCCESS) cache_ = VK_NULL_HANDLE;
}

void PipelineCache::close() {
  if (!cache_) return;
  size_t size = 0;
  if (!file_.empty() && vkGetPipelineCacheData(device_, cache_, &size, nullptr) == VK_SUCCESS && size != read_ &&
      size <= kMostBytes) {
    std::string bytes(sizeof(Header) + size, '\0');
    if (vkGetPipelineCacheData(device_, cache_, &size, bytes.data() + sizeof(Header)) == VK_SUCCESS) {
      bytes.resize(sizeof(Header) + size);
      Header h{{}, kVersion, 0, size, XXH64(bytes.data() + sizeof(Header), size, 0)};
      std::memcpy(h.magic, kMagic, sizeof kMagic);
      std::memcpy(bytes.data(), &h, sizeof h);
      // A cache that can't be kept is no fault.
      std::error_code ignored;
      std::filesystem::create_directories(file_.parent_path(), ignored);
      (void)world::write_bytes_atomically(file_, bytes);
    }
  }
  vkDestroyPipelineCache(device_, cache_, nullptr);
  cache_ = VK_NULL_HANDLE;
}

}  // namespace render::gpu
