/// Gathers voxels in any order, then hands them to a store region by region. For importers.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "world/formats/archive/budget.h"
#include "world/store/store.h"

namespace world {

class VoxelCollector {
 public:
  /// A file of scattered voxels costs 1 KiB each in memory: the bound keeps that below 1 GiB.
  static constexpr size_t kMaxLeaves = size_t{1} << 20;

  /// `budget`, where there is one, gives the memory of leaves and regions.
  explicit VoxelCollector(MemoryBudget* budget = nullptr) : budget_(budget) {}

  /// The last write of a voxel wins. False where there would be more than kMaxLeaves leaves, or no memory for another;
  /// nothing is written then.
  bool set(VoxelPos v, BlockId block) {
    const LeafPos l = leaf_from_voxel(v);
    if (!last_ || last_pos_ != l) {
      auto found = leaves_.find(l);
      if (found == leaves_.end()) {
        if (leaves_.size() >= kMaxLeaves || !room_for(l)) return false;
        found = leaves_.emplace(l, std::make_unique<Blocks>()).first;
      }
      last_ = found->second.get();
      last_pos_ = l;
    }
    BlockId& at = (*last_)[static_cast<size_t>(index_in_leaf(v))];
    distinct_ += (at == kAir) - (block == kAir);
    at = block;
    return true;
  }
  /// Voxels that are not air now.
  uint64_t distinct() const { return distinct_; }

  /// Moves everything into the store; the regions touched are replaced. Leaves this empty.
  void move_into(Store& store) {
    std::map<RegionPos, std::vector<LeafPos>> regions;
    for (const auto& [l, blocks] : leaves_) regions[region_from_leaf(l)].push_back(l);
    for (const auto& [r, leaves] : regions) {
      RegionBuilder region(r);
      for (const LeafPos l : leaves) {
        region.set_leaf(index_in_region(l), *leaves_[l]);
        leaves_.erase(l);
      }
      store.adopt(std::move(region));
    }
    *this = VoxelCollector(budget_);
  }

 private:
  static constexpr uint64_t kLeafBytes = 1200, kRegionBytes = 40 << 10;
  bool room_for(LeafPos l) {
    if (!budget_) return true;
    const bool new_region = regions_.insert(region_from_leaf(l)).second;
    return budget_->take(kLeafBytes + (new_region ? kRegionBytes : 0));
  }

  using Blocks = std::array<BlockId, kLeafVoxels>;
  std::unordered_map<LeafPos, std::unique_ptr<Blocks>, PosHash> leaves_;
  std::unordered_set<RegionPos, PosHash> regions_;  // kept only with a budget
  MemoryBudget* budget_ = nullptr;
  Blocks* last_ = nullptr;
  LeafPos last_pos_;
  uint64_t distinct_ = 0;
};

}  // namespace world
