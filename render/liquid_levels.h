/// How high liquids stand in their voxels, as pictures show them: in sixteenths of a metre, from the amounts of the
/// layer `liquid` (world/store/layers.def). Shared by both backends.
///
///   level   1..15  the amount, rounded, where no liquid lies above: what is over it in the voxel is air
///           16     all else: full liquids, liquids below liquids, and whatever isn't a liquid
///
/// A step of a sixteenth keeps a still lake one rectangle, and lets an amount change by a little without any face made
/// anew. A world whose liquids are all full has no such layer and costs a look for it.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <unordered_map>
#include <vector>

#include "world/space/grid_walk.h"
#include "world/space/world_point.h"
#include "world/world.h"

namespace render {

constexpr int kFullLevel = 16;

class LiquidLevels {
 public:
  using Leaf = std::array<uint8_t, world::kLeafVoxels>;

  /// Follows the world, or with `on` false forgets all. Returns the leaves in which a level changed, sorted.
  std::vector<world::LeafPos> follow(const world::WorldView& view, bool on = true);

  /// Whether any level is below kFullLevel.
  bool any() const { return !leaves_.empty(); }
  /// Levels by index_in_leaf; null: all are full.
  const Leaf* leaf(world::LeafPos l) const {
    if (leaves_.empty()) return nullptr;
    const auto found = leaves_.find(l);
    return found == leaves_.end() ? nullptr : found->second.get();
  }
  int at(world::VoxelPos v) const {
    const Leaf* const levels = leaf(leaf_from_voxel(v));
    return levels ? (*levels)[static_cast<size_t>(index_in_leaf(v))] : kFullLevel;
  }
  /// Whether a point is in the air above a liquid in its voxel.
  bool above_surface(const world::WorldPoint& p) const {
    return p.fraction.y * kFullLevel >= at(p.voxel) && at(p.voxel) < kFullLevel;
  }
  /// Leaves with any, in no order.
  const std::unordered_map<world::LeafPos, std::unique_ptr<Leaf>, world::PosHash>& leaves() const { return leaves_; }
  /// How many leaves were looked at, so far.
  uint64_t looked_at() const { return looked_at_; }

 private:
  std::vector<world::LeafPos> forget();

  std::unordered_map<world::LeafPos, std::unique_ptr<Leaf>, world::PosHash> leaves_;
  uint64_t store_ = 0, looked_at_ = 0;  // identity of the store that is followed; 0: none
  int subscriber_ = 0;
  world::LayerMark mark_;
};

/// A ray and the surface of a liquid that ends within its voxel, as render/trace and render/raycast walk it: the plane
/// at the liquid's level, crossed in the order of (t, axis) like those of the grid.
class LevelCrossing {
 public:
  LevelCrossing(const world::GridRay& ray, world::VoxelPos voxel, int level) {
    const double height = double(voxel.y) - ray.voxel.y + double(level) / kFullLevel - ray.fraction.y;
    const double up = ray.direction.y;
    level_ = std::abs(up) < world::kTinyDirection;
    rises_ = level_ ? height <= 0 : up > 0;
    t_ = level_ ? world::kInfinity : height / up;
  }
  double t() const { return t_; }
  bool rises() const { return rises_; }
  /// Whether the ray has crossed it where it enters a voxel at t by a step along `axis` (-1: where it starts).
  bool crossed(double t, int axis) const { return t_ < t || (t_ == t && axis != 0); }
  /// Whether it is in the liquid there.
  bool in_liquid(double t, int axis) const { return level_ ? !rises_ : crossed(t, axis) != rises_; }

 private:
  double t_;
  bool level_, rises_;  // level_: never crossed; rises_ then: the ray runs above
};

}  // namespace render
