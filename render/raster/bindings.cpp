#include "render/raster/bindings.h"

#include "render/raster/barriers.h"

namespace render::raster {

namespace {

constexpr uint32_t kSetsInPool = 64;

bool is_buffer(VkDescriptorType type) {
  return type == VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER || type == VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
}

}  // namespace

world::Status Bindings::open(gpu::Device& device) {
  device_ = &device;
  TRY(no_buffer_, gpu::make_texel_buffer(device, 0, VK_FORMAT_R32G32B32A32_SFLOAT,
                                         VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
                                         gpu::MemoryUse::device));
  TRY(no_image_, gpu::make_image(device, {1, 1}, VK_FORMAT_R32G32B32A32_SFLOAT, VK_IMAGE_USAGE_STORAGE_BIT,
                                 VK_IMAGE_ASPECT_COLOR_BIT));
  TRY_STATUS(device.run([&](VkCommandBuffer commands) {
    image_discard(commands, no_image_.handle, VK_IMAGE_ASPECT_COLOR_BIT, kNothing, kNothing);
  }));
  for (const VkFormat format : {VK_FORMAT_R32G32B32A32_SINT, VK_FORMAT_R32G32B32A32_UINT}) {
    TRY(no_texels_[format], gpu::make_texel_buffer(device, 0, format, 0, gpu::MemoryUse::device));
  }
  empty_.buffer = {no_buffer_.handle, 0, VK_WHOLE_SIZE};
  empty_.image = {VK_NULL_HANDLE, no_image_.view, VK_IMAGE_LAYOUT_GENERAL};
  return {};
}

world::Status Bindings::begin_picture() {
  status_ = {};
  for (auto& pool : pools_) VK_CHECK(vkResetDescriptorPool(device_->handle(), pool, 0));
  pool_ = 0;
  return {};
}

void Bindings::bind(uint32_t binding, const gpu::Buffer& buffer, VkDeviceSize first, VkDeviceSize bytes) {
  bound_[binding] = {.buffer = {buffer.handle, first, bytes}, .texels = buffer.texels, .set = true};
}

void Bindings::bind(uint32_t binding, const gpu::DeviceImage& image, VkSampler sampler) {
  bound_[binding] = {.image = {sampler, image.view, VK_IMAGE_LAYOUT_GENERAL}, .set = true};
}

world::Status Bindings::add_pool() {
  const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 4 * kSetsInPool},
                                        {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 32 * kSetsInPool},
                                        {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 24 * kSetsInPool},
                                        {VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE, 8 * kSetsInPool},
                                        {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 8 * kSetsInPool},
                                        {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 8 * kSetsInPool},
                                        {VK_DESCRIPTOR_TYPE_SAMPLER, 4 * kSetsInPool}};
  auto info = gpu::vk_info<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  info.maxSets = kSetsInPool;
  info.poolSizeCount = std::size(sizes);
  info.pPoolSizes = sizes;
  VkDescriptorPool pool = VK_NULL_HANDLE;
  VK_CHECK(vkCreateDescriptorPool(device_->handle(), &info, nullptr, &pool));
  pools_.emplace_back(*device_, pool);
  return {};
}

world::Result<VkDescriptorSet> Bindings::make_set(const Pipeline& pipeline) {
  VkDescriptorSet set = VK_NULL_HANDLE;
  for (bool fresh = false; !set;) {
    if (pool_ == pools_.size()) {
      TRY_STATUS(add_pool());
      fresh = true;
    }
    auto info = gpu::vk_info<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    info.descriptorPool = pools_[pool_];
    info.descriptorSetCount = 1;
    info.pSetLayouts = pipeline.set_layout.address();
    const VkResult made = vkAllocateDescriptorSets(device_->handle(), &info, &set);
    if (made == VK_SUCCESS) break;
    if (fresh || (made != VK_ERROR_OUT_OF_POOL_MEMORY && made != VK_ERROR_FRAGMENTED_POOL))
      return gpu::vulkan_error("vkAllocateDescriptorSets", made);
    ++pool_;
  }
  std::vector<VkWriteDescriptorSet> writes;
  std::vector<VkBufferView> views;
  views.reserve(pipeline.bindings.size());  // writes point to them
  for (const gpu::ShaderBinding& b : pipeline.bindings) {
    const auto found = bound_.find(b.binding);
    const bool is_set = found != bound_.end() && found->second.set;
    const bool is_texels = b.type == VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
    CHECK(is_set || is_buffer(b.type) || is_texels || b.type == VK_DESCRIPTOR_TYPE_STORAGE_IMAGE);
    const Bound& what = is_set ? found->second : empty_;
    const VkBufferView texels = is_set ? what.texels : empty_texels(b.texels);
    auto write = gpu::vk_info<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    write.dstSet = set;
    write.dstBinding = b.binding;
    write.descriptorCount = 1;
    write.descriptorType = b.type;
    write.pBufferInfo = is_buffer(b.type) ? &what.buffer : nullptr;
    write.pImageInfo = is_buffer(b.type) ? nullptr : &what.image;
    if (is_texels) {
      CHECK(texels != VK_NULL_HANDLE);
      write.pTexelBufferView = &views.emplace_back(texels);
    }
    writes.push_back(write);
  }
  vkUpdateDescriptorSets(device_->handle(), static_cast<uint32_t>(writes.size()), writes.data(), 0, nullptr);
  return set;
}

VkBufferView Bindings::empty_texels(VkFormat format) const {
  const auto integers = no_texels_.find(format);
  return integers == no_texels_.end() ? no_buffer_.texels : integers->second.texels;
}

VkDescriptorSet Bindings::set_for(const Pipeline& pipeline) {
  auto set = make_set(pipeline);
  if (set.ok()) return *set;
  if (status_.ok()) status_ = set.error();
  return VK_NULL_HANDLE;
}

void Bindings::bind_set(VkCommandBuffer commands, const Pipeline& pipeline, VkDescriptorSet set) {
  if (!set) return;
  vkCmdBindPipeline(commands, pipeline.bind_point, pipeline.handle);
  vkCmdBindDescriptorSets(commands, pipeline.bind_point, pipeline.layout, 0, 1, &set, 0, nullptr);
}

}  // namespace render::raster
