/// Light on visible faces on the device: the arrays of render/light/surface_light.h with a hash table of regions before
/// them. Empty where a picture uses none.
#pragma once

#include <optional>

#include "render/gpu/owned.h"
#include "render/light/surface_light.h"
#include "render/raster/raster.shared.h"

namespace render::raster {

class LightGrid {
 public:
  world::Status open(gpu::Device& device);
  /// Sends what has a new version, and of that only what differs, where the light says so. Returns the bytes sent.
  world::Result<uint64_t> follow(gpu::Device& device, const SurfaceLight& light);

  const gpu::Buffer& regions() const { return regions_; }
  const gpu::Buffer& leaf_of() const { return leaf_of_; }
  const gpu::Buffer& leaves() const { return leaves_; }
  const gpu::Buffer& codes() const { return codes_; }
  uint32_t table_size() const { return table_size_; }
  /// Bytes that a buffer may have, at most the device's limit; tests lower it.
  uint64_t binding_limit = ~uint64_t{0};

 private:
  world::Result<uint64_t> send(gpu::Device& device, const SurfaceLight& light);
  /// The leaves that light.patched() names; nothing sent where the buffers lack the room.
  world::Result<std::optional<uint64_t>> send_patched(gpu::Device& device, const SurfaceLight& light);
  gpu::Buffer regions_, leaf_of_, leaves_, codes_;
  uint32_t table_size_ = 1;
  uint64_t version_ = 0;
  size_t regions_sent_ = 0;
};

}  // namespace render::raster
