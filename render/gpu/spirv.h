/// What a compiled shader says about itself, so that no C++ repeats it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/gpu/vulkan.h"

namespace render::gpu {

struct ShaderBinding {
  uint32_t binding;
  VkDescriptorType type;
  /// Of a buffer of texels: a format of the numbers that the shader reads, floats, or integers of either kind.
  VkFormat texels = VK_FORMAT_UNDEFINED;
  friend bool operator==(const ShaderBinding&, const ShaderBinding&) = default;
};

/// The bindings of descriptor set 0 that a SPIR-V module declares, sorted by number; no arrays of them. Buffers,
/// sampled and storage images, samplers, both combined. source: Khronos Group. SPIR-V Specification, 1.6
std::vector<ShaderBinding> shader_bindings(std::span<const uint32_t> spirv);

}  // namespace render::gpu
