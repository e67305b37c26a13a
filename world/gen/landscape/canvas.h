/// One region while it is being made: terrain first, then features that draw over it. Leaves that nothing touches stay
/// one block and cost no memory.
#pragma once

#include <array>
#include <vector>

#include "world/blocks/block.h"
#include "world/space/coords.h"
#include "world/store/store.h"

namespace world::landscape {

class Canvas {
 public:
  using Leaf = std::array<BlockId, kLeafVoxels>;

  /// Empties the canvas; keeps its memory.
  void reset(RegionPos region) {
    origin = voxel_from_region(region);
    slots_.fill(-1);
    uniform_.fill(kAir);
    used_ = 0;
  }
  void set_uniform(int leaf, BlockId block) { uniform_[static_cast<size_t>(leaf)] = block; }
  /// The 512 blocks of a leaf, to be written over; filled with its uniform block at first.
  Leaf& open(int leaf) {
    int32_t& slot = slots_[static_cast<size_t>(leaf)];
    if (slot < 0) {
      slot = add();
      leaves_[static_cast<size_t>(slot)].fill(uniform_[static_cast<size_t>(leaf)]);
    }
    return leaves_[static_cast<size_t>(slot)];
  }
  /// open() without the fill: the caller writes all 512.
  Leaf& open_unfilled(int leaf) {
    int32_t& slot = slots_[static_cast<size_t>(leaf)];
    if (slot < 0) slot = add();
    return leaves_[static_cast<size_t>(slot)];
  }

  /// The blocks of a leaf that was opened, or null.
  Leaf* opened(int leaf) {
    const int32_t slot = slots_[static_cast<size_t>(leaf)];
    return slot < 0 ? nullptr : &leaves_[static_cast<size_t>(slot)];
  }

  // World positions; what lies outside the region is air when read and ignored when written.
  bool contains(VoxelPos v) const {
    return static_cast<uint32_t>(v.x - origin.x) < kRegionSize && static_cast<uint32_t>(v.y - origin.y) < kRegionSize &&
           static_cast<uint32_t>(v.z - origin.z) < kRegionSize;
  }
  BlockId get(VoxelPos v) const {
    if (!contains(v)) return kAir;
    const size_t leaf = static_cast<size_t>(index_in_region(leaf_from_voxel(v)));
    return slots_[leaf] < 0 ? uniform_[leaf]
                            : leaves_[static_cast<size_t>(slots_[leaf])][static_cast<size_t>(index_in_leaf(v))];
  }
  void put(VoxelPos v, BlockId block) {
    if (contains(v)) open(index_in_region(leaf_from_voxel(v)))[static_cast<size_t>(index_in_leaf(v))] = block;
  }

  void write_to(RegionBuilder& region) const {
    for (int leaf = 0; leaf < kLeavesPerRegion; ++leaf) {
      const int32_t slot = slots_[static_cast<size_t>(leaf)];
      if (slot >= 0)
        region.set_leaf(leaf, leaves_[static_cast<size_t>(slot)]);
      else if (uniform_[static_cast<size_t>(leaf)] != kAir)
        region.set_uniform(leaf, uniform_[static_cast<size_t>(leaf)]);
    }
  }

  VoxelPos origin;

 private:
  int32_t add() {
    if (used_ == leaves_.size()) leaves_.emplace_back();
    return static_cast<int32_t>(used_++);
  }
  std::array<int32_t, kLeavesPerRegion> slots_;  // place in leaves_, or -1
  std::array<BlockId, kLeavesPerRegion> uniform_;
  std::vector<Leaf> leaves_;
  size_t used_ = 0;
};

}  // namespace world::landscape
