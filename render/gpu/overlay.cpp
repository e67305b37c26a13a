#include "render/gpu/overlay.h"

#include <algorithm>
#include <cmath>

#include "overlay.frag.spv.h"
#include "overlay.vert.spv.h"
#include "render/gpu/barrier.h"

namespace render::gpu {

namespace {

constexpr VkFormat kTextureFormat = VK_FORMAT_R8G8B8A8_UNORM;

world::Result<Owned<VkShaderModule>> make_module(Device& device, std::span<const uint32_t> code) {
  auto info = vk_info<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  info.codeSize = code.size_bytes();
  info.pCode = code.data();
  VkShaderModule module = VK_NULL_HANDLE;
  VK_CHECK(vkCreateShaderModule(device.handle(), &info, nullptr, &module));
  return Owned<VkShaderModule>(device, module);
}

world::Result<Owned<VkSampler>> make_sampler(Device& device, VkFilter filter) {
  auto info = vk_info<VkSamplerCreateInfo>(VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO);
  info.magFilter = info.minFilter = filter;
  info.addressModeU = info.addressModeV = info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  VkSampler sampler = VK_NULL_HANDLE;
  VK_CHECK(vkCreateSampler(device.handle(), &info, nullptr, &sampler));
  return Owned<VkSampler>(device, sampler);
}

}  // namespace

world::Status Overlay::open(Device& device, VkFormat target) {
  device_ = &device;
  TRY(smooth_, make_sampler(device, VK_FILTER_LINEAR));
  TRY(sharp_, make_sampler(device, VK_FILTER_NEAREST));
  const VkDescriptorSetLayoutBinding binding{0, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1,
                                             VK_SHADER_STAGE_FRAGMENT_BIT, nullptr};
  auto set = vk_info<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  set.bindingCount = 1;
  set.pBindings = &binding;
  VkDescriptorSetLayout set_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreateDescriptorSetLayout(device.handle(), &set, nullptr, &set_handle));
  set_layout_ = Owned<VkDescriptorSetLayout>(device, set_handle);
  const VkPushConstantRange push{VK_SHADER_STAGE_VERTEX_BIT, 0, 2 * sizeof(float)};
  auto layout = vk_info<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  layout.setLayoutCount = 1;
  layout.pSetLayouts = set_layout_.address();
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &push;
  VkPipelineLayout layout_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreatePipelineLayout(device.handle(), &layout, nullptr, &layout_handle));
  layout_ = Owned<VkPipelineLayout>(device, layout_handle);
  return make_pipeline(target);
}

world::Status Overlay::make_pipeline(VkFormat target) {
  TRY(const auto vertex, make_module(*device_, overlay_vert_spv));
  TRY(const auto fragment, make_module(*device_, overlay_frag_spv));
  VkPipelineShaderStageCreateInfo stages[2];
  for (int i = 0; i < 2; ++i) {
    stages[i] = vk_info<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
    stages[i].stage = i == 0 ? VK_SHADER_STAGE_VERTEX_BIT : VK_SHADER_STAGE_FRAGMENT_BIT;
    stages[i].module = i == 0 ? vertex : fragment;
    stages[i].pName = "main";
  }
  const VkVertexInputBindingDescription binding{0, sizeof(OverlayVertex), VK_VERTEX_INPUT_RATE_VERTEX};
  const VkVertexInputAttributeDescription attributes[] = {
      {0, 0, VK_FORMAT_R32G32_SFLOAT, 0}, {1, 0, VK_FORMAT_R32G32_SFLOAT, 8}, {2, 0, VK_FORMAT_R8G8B8A8_UNORM, 16}};
  auto input = vk_info<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
  input.vertexBindingDescriptionCount = 1;
  input.pVertexBindingDescriptions = &binding;
  input.vertexAttributeDescriptionCount = 3;
  input.pVertexAttributeDescriptions = attributes;
  auto assembly =
      vk_info<VkPipelineInputAssemblyStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO);
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  auto viewport = vk_info<VkPipelineViewportStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO);
  viewport.viewportCount = viewport.scissorCount = 1;
  auto raster =
      vk_info<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  raster.polygonMode = VK_POLYGON_MODE_FILL;
  raster.cullMode = VK_CULL_MODE_NONE;
  raster.lineWidth = 1;
  auto samples =
      vk_info<VkPipelineMultisampleStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO);
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
  VkPipelineColorBlendAttachmentState attachment{};
  attachment.blendEnable = VK_TRUE;
  attachment.srcColorBlendFactor = VK_BLEND_FACTOR_SRC_ALPHA;
  attachment.dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
  attachment.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
  attachment.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
  attachment.colorWriteMask = VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT;
  auto blend = vk_info<VkPipelineColorBlendStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO);
  blend.attachmentCount = 1;
  blend.pAttachments = &attachment;
  const VkDynamicState states[] = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  auto dynamic = vk_info<VkPipelineDynamicStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO);
  dynamic.dynamicStateCount = 2;
  dynamic.pDynamicStates = states;
  auto rendering = vk_info<VkPipelineRenderingCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO);
  rendering.colorAttachmentCount = 1;
  rendering.pColorAttachmentFormats = &target;
  auto info = vk_info<VkGraphicsPipelineCreateInfo>(VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO, &rendering);
  info.stageCount = 2;
  info.pStages = stages;
  info.pVertexInputState = &input;
  info.pInputAssemblyState = &assembly;
  info.pViewportState = &viewport;
  info.pRasterizationState = &raster;
  info.pMultisampleState = &samples;
  info.pColorBlendState = &blend;
  info.pDynamicState = &dynamic;
  info.layout = layout_;
  VkPipeline pipeline = VK_NULL_HANDLE;
  VK_CHECK(vkCreateGraphicsPipelines(device_->handle(), device_->pipeline_cache(), 1, &info, nullptr, &pipeline));
  pipeline_ = Owned<VkPipeline>(*device_, pipeline);
  return {};
}

world::Status Overlay::make_set(Texture& texture) {
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1};
  auto pool = vk_info<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  pool.maxSets = 1;
  pool.poolSizeCount = 1;
  pool.pPoolSizes = &size;
  VkDescriptorPool pool_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreateDescriptorPool(device_->handle(), &pool, nullptr, &pool_handle));
  texture.pool = Owned<VkDescriptorPool>(*device_, pool_handle);
  auto allocate = vk_info<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
  allocate.descriptorPool = pool_handle;
  allocate.descriptorSetCount = 1;
  allocate.pSetLayouts = set_layout_.address();
  VK_CHECK(vkAllocateDescriptorSets(device_->handle(), &allocate, &texture.set));
  const VkDescriptorImageInfo image{texture.smooth ? smooth_ : sharp_, texture.image.view,
                                    VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
  auto write = vk_info<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
  write.dstSet = texture.set;
  write.descriptorCount = 1;
  write.descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
  write.pImageInfo = &image;
  vkUpdateDescriptorSets(device_->handle(), 1, &write, 0, nullptr);
  return {};
}

world::Status Overlay::set_texture(TextureId id, int width, int height, std::span<const uint8_t> rgba, bool smooth) {
  CHECK_EQ(rgba.size(), static_cast<size_t>(width) * static_cast<size_t>(height) * 4);
  Texture& texture = textures_[id];
  const VkExtent2D extent{static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
  if (texture.image.extent.width != extent.width || texture.image.extent.height != extent.height ||
      texture.smooth != smooth) {
    texture = {};
    texture.smooth = smooth;
    TRY(texture.image,
        make_image(*device_, extent, kTextureFormat, VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT,
                   VK_IMAGE_ASPECT_COLOR_BIT));
    TRY_STATUS(make_set(texture));
    texture.fresh = true;
  }
  TRY_STATUS(fill(*device_, texture.staging, rgba.data(), rgba.size(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT));
  texture.changed = true;
  return {};
}

void Overlay::drop_texture(TextureId id) { textures_.erase(id); }

world::Status Overlay::prepare(const OverlayList& list) {
  TRY_STATUS(
      fill(*device_, vertices_, list.vertices.data(), list.vertices.size_bytes(), VK_BUFFER_USAGE_VERTEX_BUFFER_BIT));
  return fill(*device_, indices_, list.indices.data(), list.indices.size_bytes(), VK_BUFFER_USAGE_INDEX_BUFFER_BIT);
}

void Overlay::record_uploads(VkCommandBuffer commands) {
  for (auto& [id, texture] : textures_) {
    if (!texture.changed) continue;
    const VkImageLayout before = texture.fresh ? VK_IMAGE_LAYOUT_UNDEFINED : VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
    constexpr Access kCopied{VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT};
    layout_barrier(commands, texture.image.handle, VK_IMAGE_ASPECT_COLOR_BIT, before,
                   {VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT, 0}, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, kCopied);
    VkBufferImageCopy copy{};
    copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    copy.imageExtent = {texture.image.extent.width, texture.image.extent.height, 1};
    vkCmdCopyBufferToImage(commands, texture.staging.handle, texture.image.handle, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                           1, &copy);
    layout_barrier(commands, texture.image.handle, VK_IMAGE_ASPECT_COLOR_BIT, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                   kCopied, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL,
                   {VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT, VK_ACCESS_2_SHADER_SAMPLED_READ_BIT});
    texture.fresh = texture.changed = false;
  }
}

void Overlay::record(VkCommandBuffer commands, const OverlayList& list, VkExtent2D extent) {
  if (list.draws.empty()) return;
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_);
  const VkDeviceSize zero = 0;
  const VkBuffer vertices = vertices_.handle;
  vkCmdBindVertexBuffers(commands, 0, 1, &vertices, &zero);
  vkCmdBindIndexBuffer(commands, indices_.handle, 0, VK_INDEX_TYPE_UINT16);
  const float scale[2] = {2.0f / static_cast<float>(extent.width), 2.0f / static_cast<float>(extent.height)};
  vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_VERTEX_BIT, 0, sizeof scale, scale);
  const VkViewport viewport{0, 0, static_cast<float>(extent.width), static_cast<float>(extent.height), 0, 1};
  vkCmdSetViewport(commands, 0, 1, &viewport);
  for (const OverlayDraw& draw : list.draws) {
    const auto found = textures_.find(draw.texture);
    if (found == textures_.end() || draw.indices == 0) continue;
    const auto within = [](float x, uint32_t most) {
      return static_cast<int32_t>(std::clamp(x, 0.0f, static_cast<float>(most)));
    };
    const int32_t x0 = within(std::floor(draw.x0), extent.width), y0 = within(std::floor(draw.y0), extent.height);
    const int32_t x1 = within(std::ceil(draw.x1), extent.width), y1 = within(std::ceil(draw.y1), extent.height);
    if (x1 <= x0 || y1 <= y0) continue;
    const VkRect2D scissor{{x0, y0}, {static_cast<uint32_t>(x1 - x0), static_cast<uint32_t>(y1 - y0)}};
    vkCmdSetScissor(commands, 0, 1, &scissor);
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_, 0, 1, &found->second.set, 0, nullptr);
    vkCmdDrawIndexed(commands, draw.indices, 1, draw.first_index, draw.first_vertex, 0);
  }
}

}  // namespace render::gpu
