/// The rasterizer's two pipelines and their variants, and the one descriptor layout that all share.
#pragma once

#include <map>

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
  VkPipelineLayout layout() const { return layout_; }
  VkDescriptorSetLayout set_layout() const { return set_layout_; }

 private:
  gpu::Device* device_ = nullptr;
  gpu::Owned<VkDescriptorSetLayout> set_layout_;
  gpu::Owned<VkPipelineLayout> layout_;
  std::map<FaceEdges, gpu::Owned<VkPipeline>> faces_;
  std::map<SunShadow, gpu::Owned<VkPipeline>> shade_;
};

}  // namespace render::raster
