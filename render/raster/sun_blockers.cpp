#include "render/raster/sun_blockers.h"

#include <cstring>

#include "render/raster/raster.shared.h"
#include "render/see_through.h"

namespace render::raster {

using world::BlockId;

void SunBlockers::clear() {
  if (any()) *this = {};
}

world::Result<uint64_t> SunBlockers::follow(gpu::Device& device, const world::WorldView& view,
                                            const ShapeExtractor& shapes, std::span<const world::LeafPos> dirty,
                                            const RenderKnobs& knobs) {
  if (!tints_sun(knobs) || view.environment().sun_irradiance == world::Irradiance3{}) {
    clear();
    return uint64_t{0};
  }
  const bool fresh = !any() || store_ != view.store().identity() || shapes_version_ != shapes.rebuilds() ||
                     palette_ != view.palette().size();
  if (!fresh && dirty.empty()) return uint64_t{0};
  if (!holds_not_opaque(view)) {
    clear();
    return uint64_t{0};
  }
  const SeeThroughKinds kinds(view.palette());
  store_ = 0;  // until all is there
  const world::BlockShapes* const drawn = shapes.any() ? &shapes.shapes() : nullptr;
  const std::vector<uint8_t> cubes = hiding_cubes(view.palette(), kinds, drawn);
  const auto code_leaf = [&](world::StoreReader& reader, world::LeafPos leaf, const world::LeafBlocks& blocks,
                             BlockGrid::LeafCodes& codes) {
    const world::VoxelPos corner = world::voxel_from_leaf(leaf);
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      const BlockId id = blocks[i];
      uint16_t& code = codes[static_cast<size_t>(i)];
      code = cubes[id] ? uint16_t{kBlockerCube} : kinds.kind(id);
      if (!drawn || !drawn->shape[id]) continue;
      const uint32_t first = shapes.first_quad_at(reader, corner + world::offset_in_leaf(i), id);
      code = first < kShapeCode ? static_cast<uint16_t>(kShapeCode + first) : 0;
    }
  };
  TRY(uint64_t bytes, grid_.follow(device, view, dirty, fresh, code_leaf));

  // The bounds may grow with an edit.
  const world::RegionPos low = grid_.min_region(), high = grid_.max_region();
  const ivec4 bounds[2] = {{low.x, low.y, low.z, static_cast<int>(grid_.table_size()) - 1},
                           {high.x, high.y, high.z, 0}};
  const size_t kinds_bytes = kinds.blocks().size() * sizeof kinds.blocks()[0];
  if (kinds_buffer_.size < sizeof bounds + kinds_bytes || !kinds_buffer_.handle) {
    TRY(kinds_buffer_, gpu::make_buffer(device, sizeof bounds + kinds_bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                                        gpu::MemoryUse::upload));
  }
  std::memcpy(kinds_buffer_.mapped(), bounds, sizeof bounds);
  std::memcpy(kinds_buffer_.mapped() + sizeof bounds, kinds.blocks().data(), kinds_bytes);
  store_ = view.store().identity(), shapes_version_ = shapes.rebuilds(), palette_ = view.palette().size();
  return bytes + sizeof bounds + kinds_bytes;
}

void SunBlockers::bind(Bindings& bindings) const {
  const auto bind = [&](uint32_t binding, const gpu::Buffer& buffer) {
    buffer.handle ? bindings.bind(binding, buffer) : bindings.forget(binding);
  };
  bind(kBindBlockerRegions, grid_.regions());
  bind(kBindBlockerLeaves, grid_.leaves());
  bind(kBindBlockerCodes, grid_.ids());
  bind(kBindBlockerKinds, kinds_buffer_);
}

}  // namespace render::raster
