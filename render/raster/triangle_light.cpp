#include "render/raster/triangle_light.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "render/raster/place_table.h"

namespace render::raster {

world::Result<uint64_t> TriangleLight::follow(gpu::Device& device, const world::WorldView& view,
                                              const WorldLight& light, SurfaceLight::Kind kind,
                                              const DrawnTriangles& triangles) {
  if (kind == SurfaceLight::Kind::none || triangles.empty()) {
    const uint64_t kept_limit = binding_limit;
    *this = {};
    binding_limit = kept_limit;
    return uint64_t{0};
  }
  const VoxelCodes voxels(view, light, kind);
  std::vector<world::RegionPos> regions = voxels.regions();
  if (triangles.version() != triangles_ || regions != regions_) {
    triangles_ = triangles.version(), regions_ = std::move(regions);
    wanted_ = triangles.leaves_around(regions_);
  }
  outside_ = voxels.outside();
  dropped_.clear();
  std::span<const world::LeafPos> leaves = wanted_;
  const uint64_t limit = std::min<uint64_t>(binding_limit, uint64_t{device.limits().maxTexelBufferElements} * 4),
                 bytes = uint64_t{leaves.size()} * world::kLeafVoxels * static_cast<uint64_t>(voxels.per_voxel()) * 4;
  if (bytes > limit) {
    dropped_ = fmt::format(
        "triangles have the open sky's light: the world's around them is {} MiB, a buffer of this device holds {} MiB",
        bytes >> 20, limit >> 20);
    leaves = {};
    outside_ = kLightUnknown;
  }
  if (!light_.follow(view, light, kind, leaves)) return uint64_t{0};
  return send(device);
}

world::Result<uint64_t> TriangleLight::send(gpu::Device& device) {
  const size_t of_leaf = light_.codes_per_leaf();
  auto* const to = reinterpret_cast<uint32_t*>(codes_.mapped());
  if (!light_.patched().empty()) {
    for (const uint32_t leaf : light_.patched())
      std::memcpy(to + leaf * of_leaf, light_.codes().data() + leaf * of_leaf, of_leaf * sizeof(uint32_t));
    return light_.patched().size() * of_leaf * sizeof(uint32_t);
  }
  slots_ = place_slots(light_.leaves().size());
  std::vector<ivec4> table(slots_, ivec4(0));
  uint32_t place = 0;
  for (const world::LeafPos& l : light_.leaves()) add_place(table, l, place++);
  const uint64_t of_table = table.size() * sizeof table[0], of_codes = light_.codes().size() * sizeof(uint32_t);
  TRY_STATUS(gpu::fill_texels(device, leaves_, VK_FORMAT_R32G32B32A32_SINT, table.data(), of_table));
  TRY_STATUS(gpu::fill_texels(device, codes_, VK_FORMAT_R32_UINT, light_.codes().data(), of_codes));
  return of_table + of_codes;
}

}  // namespace render::raster
