/// What isn't opaque and stands in the sun's way, on the device (knob tinted_shadows): see-through blocks, which let
/// through what they do of each band, and shapes of blocks, which hide it. A grid of codes as block_grid.h lays it out.
/// There where the knob asks for it and the world has any such block.
/// cost    as BlockGrid, for leaves that hold any of them; rays of lit points walk from group to group of leaves
#pragma once

#include "render/extract/proxies.h"
#include "render/knobs.h"
#include "render/raster/bindings.h"
#include "render/raster/block_grid.h"

namespace render::raster {

class SunBlockers {
 public:
  /// `dirty`: leaves that changed since the last call, of the same world. Returns the bytes sent.
  world::Result<uint64_t> follow(gpu::Device& device, const world::WorldView& view, const ShapeExtractor& shapes,
                                 std::span<const world::LeafPos> dirty, const RenderKnobs& knobs);
  void clear();
  bool any() const { return !grid_.empty(); }
  void bind(Bindings& bindings) const;
  /// Of the device, while any().
  uint64_t bytes() const { return grid_.regions().size + grid_.leaves().size + grid_.ids().size + kinds_buffer_.size; }

 private:
  BlockGrid grid_;
  gpu::Buffer kinds_buffer_;
  uint64_t store_ = 0, shapes_version_ = 0;
  size_t palette_ = 0;
};

}  // namespace render::raster
