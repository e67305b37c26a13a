/// Fills boxes of a store whose voxels a file lists one by one: schematics. Boxes may overlap; the later one wins.
#pragma once

#include <algorithm>
#include <array>
#include <map>

#include "world/formats/archive/budget.h"
#include "world/store/store.h"

namespace world {

class BoxFiller {
 public:
  BoxFiller(Store& store, MemoryBudget& budget) : store_(store), budget_(budget) {}

  /// Voxels corner + (x, y, z) for 0 <= x < size.x ..., by at(x, y, z) -> BlockId. False where the budget is used up;
  /// then the world is good for nothing. The box must lie inside the world's border.
  template <class At>
  bool fill(VoxelPos corner, VoxelPos size, At at) {
    if (std::min({size.x, size.y, size.z}) <= 0) return true;
    const VoxelPos last = corner + size - VoxelPos{1, 1, 1};
    const LeafPos first_leaf = leaf_from_voxel(corner), last_leaf = leaf_from_voxel(last);
    std::array<BlockId, kLeafVoxels> values;
    for (int lx = first_leaf.x; lx <= last_leaf.x; ++lx)
      for (int ly = first_leaf.y; ly <= last_leaf.y; ++ly)
        for (int lz = first_leaf.z; lz <= last_leaf.z; ++lz) {
          const LeafPos leaf{lx, ly, lz};
          RegionBuilder* const region = region_at(region_from_leaf(leaf));
          if (!region) return false;
          const VoxelPos base = voxel_from_leaf(leaf) - corner;
          const VoxelPos from{std::max(0, -base.x), std::max(0, -base.y), std::max(0, -base.z)};
          const VoxelPos to{std::min(8, size.x - base.x), std::min(8, size.y - base.y), std::min(8, size.z - base.z)};
          const int index = index_in_region(leaf);
          const LeafBlocks before = region->leaf(index);
          const bool was_mixed = before.values != nullptr;
          const bool whole = from == VoxelPos{0, 0, 0} && to == VoxelPos{8, 8, 8};
          if (!whole)
            for (int i = 0; i < kLeafVoxels; ++i) values[static_cast<size_t>(i)] = before[i];
          for (int x = from.x; x < to.x; ++x)
            for (int y = from.y; y < to.y; ++y)
              for (int z = from.z; z < to.z; ++z)
                values[static_cast<size_t>(x << 6 | y << 3 | z)] = at(base.x + x, base.y + y, base.z + z);
          region->set_leaf(index, values);
          if (!was_mixed && region->leaf(index).values && !budget_.take(kLeafVoxels * sizeof(BlockId))) return false;
        }
    return true;
  }
  /// Hands everything to the store.
  void finish() {
    for (auto& [pos, region] : regions_) store_.adopt(std::move(region));
    regions_.clear();
    last_ = nullptr;
  }

 private:
  static constexpr uint64_t kRegionBytes = 40 << 10;
  RegionBuilder* region_at(RegionPos pos) {
    if (last_ && last_->pos() == pos) return last_;
    auto found = regions_.find(pos);
    if (found == regions_.end()) {
      if (!budget_.take(kRegionBytes)) return nullptr;
      found = regions_.emplace(pos, RegionBuilder(pos)).first;
    }
    return last_ = &found->second;
  }

  Store& store_;
  MemoryBudget& budget_;
  std::map<RegionPos, RegionBuilder> regions_;
  RegionBuilder* last_ = nullptr;
};

}  // namespace world
