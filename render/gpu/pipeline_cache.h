/// Compiled pipelines, kept on disk from one run to the next: $XDG_CACHE_HOME/loam/pipelines-<device>.bin (or under
/// ~/.cache). A file that isn't whole, or of another driver, is left out and replaced; it is never trusted further than
/// its hash and the header that Vulkan puts into it.
///
///   "LOAMPIPE"  version u32  0 u32  bytes u64  xxHash64 of the bytes u64   then the bytes as the driver gave them
/// fails  never: without a cache pipelines are compiled anew
/// source Vulkan specification, "Pipeline Cache Header"
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "render/gpu/vulkan.h"

namespace render::gpu {

class PipelineCache {
 public:
  PipelineCache() = default;
  PipelineCache(const PipelineCache&) = delete;
  PipelineCache& operator=(const PipelineCache&) = delete;

  /// An empty folder keeps nothing on disk.
  void open(VkPhysicalDevice physical, VkDevice device, const std::filesystem::path& folder);
  /// Writes what is new, and forgets the cache.
  void close();
  VkPipelineCache handle() const { return cache_; }
  /// Why a file was left out; empty where none was.
  const std::string& warning() const { return warning_; }

  /// Where caches lie by the environment; empty where there is no such folder.
  static std::filesystem::path usual_folder();

 private:
  VkDevice device_ = VK_NULL_HANDLE;
  VkPipelineCache cache_ = VK_NULL_HANDLE;
  std::filesystem::path file_;
  size_t read_ = 0;  // bytes
  std::string warning_;
};

}  // namespace render::gpu
