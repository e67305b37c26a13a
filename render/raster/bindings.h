/// What is bound to which number (raster.shared.h) while a picture is recorded, and the descriptor sets made of it. A
/// set holds just the bindings that its pipeline declares, as they are at that moment.
#pragma once

#include <map>
#include <vector>

#include "render/raster/pipelines.h"

namespace render::raster {

class Bindings {
 public:
  world::Status open(gpu::Device& device);
  /// Before a picture is recorded: earlier sets go, what is bound stays until it is bound anew. The one who owns a
  /// buffer or an image binds it in each picture that uses it.
  world::Status begin_picture();

  void bind(uint32_t binding, const gpu::Buffer& buffer, VkDeviceSize first = 0, VkDeviceSize bytes = VK_WHOLE_SIZE);
  void bind(uint32_t binding, const gpu::DeviceImage& image, VkSampler sampler = VK_NULL_HANDLE);

  /// For a pass that binds something else for a while: what is bound, to be bound again.
  struct Bound {
    VkDescriptorBufferInfo buffer{};
    VkDescriptorImageInfo image{};
    VkBufferView texels = VK_NULL_HANDLE;
    bool set = false;
  };
  Bound bound(uint32_t binding) { return bound_[binding]; }
  void bind(uint32_t binding, const Bound& again) { bound_[binding] = again; }

  /// What was bound is no more: shaders that declare the number get an empty buffer or storage image.
  void forget(uint32_t binding) { bound_.erase(binding); }
  void forget_all() { bound_.clear(); }

  /// Binds the pipeline and a set of what is bound now. A buffer or storage image that nobody has bound is an empty
  /// one, as is a buffer of texels; any other image without a binding is a bug.
  void use(VkCommandBuffer commands, const Pipeline& pipeline) { bind_set(commands, pipeline, set_for(pipeline)); }
  /// The two halves of use(), for pipelines that take turns: each has a set of its own, since what a shader doesn't use
  /// under its constants is not in its layout. A set that couldn't be made (see status()) binds nothing.
  VkDescriptorSet set_for(const Pipeline& pipeline);
  static void bind_set(VkCommandBuffer commands, const Pipeline& pipeline, VkDescriptorSet set);
  /// Of the sets made since begin_picture(); a picture with a failure must not be submitted.
  const world::Status& status() const { return status_; }

 private:
  world::Result<VkDescriptorSet> make_set(const Pipeline& pipeline);
  world::Status add_pool();
  /// Of the numbers that a shader reads.
  VkBufferView empty_texels(VkFormat format) const;

  gpu::Device* device_ = nullptr;
  std::map<uint32_t, Bound> bound_;
  Bound empty_;
  gpu::Buffer no_buffer_;                      // its texels are floats
  std::map<VkFormat, gpu::Buffer> no_texels_;  // of integers
  gpu::DeviceImage no_image_;
  std::vector<gpu::Owned<VkDescriptorPool>> pools_;
  size_t pool_ = 0;  // the one in use; those before are full
  world::Status status_;
};

}  // namespace render::raster
