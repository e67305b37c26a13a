/// The effects of a picture on a device: what chain.h plans, by compute passes on a buffer of radiance.
///
/// A pipeline is made when a plan first asks for it, and buffers as large as it needs; an empty plan makes nothing.
/// fails  where the device can't bind a picture of this size at once (fits() says so before): then chain.h does it
#pragma once

#include <map>

#include "render/effects/chain.h"
#include "render/gpu/owned.h"

namespace render {

/// A picture as it comes from shading.
struct ShadedPicture {
  const gpu::Buffer* radiance = nullptr;
  uint32_t stride = 3;               // floats a pixel
  uint32_t sample = 0, samples = 1;  // of several that are averaged, in order
  bool last() const { return sample + 1 == samples; }
};

class DeviceEffects {
 public:
  DeviceEffects() = default;
  static bool fits(const gpu::Device& device, const EffectPlan& plan);
  /// Before recording. Nothing is to be done, or made, where the plan is empty and there is one sample.
  static bool called_for(const EffectPlan& plan, const ShadedPicture& shaded) {
    return !plan.empty() || shaded.samples > 1;
  }
  world::Status prepare(gpu::Device& device, const EffectPlan& plan, const ShadedPicture& shaded);
  /// After the radiance was written by compute shaders or copies. Marks are called before each of the passes of
  /// effect_passes(), and "add_sample" before those.
  void record(VkCommandBuffer commands, const std::function<void(const char*)>& mark) const;
  /// What the last sample's recording made.
  EffectOutcome read(Image& image) const;
  /// Bytes that buffers of effects take on the device.
  uint64_t bytes() const { return frame_.size + blurred_.size + meter_.size + finished_.size + sum_.size; }
  size_t pipelines() const { return pipelines_.size(); }

 private:
  enum class Shader { finish, bloom_step, meter, add_sample };
  struct Variant {
    Shader shader;
    uint32_t first, second, third;  // specialisation constants
    friend auto operator<=>(const Variant&, const Variant&) = default;
  };
  world::Result<VkPipeline> pipeline(const Variant& variant);
  world::Status fit(gpu::Buffer& buffer, VkDeviceSize bytes, gpu::MemoryUse use, VkBufferUsageFlags usage);
  world::Status open(gpu::Device& device);
  world::Status write_set(VkDescriptorSet set, const gpu::Buffer& picture, const gpu::Buffer& finished) const;

  gpu::Device* device_ = nullptr;
  gpu::Owned<VkDescriptorSetLayout> set_layout_;
  gpu::Owned<VkPipelineLayout> layout_;
  gpu::Owned<VkDescriptorPool> descriptors_;
  VkDescriptorSet set_ = VK_NULL_HANDLE, add_set_ = VK_NULL_HANDLE;
  std::map<Variant, gpu::Owned<VkPipeline>> pipelines_;
  gpu::Buffer frame_, blurred_, meter_, finished_, sum_;
  EffectPlan plan_;
  ShadedPicture shaded_;
  std::string finish_name_;
  std::map<uint32_t, VkPipeline> steps_;
  VkPipeline finish_ = VK_NULL_HANDLE, add_ = VK_NULL_HANDLE, count_ = VK_NULL_HANDLE, resolve_ = VK_NULL_HANDLE;
};

}  // namespace render
