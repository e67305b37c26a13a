/// The world's light around triangles on the device, for shading/voxel_light.glsl.h: a hash table of leaves and the
/// codes of render/light/voxel_light.h. Nothing where a picture has no triangles or asks for no light.
#pragma once

#include <string>

#include "render/gpu/owned.h"
#include "render/light/voxel_light.h"
#include "render/raster/triangles.h"

namespace render::raster {

class TriangleLight {
 public:
  /// Follows the light and the triangles. Returns the bytes sent. Where they are more than the device holds in a
  /// buffer, triangles keep the open sky, and dropped() says so.
  world::Result<uint64_t> follow(gpu::Device& device, const world::WorldView& view, const WorldLight& light,
                                 SurfaceLight::Kind kind, const DrawnTriangles& triangles);

  const gpu::Buffer& leaves() const { return leaves_; }  // without a handle where there is nothing
  const gpu::Buffer& codes() const { return codes_; }
  uint64_t bytes() const { return leaves_.size + codes_.size; }
  const std::string& dropped() const { return dropped_; }
  void describe(PictureConstants& picture) const { picture.voxel_light = uvec4(slots_ - 1, outside_, 0, 0); }
  /// Bytes that a buffer may have, at most the device's limit; tests lower it.
  uint64_t binding_limit = ~uint64_t{0};

 private:
  world::Result<uint64_t> send(gpu::Device& device);

  VoxelLight light_;
  uint64_t triangles_ = 0;                 // version of those that leaves are of
  std::vector<world::RegionPos> regions_;  // that had light then
  std::vector<world::LeafPos> wanted_;
  gpu::Buffer leaves_, codes_;
  uint32_t slots_ = 1, outside_ = kLightUnknown;
  std::string dropped_;
};

}  // namespace render::raster
