#include "render/raster/pipelines.h"

#include <array>

#include "faces.frag.spv.h"
#include "faces.vert.spv.h"
#include "depth_tiles.comp.spv.h"
#include "occlusion.comp.spv.h"
#include "shade.comp.spv.h"

namespace render::raster {

namespace {

world::Result<gpu::Owned<VkShaderModule>> make_module(gpu::Device& device, std::span<const uint32_t> code) {
  auto info = gpu::vk_info<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  info.codeSize = code.size_bytes();
  info.pCode = code.data();
  VkShaderModule module = VK_NULL_HANDLE;
  VK_CHECK(vkCreateShaderModule(device.handle(), &info, nullptr, &module));
  return gpu::Owned<VkShaderModule>(device, module);
}

VkDescriptorType binding_type(uint32_t binding) {
  if (binding == kBindPicture) return VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
  if (binding == kBindSeen || binding == kBindDepth) return VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
  return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
}

/// Specialisation constants, each of 32 bits.
struct Constant {
  uint32_t id, value;
};
template <size_t N>
struct Specialisation {
  std::array<uint32_t, N> values;
  std::array<VkSpecializationMapEntry, N> entries;
  VkSpecializationInfo info;

  explicit Specialisation(const std::array<Constant, N>& constants) {
    for (size_t i = 0; i < N; ++i) {
      values[i] = constants[i].value;
      entries[i] = {constants[i].id, static_cast<uint32_t>(i * sizeof(uint32_t)), sizeof(uint32_t)};
    }
    info = {N, entries.data(), sizeof values, values.data()};
  }
  Specialisation(const Specialisation&) = delete;
};

template <size_t N>
VkPipelineShaderStageCreateInfo stage(VkShaderStageFlagBits which, VkShaderModule module,
                                      const Specialisation<N>& special) {
  auto info = gpu::vk_info<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
  info.stage = which;
  info.module = module;
  info.pName = "main";
  info.pSpecializationInfo = &special.info;
  return info;
}

}  // namespace

world::Status Pipelines::open(gpu::Device& device) {
  device_ = &device;
  std::array<VkDescriptorSetLayoutBinding, kBindings> bindings{};
  for (uint32_t i = 0; i < kBindings; ++i)
    bindings[i] = {i, binding_type(i), 1,
                   VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT | VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  auto set = gpu::vk_info<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  set.bindingCount = kBindings;
  set.pBindings = bindings.data();
  VkDescriptorSetLayout set_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreateDescriptorSetLayout(device.handle(), &set, nullptr, &set_handle));
  set_layout_ = gpu::Owned<VkDescriptorSetLayout>(device, set_handle);

  const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(uint32_t)};
  auto layout = gpu::vk_info<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  layout.setLayoutCount = 1;
  layout.pSetLayouts = set_layout_.address();
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &push;
  VkPipelineLayout layout_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreatePipelineLayout(device.handle(), &layout, nullptr, &layout_handle));
  layout_ = gpu::Owned<VkPipelineLayout>(device, layout_handle);
  TRY(depth_tiles_, compute(depth_tiles_comp_spv, {}));
  TRY(occlusion_, compute(occlusion_comp_spv, {}));
  return {};
}

world::Result<VkPipeline> Pipelines::faces(FaceEdges edges) {
  if (const auto found = faces_.find(edges); found != faces_.end()) return VkPipeline{found->second};
  TRY(const auto vertex, make_module(*device_, faces_vert_spv));
  TRY(const auto fragment, make_module(*device_, faces_frag_spv));
  const Specialisation<1> special(std::array{Constant{kSpecExactEdges, edges == FaceEdges::exact}});
  const VkPipelineShaderStageCreateInfo stages[] = {stage(VK_SHADER_STAGE_VERTEX_BIT, vertex, special),
                                                    stage(VK_SHADER_STAGE_FRAGMENT_BIT, fragment, special)};
  const auto vertices =
      gpu::vk_info<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
  auto assembly =
      gpu::vk_info<VkPipelineInputAssemblyStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO);
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  auto viewport =
      gpu::vk_info<VkPipelineViewportStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO);
  viewport.viewportCount = viewport.scissorCount = 1;
  auto raster =
      gpu::vk_info<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  raster.polygonMode = VK_POLYGON_MODE_FILL;
  raster.cullMode = VK_CULL_MODE_NONE;  // faces that look away are culled by direction, exactly
  raster.lineWidth = 1;
  auto samples =
      gpu::vk_info<VkPipelineMultisampleStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO);
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
  auto depth =
      gpu::vk_info<VkPipelineDepthStencilStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO);
  depth.depthTestEnable = depth.depthWriteEnable = VK_TRUE;
  depth.depthCompareOp = VK_COMPARE_OP_GREATER;  // reversed: 1 at the near plane, 0 at infinity
  VkPipelineColorBlendAttachmentState attachment{};
  attachment.colorWriteMask = VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT;
  auto blend =
      gpu::vk_info<VkPipelineColorBlendStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO);
  blend.attachmentCount = 1;
  blend.pAttachments = &attachment;
  const VkDynamicState states[] = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  auto dynamic = gpu::vk_info<VkPipelineDynamicStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO);
  dynamic.dynamicStateCount = 2;
  dynamic.pDynamicStates = states;
  auto rendering = gpu::vk_info<VkPipelineRenderingCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO);
  rendering.colorAttachmentCount = 1;
  rendering.pColorAttachmentFormats = &kSeenFormat;
  rendering.depthAttachmentFormat = kDepthFormat;

  auto info = gpu::vk_info<VkGraphicsPipelineCreateInfo>(VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO, &rendering);
  info.stageCount = 2;
  info.pStages = stages;
  info.pVertexInputState = &vertices;
  info.pInputAssemblyState = &assembly;
  info.pViewportState = &viewport;
  info.pRasterizationState = &raster;
  info.pMultisampleState = &samples;
  info.pDepthStencilState = &depth;
  info.pColorBlendState = &blend;
  info.pDynamicState = &dynamic;
  info.layout = layout_;
  VkPipeline pipeline = VK_NULL_HANDLE;
  VK_CHECK(vkCreateGraphicsPipelines(device_->handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline));
  faces_[edges] = gpu::Owned<VkPipeline>(*device_, pipeline);
  return pipeline;
}

world::Result<gpu::Owned<VkPipeline>> Pipelines::compute(std::span<const uint32_t> code, const ShadeVariant& variant) {
  TRY(const auto module, make_module(*device_, code));
  const Specialisation<4> special(std::array{Constant{kSpecSunShadow, static_cast<uint32_t>(variant.sun_shadow)},
                                             Constant{kSpecLight, static_cast<uint32_t>(variant.light)},
                                             Constant{kSpecInterpolation, static_cast<uint32_t>(variant.interpolation)},
                                             Constant{kSpecCornerOcclusion, variant.corner_occlusion}});
  auto info = gpu::vk_info<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.stage = stage(VK_SHADER_STAGE_COMPUTE_BIT, module, special);
  info.layout = layout_;
  VkPipeline pipeline = VK_NULL_HANDLE;
  VK_CHECK(vkCreateComputePipelines(device_->handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline));
  return gpu::Owned<VkPipeline>(*device_, pipeline);
}

world::Result<VkPipeline> Pipelines::shade(const ShadeVariant& variant) {
  if (const auto found = shade_.find(variant); found != shade_.end()) return VkPipeline{found->second};
  TRY(shade_[variant], compute(shade_comp_spv, variant));
  return VkPipeline{shade_[variant]};
}

}  // namespace render::raster
