#include "render/light/shadow_voxels.h"

#include <algorithm>
#include <utility>

#include "render/extract/liquid_parts.h"
#include "world/store/leaf_sets.h"

namespace render {

using world::LeafMask;
using world::LeafPos;
using world::without;

namespace {

/// Of a leaf, the voxels that a liquid doesn't fill.
LeafMask low_liquids(const LiquidLevels& levels, LeafPos l) {
  LeafMask mask;
  if (const LiquidLevels::Leaf* const of_leaf = levels.leaf(l))
    for (int i = 0; i < world::kLeafVoxels; ++i)
      if ((*of_leaf)[static_cast<size_t>(i)] < kFullLevel) mask.set(i);
  return mask;
}

}  // namespace

ShadowVoxels::Change ShadowVoxels::follow(const world::WorldView& view, const LiquidLevels& levels,
                                          std::span<const LeafPos> moved, world::StoreRays& rays) {
  Change change;
  const world::MaskVolume& opaque = view.masks(kOpaque);
  store_ = &view.store(), whole_ = &opaque, rays_ = &rays;
  if (identity_ != store_->identity()) {
    identity_ = store_->identity(), subscriber_ = store_->subscribe();
    cut_.reset();
    change.all = true;
  }
  std::vector<LeafPos> leaves = store_->take_dirty(subscriber_);
  if (cut_ && !levels.any()) cut_.reset(), change.all = true;
  if (!cut_) {
    const auto holds_low = [&](LeafPos l) {
      const LeafMask& mask = opaque.leaf(l);
      return !mask.is_none() && !(without(mask, low_liquids(levels, l)) == mask);
    };
    bool any = false;
    if (change.all) {
      for (const auto& [l, of_leaf] : levels.leaves()) any = any || holds_low(l);
    } else {
      any = std::any_of(leaves.begin(), leaves.end(), holds_low) || std::any_of(moved.begin(), moved.end(), holds_low);
    }
    if (any) cut(view, levels), change.all = true;
    if (!change.all) change.leaves = std::move(leaves);
    return change;
  }
  leaves.insert(leaves.end(), moved.begin(), moved.end());
  std::sort(leaves.begin(), leaves.end());
  leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
  for (const LeafPos l : leaves) {
    const LeafMask mask = without(opaque.leaf(l), low_liquids(levels, l));
    if (mask == cut_->volume.leaf(l)) continue;
    cut_->volume.set_leaf(l, mask);
    change.leaves.push_back(l);
  }
  if (!change.leaves.empty()) {
    cut_->stream.update(change.leaves);
    if (cut_->parallel) cut_->parallel->update(change.leaves);
  }
  return change;
}

void ShadowVoxels::cut(const world::WorldView& view, const LiquidLevels& levels) {
  world::MaskVolume voxels;
  copy_regions(view.masks(kOpaque), voxels);
  for (const auto& [l, of_leaf] : levels.leaves()) {
    const LeafMask mask = voxels.leaf(l), left = without(mask, low_liquids(levels, l));
    if (!(left == mask)) voxels.set_leaf(l, left);
  }
  cut_ = std::make_unique<Cut>(std::move(voxels));
}

const world::ParallelRays& ShadowVoxels::parallel(const world::Vec3d& direction) {
  if (!cut_) return rays_->parallel(*store_, kOpaque, direction);
  if (!cut_->parallel || cut_->parallel->direction() != direction)
    cut_->parallel = std::make_unique<world::ParallelRays>(cut_->stream, direction);
  return *cut_->parallel;
}

size_t ShadowVoxels::bytes() const {
  if (!cut_) return 0;
  return cut_->volume.bytes() + cut_->stream.bricks().bytes() + (cut_->parallel ? cut_->parallel->bytes() : 0);
}

}  // namespace render
