/// Makes pipelines from compiled shaders. Bindings are read from the SPIR-V: each pipeline's layout holds those that
/// its shaders declare, in descriptor set 0, and 128 bytes of push constants.
#pragma once

#include <span>

#include "render/gpu/owned.h"
#include "render/gpu/spirv.h"

namespace render::raster {

/// A specialisation constant of 32 bits; bools are 0 and 1.
struct Constant {
  uint32_t id, value;
  friend auto operator<=>(const Constant&, const Constant&) = default;
};

struct Pipeline {
  gpu::Owned<VkDescriptorSetLayout> set_layout;
  gpu::Owned<VkPipelineLayout> layout;
  gpu::Owned<VkPipeline> handle;
  VkPipelineBindPoint bind_point = VK_PIPELINE_BIND_POINT_COMPUTE;
  std::vector<gpu::ShaderBinding> bindings;

  explicit operator bool() const { return handle != VK_NULL_HANDLE; }
  /// For all stages of the pipeline, from byte 0.
  template <class T>
  void push(VkCommandBuffer commands, const T& constants) const {
    static_assert(sizeof(T) <= kPushBytes && sizeof(T) % 4 == 0);
    vkCmdPushConstants(commands, layout, stages(), 0, sizeof(T), &constants);
  }
  static constexpr uint32_t kPushBytes = 128;  // what every device has

  VkShaderStageFlags stages() const {
    return bind_point == VK_PIPELINE_BIND_POINT_COMPUTE
               ? VkShaderStageFlags{VK_SHADER_STAGE_COMPUTE_BIT}
               : VkShaderStageFlags{VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT};
  }
};

/// Of a graphics pipeline; viewport and scissor are dynamic, no vertex attributes, dynamic rendering.
struct GraphicsState {
  VkPrimitiveTopology topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  std::vector<VkFormat> colour{};
  std::vector<VkPipelineColorBlendAttachmentState> blend{};  // by colour target; empty: all are written, none blends
  VkFormat depth = VK_FORMAT_UNDEFINED, stencil = VK_FORMAT_UNDEFINED;
  bool depth_test = true, depth_write = true;
  VkCompareOp depth_compare = VK_COMPARE_OP_GREATER;  // reversed: 1 at the near plane, 0 at infinity
  bool stencil_test = false;
  VkStencilOpState stencil_op{};  // both sides
  VkCullModeFlags cull = VK_CULL_MODE_NONE;
};

world::Result<Pipeline> make_compute(gpu::Device& device, std::span<const uint32_t> code,
                                     std::span<const Constant> constants = {});
world::Result<Pipeline> make_graphics(gpu::Device& device, std::span<const uint32_t> vertex,
                                      std::span<const uint32_t> fragment, const GraphicsState& state,
                                      std::span<const Constant> constants = {});

}  // namespace render::raster
