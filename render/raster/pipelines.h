/// The rasterizer's pipelines and their variants, and the one descriptor layout that all share.
#pragma once

#include <map>
#include <span>

#include "render/gpu/owned.h"
#include "render/knobs.h"
#include "render/raster/raster.shared.h"

namespace render::raster {

constexpr VkFormat kSeenFormat = VK_FORMAT_R32G32_UINT;
constexpr VkFormat kDepthFormat = VK_FORMAT_D32_SFLOAT;

class Pipelines {
 public:
  world::Status open(gpu::Device& device);

  /// Variants are made on first use.
  world::Result<VkPipeline> faces(FaceEdges edges);
  world::Result<VkPipeline> shade(SunShadow shadow);
  VkPipeline depth_tiles() const { return depth_tiles_; }
  VkPipeline occlusion() const { return occlusion_; }
  VkPipelineLayout layout() const { return layout_; }
  VkDescriptorSetLayout set_layout() const { return set_layout_; }

 private:
  world::Result<gpu::Owned<VkPipeline>> compute(std::span<const uint32_t> code, bool sun_shadow);

  gpu::Device* device_ = nullptr;
  gpu::Owned<VkDescriptorSetLayout> set_layout_;
  gpu::Owned<VkPipelineLayout> layout_;
  std::map<FaceEdges, gpu::Owned<VkPipeline>> faces_;
  std::map<SunShadow, gpu::Owned<VkPipeline>> shade_;
  gpu::Owned<VkPipeline> depth_tiles_, occlusion_;
};

}  // namespace render::raster
