/// The opaque voxels of a world on the device, for rays towards the sun: a hash table of regions; a word for each of a
/// region's 16^3 leaves; and 64 bytes a mixed leaf (see raster.shared.h). Clear and full leaves cost no mask.
#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include "render/gpu/owned.h"
#include "render/raster/raster.shared.h"
#include "world/store/mask_volume.h"

namespace render::raster {

class ShadowGrid {
 public:
  world::Status open(gpu::Device& device);
  /// Sends the whole volume.
  world::Result<uint64_t> rebuild(gpu::Device& device, const world::MaskVolume& opaque);
  /// Sends the regions that hold these leaves. Returns the bytes sent.
  world::Result<uint64_t> update(gpu::Device& device, const world::MaskVolume& opaque,
                                 std::span<const world::LeafPos> dirty);

  const gpu::Buffer& regions() const { return regions_; }
  const gpu::Buffer& leaves() const { return leaves_; }
  const gpu::Buffer& masks() const { return masks_; }
  world::RegionPos min_region() const { return min_; }
  world::RegionPos max_region() const { return max_; }
  /// Bytes that a buffer may have, at most the device's limit; tests lower it.
  uint64_t binding_limit = ~uint64_t{0};
  uint32_t table_size() const { return table_size_; }

 private:
  struct Place {
    uint32_t index = 0;                 // of the region in `leaves`
    uint32_t first_mask = 0, room = 0;  // masks that it may hold
  };
  gpu::Buffer regions_, leaves_, masks_;
  std::unordered_map<world::RegionPos, Place, world::PosHash> places_;
  world::RegionPos min_{0, 0, 0}, max_{-1, -1, -1};
  uint32_t table_size_ = 1;
};

}  // namespace render::raster
