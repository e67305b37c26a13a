#include "render/raster/pipelines.h"

#include <algorithm>

namespace render::raster {

namespace {

world::Result<gpu::Owned<VkShaderModule>> make_module(gpu::Device& device, std::span<const uint32_t> general,
                                                      std::span<const Constant> constants) {
  std::vector<gpu::SpecialConstant> fixed;
  for (const Constant& c : constants) fixed.push_back({c.id, c.value});
  const std::vector<uint32_t> code = device.shader_cache().specialised(general, fixed);
  auto info = gpu::vk_info<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  info.codeSize = code.size() * sizeof code[0];
  info.pCode = code.data();
  VkShaderModule module = VK_NULL_HANDLE;
  VK_CHECK(vkCreateShaderModule(device.handle(), &info, nullptr, &module));
  return gpu::Owned<VkShaderModule>(device, module);
}

VkPipelineShaderStageCreateInfo stage(VkShaderStageFlagBits which, VkShaderModule module) {
  auto info = gpu::vk_info<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
  info.stage = which;
  info.module = module;
  info.pName = "main";
  return info;
}

world::Status make_layout(gpu::Device& device, std::vector<gpu::ShaderBinding> bindings, Pipeline& pipeline) {
  std::sort(bindings.begin(), bindings.end(), [](auto& a, auto& b) { return a.binding < b.binding; });
  bindings.erase(std::unique(bindings.begin(), bindings.end()), bindings.end());
  std::vector<VkDescriptorSetLayoutBinding> slots;
  for (const gpu::ShaderBinding& b : bindings) slots.push_back({b.binding, b.type, 1, pipeline.stages(), nullptr});
  auto set = gpu::vk_info<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  set.bindingCount = static_cast<uint32_t>(slots.size());
  set.pBindings = slots.data();
  VkDescriptorSetLayout set_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreateDescriptorSetLayout(device.handle(), &set, nullptr, &set_handle));
  pipeline.set_layout = gpu::Owned<VkDescriptorSetLayout>(device, set_handle);

  const VkPushConstantRange push{pipeline.stages(), 0, Pipeline::kPushBytes};
  auto layout = gpu::vk_info<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  layout.setLayoutCount = 1;
  layout.pSetLayouts = pipeline.set_layout.address();
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &push;
  VkPipelineLayout layout_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreatePipelineLayout(device.handle(), &layout, nullptr, &layout_handle));
  pipeline.layout = gpu::Owned<VkPipelineLayout>(device, layout_handle);
  pipeline.bindings = std::move(bindings);
  return {};
}

}  // namespace

world::Result<Pipeline> make_compute(gpu::Device& device, std::span<const uint32_t> code,
                                     std::span<const Constant> constants) {
  Pipeline made;
  TRY_STATUS(make_layout(device, gpu::shader_bindings(code), made));
  TRY(const auto module, make_module(device, code, constants));
  auto info = gpu::vk_info<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.stage = stage(VK_SHADER_STAGE_COMPUTE_BIT, module);
  info.layout = made.layout;
  VkPipeline pipeline = VK_NULL_HANDLE;
  VK_CHECK(vkCreateComputePipelines(device.handle(), device.pipeline_cache(), 1, &info, nullptr, &pipeline));
  made.handle = gpu::Owned<VkPipeline>(device, pipeline);
  return made;
}

world::Result<Pipeline> make_graphics(gpu::Device& device, std::span<const uint32_t> vertex_code,
                                      std::span<const uint32_t> fragment_code, const GraphicsState& state,
                                      std::span<const Constant> constants) {
  Pipeline made;
  made.bind_point = VK_PIPELINE_BIND_POINT_GRAPHICS;
  auto bindings = gpu::shader_bindings(vertex_code);
  const auto more = gpu::shader_bindings(fragment_code);
  bindings.insert(bindings.end(), more.begin(), more.end());
  TRY_STATUS(make_layout(device, std::move(bindings), made));
  TRY(const auto vertex, make_module(device, vertex_code, constants));
  TRY(const auto fragment, make_module(device, fragment_code, constants));
  const VkPipelineShaderStageCreateInfo stages[] = {stage(VK_SHADER_STAGE_VERTEX_BIT, vertex),
                                                    stage(VK_SHADER_STAGE_FRAGMENT_BIT, fragment)};
  const auto vertices =
      gpu::vk_info<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
  auto assembly =
      gpu::vk_info<VkPipelineInputAssemblyStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO);
  assembly.topology = state.topology;
  auto viewport =
      gpu::vk_info<VkPipelineViewportStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO);
  viewport.viewportCount = viewport.scissorCount = 1;
  auto raster =
      gpu::vk_info<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  raster.polygonMode = VK_POLYGON_MODE_FILL;
  raster.cullMode = state.cull;
  raster.lineWidth = 1;
  auto samples =
      gpu::vk_info<VkPipelineMultisampleStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO);
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
  auto depth =
      gpu::vk_info<VkPipelineDepthStencilStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO);
  depth.depthTestEnable = state.depth_test;
  depth.depthWriteEnable = state.depth_write;
  depth.depthCompareOp = state.depth_compare;
  depth.stencilTestEnable = state.stencil_test;
  depth.front = depth.back = state.stencil_op;
  auto attachments = state.blend;
  VkPipelineColorBlendAttachmentState all{};
  all.colorWriteMask =
      VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
  if (attachments.empty()) attachments.assign(state.colour.size(), all);
  auto blend =
      gpu::vk_info<VkPipelineColorBlendStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO);
  blend.attachmentCount = static_cast<uint32_t>(attachments.size());
  blend.pAttachments = attachments.data();
  const VkDynamicState states[] = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  auto dynamic = gpu::vk_info<VkPipelineDynamicStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO);
  dynamic.dynamicStateCount = 2;
  dynamic.pDynamicStates = states;
  auto rendering = gpu::vk_info<VkPipelineRenderingCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO);
  rendering.colorAttachmentCount = static_cast<uint32_t>(state.colour.size());
  rendering.pColorAttachmentFormats = state.colour.data();
  rendering.depthAttachmentFormat = state.depth;
  rendering.stencilAttachmentFormat = state.stencil;

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
  info.layout = made.layout;
  VkPipeline pipeline = VK_NULL_HANDLE;
  VK_CHECK(vkCreateGraphicsPipelines(device.handle(), device.pipeline_cache(), 1, &info, nullptr, &pipeline));
  made.handle = gpu::Owned<VkPipeline>(device, pipeline);
  return made;
}

}  // namespace render::raster
