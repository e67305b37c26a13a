#include "render/gpu/spirv.h"

#include <algorithm>
#include <map>

namespace render::gpu {

namespace {

enum Op : uint32_t {
  kTypeInt = 21,
  kTypeImage = 25,
  kTypeSampler = 26,
  kTypeSampledImage = 27,
  kTypePointer = 32,
  kVariable = 59,
  kDecorate = 71
};
enum StorageClass : uint32_t { kUniformConstant = 0, kUniform = 2, kStorageBuffer = 12 };
constexpr uint32_t kDecorationBinding = 33;
constexpr size_t kHeaderWords = 5;

/// Types of images and samplers by the id of their type; `known`: those before it.
VkDescriptorType image_type(uint32_t op, std::span<const uint32_t> words,
                            const std::map<uint32_t, VkDescriptorType>& known) {
  if (op == kTypeSampler) return VK_DESCRIPTOR_TYPE_SAMPLER;
  if (op == kTypeSampledImage)
    return known.at(words[2]) == VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER
                                                                         : VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
  // Words of OpTypeImage; kSampled: 1 read with a sampler, 2 read and written without.
  constexpr size_t kDim = 3, kSampled = 7;
  constexpr uint32_t kBuffer = 5;
  if (words[kDim] == kBuffer && words[kSampled] == 1) return VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
  return words[kSampled] == 2 ? VK_DESCRIPTOR_TYPE_STORAGE_IMAGE : VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
}

}  // namespace

std::vector<ShaderBinding> shader_bindings(std::span<const uint32_t> spirv) {
  std::map<uint32_t, uint32_t> binding_of, pointee_of;  // by id
  std::map<uint32_t, VkDescriptorType> opaque_types;    // by id of a type
  std::map<uint32_t, VkFormat> integers, texels_of;     // by id of a type
  std::vector<ShaderBinding> found;
  for (size_t at = kHeaderWords; at < spirv.size();) {
    const uint32_t op = spirv[at] & 0xffff, count = spirv[at] >> 16;
    const auto words = spirv.subspan(at, count);
    if (op == kDecorate && words[2] == kDecorationBinding) binding_of[words[1]] = words[3];
    if (op == kTypeInt) integers[words[1]] = words[3] != 0 ? VK_FORMAT_R32G32B32A32_SINT : VK_FORMAT_R32G32B32A32_UINT;
    if (op == kTypeImage || op == kTypeSampler || op == kTypeSampledImage)
      opaque_types[words[1]] = image_type(op, words, opaque_types);
    if (op == kTypeImage)
      texels_of[words[1]] = integers.contains(words[2]) ? integers.at(words[2]) : VK_FORMAT_R32G32B32A32_SFLOAT;
    if (op == kTypeSampledImage) texels_of[words[1]] = texels_of.at(words[2]);
    if (op == kTypePointer) pointee_of[words[1]] = words[3];
    if (op == kVariable && binding_of.contains(words[2])) {
      const uint32_t binding = binding_of[words[2]];
      if (words[3] == kUniform) found.push_back({binding, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER});
      if (words[3] == kStorageBuffer) found.push_back({binding, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER});
      if (words[3] == kUniformConstant) {
        const uint32_t id = pointee_of.at(words[1]);
        found.push_back({binding, opaque_types.at(id)});
        if (found.back().type == VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER) found.back().texels = texels_of.at(id);
      }
    }
    at += count;
  }
  std::sort(found.begin(), found.end(), [](auto& a, auto& b) { return a.binding < b.binding; });
  return found;
}

}  // namespace render::gpu
