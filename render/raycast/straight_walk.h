/// The layers of see-through blocks along a ray that goes straight on, and the pixel that they make: the twin of the
/// rasterizer's lists (render/raster/lists.h), by the formulas of render/see_through.shared.h.
///
/// A ray walks empty space by the masks, and within a see-through block voxel by voxel, or leaf by leaf where a leaf is
/// all of one block, as long as the block stays the same. Where a liquid ends within its voxel, above it is air.
/// error  none beyond double rounding of the ray, and float in the formulas
#pragma once

#include <vector>

#include "render/image/image.h"
#include "render/image/blend.h"
#include "render/knobs.h"
#include "render/liquid_levels.h"
#include "render/see_through.h"
#include "world/base/function_ref.h"
#include "world/scenes/clouds.shared.h"
#include "world/store/mask_walk.h"
#include "world/store/store.h"

namespace render {

/// Blocks of the leaf last asked for.
class LeafCache {
 public:
  /// levels: null: all liquids are full.
  explicit LeafCache(world::StoreReader& reader, const LiquidLevels* levels = nullptr)
      : reader_(&reader), levels_(levels) {}
  const world::LeafBlocks& leaf(world::VoxelPos v) {
    const world::LeafPos leaf = leaf_from_voxel(v);
    if (leaf != pos_) {
      pos_ = leaf, blocks_ = reader_->leaf(leaf);
      if (levels_) leaf_levels_ = levels_->leaf(leaf);
    }
    return blocks_;
  }
  world::BlockId get(world::VoxelPos v) { return leaf(v)[index_in_leaf(v)]; }
  /// Whether all of the leaf is the same, levels too.
  bool uniform(world::VoxelPos v) { return !leaf(v).values && !leaf_levels_; }
  int level(world::VoxelPos v) {
    if (!levels_) return kFullLevel;
    leaf(v);
    return leaf_levels_ ? (*leaf_levels_)[static_cast<size_t>(index_in_leaf(v))] : kFullLevel;
  }

 private:
  world::StoreReader* reader_;
  const LiquidLevels* levels_;
  const LiquidLevels::Leaf* leaf_levels_ = nullptr;
  world::LeafPos pos_{INT32_MAX, 0, 0};
  world::LeafBlocks blocks_{};
};

/// An interface that a ray passes.
struct StraightLayer {
  world::GridHit at;           // the voxel entered, through which face, at which t of the ray
  uint16_t near = 0, far = 0;  // kinds before and beyond it
  bool outside = true;         // the owner is what lies beyond
  uint16_t owner() const { return outside ? far : near; }
};

/// What a ray does with a block's shape (world/proxies): the block has none, which ends the ray where it isn't seen
/// through; the ray passes it by, in air; or it meets it, and the hit says where.
enum class ShapeMeeting { none, missed, met };
using MeetShape = world::FunctionRef<ShapeMeeting(const world::WalkPlace&, world::BlockId, world::GridHit&)>;

/// Walks from `place`, which the ray reaches in `medium`, to the first voxel that no ray sees through. Adds the
/// interfaces to `layers`; `medium` is then what the ray ends in. What it hits, or the sky.
world::GridHit walk_straight(const world::GridRay& ray, const world::MaskWalker& occupied, const SeeThroughKinds& kinds,
                             LeafCache& blocks, world::WalkPlace place, double t_limit, world::BlockId& medium,
                             std::vector<StraightLayer>& layers, MeetShape meet_shape);

struct StraightPixel {
  uint32_t x = 0, y = 0;
  float metres_per_t = 1;  // length of the ray's direction
  uint16_t eye = 0;        // kind of the block that the eye is in
  uint16_t end = 0;        // and of that in which the ray ends
  float t_end = 0;         // m; may be infinite
  Rgb behind;              // radiance of what it ends on, behind the clouds of all the way
};
/// surface(layer): radiance of a matte surface of the layer's owner. mirrored(layer): from the direction mirrored
/// at its plane. clouds(t): on t metres of the ray. Front to back; `sorted` blends back to front in the two passes of
/// section 14.10.3, which gives the same but for rounding.
Rgb straight_radiance(const StraightPixel& pixel, const world::Vec3d& direction, const SeeThroughKinds& kinds,
                      std::span<const StraightLayer> layers, CoveragePattern pattern, bool sorted,
                      world::FunctionRef<Rgb(const StraightLayer&)> surface,
                      world::FunctionRef<Rgb(const StraightLayer&)> mirrored,
                      world::FunctionRef<world::shared::CloudView(float)> clouds);

}  // namespace render
