/// The rasterizer's pipelines and their variants, and the one descriptor layout that all share.
#pragma once

#include <map>
#include <span>

#include "render/gpu/owned.h"
#include "render/light/surface_light.h"
#include "render/raster/raster.shared.h"

namespace render::raster {

constexpr VkFormat kSeenFormat = VK_FORMAT_R32G32_UINT;
constexpr VkFormat kDepthFormat = VK_FORMAT_D32_SFLOAT;

/// What the shading pass is compiled for: what a picture doesn't ask for isn't in it.
struct ShadeVariant {
  SunShadow sun_shadow = SunShadow::none;
  SurfaceLight::Kind light = SurfaceLight::Kind::none;
  LightInterpolation interpolation = LightInterpolation::face;
  bool corner_occlusion = false;
  friend auto operator<=>(const ShadeVariant&, const ShadeVariant&) = default;
};

class Pipelines {
 public:
  world::Status open(gpu::Device& device);

  /// Variants are made on first use.
  world::Result<VkPipeline> faces(FaceEdges edges);
  world::Result<VkPipeline> shade(const ShadeVariant& variant);
  VkPipeline depth_tiles() const { return depth_tiles_; }
  VkPipeline occlusion() const { return occlusion_; }
  VkPipelineLayout layout() const { return layout_; }
  VkDescriptorSetLayout set_layout() const { return set_layout_; }

 private:
  world::Result<gpu::Owned<VkPipeline>> compute(std::span<const uint32_t> code, const ShadeVariant& variant);

  gpu::Device* device_ = nullptr;
  gpu::Owned<VkDescriptorSetLayout> set_layout_;
  gpu::Owned<VkPipelineLayout> layout_;
  std::map<FaceEdges, gpu::Owned<VkPipeline>> faces_;
  std::map<ShadeVariant, gpu::Owned<VkPipeline>> shade_;
  gpu::Owned<VkPipeline> depth_tiles_, occlusion_;
};

}  // namespace render::raster
