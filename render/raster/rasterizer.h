/// Draws extracted faces with Vulkan: one indirect draw a page of faces says which face each pixel sees, and one
/// compute pass turns that into radiance. Knows nothing of the store; the backend in raster.h feeds it.
#pragma once

#include <memory>

#include "render/backend.h"
#include "render/gpu/owned.h"
#include "render/raster/culling.h"
#include "render/raster/face_pool.h"
#include "render/raster/pipelines.h"
#include "render/light/sun_map.h"
#include "render/raster/light_grid.h"
#include "render/raster/shadow_grid.h"
#include "render/shading.h"

namespace render::raster {

class Rasterizer {
 public:
  static world::Result<std::unique_ptr<Rasterizer>> make(const gpu::DeviceOptions& options);

  /// Follows the extractor. Returns the bytes sent.
  world::Result<uint64_t> set_faces(std::span<const ExtractedChunk* const> chunks) {
    return pool_.update(*device_, chunks);
  }
  /// near: view depth in metres closer than which nothing lies in the picture.
  world::Result<Frame> draw(const Camera& camera, const world::Environment& environment, const Shading& shading,
                            SurfaceLight::Kind light, const RenderKnobs& knobs, double near, int width, int height);

  /// Used where knobs.sun_shadow is ray, and for corner_occlusion.
  ShadowGrid& shadow_grid() { return shadow_grid_; }
  LightGrid& light_grid() { return light_grid_; }
  /// Sends the map where it has a new version. Returns the bytes sent.
  world::Result<uint64_t> follow_sun_map(const SunMap& map);
  /// Bytes that one storage buffer binding may reach, at most the device's; tests lower it.
  uint64_t binding_limit = ~uint64_t{0};

  gpu::Device& device() { return *device_; }
  FacePool& pool() { return pool_; }

 private:
  struct Targets {
    int width = 0, height = 0;
    gpu::DeviceImage seen, depth;
    gpu::Buffer radiance, tiles;
    uint32_t band_rows = 0;  // rows whose radiance fits one storage buffer binding
  };
  Rasterizer() = default;
  world::Status open(const gpu::DeviceOptions& options);
  world::Status fit_targets(int width, int height);
  world::Status fit_indices();
  world::Status fill(gpu::Buffer& buffer, const void* data, size_t bytes, VkBufferUsageFlags usage,
                     gpu::MemoryUse use = gpu::MemoryUse::upload);
  world::Status write_sets();
  void record(VkCommandBuffer commands, VkPipeline faces, VkPipeline shade);
  void record_faces(VkCommandBuffer commands, VkPipeline faces, bool second);
  void record_occlusion(VkCommandBuffer commands);
  void record_shading(VkCommandBuffer commands, VkPipeline shade);

  std::unique_ptr<gpu::Device> device_;  // first member: dies last
  Pipelines pipelines_;
  FacePool pool_;
  ShadowGrid shadow_grid_;
  LightGrid light_grid_;
  gpu::Buffer sun_map_;
  shared::SunMapFrame sun_map_frame_{};
  uint64_t sun_map_version_ = 0;
  Targets targets_;
  gpu::Owned<VkDescriptorPool> descriptors_;
  uint32_t descriptor_sets_ = 0;
  std::vector<VkDescriptorSet> page_sets_, band_sets_;
  gpu::Owned<VkQueryPool> times_;
  gpu::Buffer indices_, picture_, chunks_, draws_, materials_, candidates_, visible_;
  uint32_t indexed_records_ = 0;
  DrawList list_;
};

}  // namespace render::raster
