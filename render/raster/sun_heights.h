/// The height map of rays to the sun (world/store/parallel_rays.h) on the device: of most points of surfaces it says
/// whether they see the sun, for the price of one look; a ray from any other needs to be followed a few voxels only.
///
///   blocks of 64 x 64 cells, row by row -> a texel a cell: end | shut << 16
/// fails  never: where the map is too large for the device there is none, and rays are cast as far as they go
#pragma once

#include <optional>

#include "render/camera.h"
#include "render/gpu/owned.h"
#include "render/raster/raster.shared.h"
#include "world/store/parallel_rays.h"

namespace render::raster {

class SunHeights {
 public:
  world::Status open(gpu::Device& device);
  /// Sends what has changed of the map. Returns the bytes sent.
  world::Result<uint64_t> follow(gpu::Device& device, const world::ParallelRays& rays);
  /// There is no map.
  world::Status clear(gpu::Device& device);
  void describe(const Camera& camera, PictureConstants& picture) const;

  const gpu::Buffer& cells() const { return cells_; }
  /// Bytes that the buffer may have, at most the device's limit.
  uint64_t binding_limit = uint64_t{512} << 20;

 private:
  gpu::Buffer cells_;
  std::optional<world::ParallelRays::Frame> frame_;  // none: no map
  std::vector<uint64_t> sent_;                       // version of each block on the device
  uint64_t version_ = 0;
};

}  // namespace render::raster
