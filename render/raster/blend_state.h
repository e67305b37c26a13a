/// render/image/blend.h as Vulkan takes it.
#pragma once

#include "render/gpu/vulkan.h"
#include "render/image/blend.h"

namespace render::raster {

constexpr VkBlendFactor vulkan_factor(BlendFactor factor) {
  constexpr VkBlendFactor kFactors[] = {VK_BLEND_FACTOR_ZERO,
                                        VK_BLEND_FACTOR_ONE,
                                        VK_BLEND_FACTOR_SRC_COLOR,
                                        VK_BLEND_FACTOR_ONE_MINUS_SRC_COLOR,
                                        VK_BLEND_FACTOR_DST_COLOR,
                                        VK_BLEND_FACTOR_ONE_MINUS_DST_COLOR,
                                        VK_BLEND_FACTOR_SRC_ALPHA,
                                        VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
                                        VK_BLEND_FACTOR_DST_ALPHA,
                                        VK_BLEND_FACTOR_ONE_MINUS_DST_ALPHA,
                                        VK_BLEND_FACTOR_CONSTANT_COLOR,
                                        VK_BLEND_FACTOR_ONE_MINUS_CONSTANT_COLOR,
                                        VK_BLEND_FACTOR_CONSTANT_ALPHA,
                                        VK_BLEND_FACTOR_ONE_MINUS_CONSTANT_ALPHA,
                                        VK_BLEND_FACTOR_SRC_ALPHA_SATURATE};
  static_assert(sizeof kFactors / sizeof kFactors[0] == static_cast<size_t>(BlendFactor::count));
  return kFactors[static_cast<size_t>(factor)];
}

constexpr VkBlendOp vulkan_equation(BlendEquation equation) {
  constexpr VkBlendOp kEquations[] = {VK_BLEND_OP_ADD, VK_BLEND_OP_SUBTRACT, VK_BLEND_OP_REVERSE_SUBTRACT,
                                      VK_BLEND_OP_MIN, VK_BLEND_OP_MAX};
  static_assert(sizeof kEquations / sizeof kEquations[0] == static_cast<size_t>(BlendEquation::count));
  return kEquations[static_cast<size_t>(equation)];
}

/// Its constant is set apart: vkCmdSetBlendConstants.
constexpr VkPipelineColorBlendAttachmentState blend_attachment(const BlendState& state) {
  static_assert(int{kMaskRed} == VK_COLOR_COMPONENT_R_BIT && int{kMaskGreen} == VK_COLOR_COMPONENT_G_BIT &&
                int{kMaskBlue} == VK_COLOR_COMPONENT_B_BIT && int{kMaskAlpha} == VK_COLOR_COMPONENT_A_BIT);
  return {VK_TRUE,
          vulkan_factor(state.source),
          vulkan_factor(state.destination),
          vulkan_equation(state.equation),
          vulkan_factor(state.source_alpha),
          vulkan_factor(state.destination_alpha),
          vulkan_equation(state.equation_alpha),
          state.mask};
}

}  // namespace render::raster
