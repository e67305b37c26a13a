/// Gathers voxels in any order, then hands them to a store region by region. For importers.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "world/base/jobs.h"
#include "world/formats/archive/budget.h"
#include "world/store/occupied_mask.h"
#include "world/store/store.h"

namespace world {

class VoxelCollector {
 public:
  /// A file of scattered voxels costs 1 KiB each in memory: the bound keeps that below 1 GiB.
  static constexpr size_t kMaxLeaves = size_t{1} << 20;

  /// `budget`, where there is one, gives the memory of leaves and regions.
  explicit VoxelCollector(MemoryBudget* budget = nullptr) : budget_(budget) {}

  using Blocks = std::array<BlockId, kLeafVoxels>;

  /// The last write of a voxel wins. False where there would be more than kMaxLeaves leaves, or no memory for another;
  /// nothing is written then.
  bool set(VoxelPos v, BlockId block) {
    const LeafPos l = leaf_from_voxel(v);
    if (!last_ || last_pos_ != l) {
      Blocks* const blocks = leaf(l);
      if (!blocks) return false;
      last_ = blocks;
      last_pos_ = l;
    }
    (*last_)[static_cast<size_t>(index_in_leaf(v))] = block;
    return true;
  }
  /// The blocks of a leaf, by index_in_leaf, to be written to; they stay where they are. Null where set() would be
  /// false.
  Blocks* leaf(LeafPos l) {
    auto found = leaves_.find(l);
    if (found == leaves_.end()) {
      if (leaves_.size() >= kMaxLeaves || !room_for(l)) return nullptr;
      found = leaves_.emplace(l, std::make_unique<Blocks>()).first;
    }
    return found->second.get();
  }
  /// Voxels that are not air now; looks at each.
  uint64_t distinct() const {
    uint64_t n = 0;
    for (const auto& [l, blocks] : leaves_) n += static_cast<uint64_t>(occupied_mask(blocks->data()).count());
    return n;
  }

  /// Moves everything into the store; the regions touched are replaced. Leaves this empty.
  void move_into(Store& store) {
    using Leaves = std::vector<std::pair<int, std::unique_ptr<Blocks>>>;  // by index_in_region
    std::map<RegionPos, Leaves> by_region;
    for (auto& [l, blocks] : leaves_)
      by_region[region_from_leaf(l)].emplace_back(index_in_region(l), std::move(blocks));
    leaves_.clear();
    std::vector<std::pair<RegionPos, Leaves*>> regions;
    for (auto& [r, leaves] : by_region) regions.emplace_back(r, &leaves);
    // Some at a time: what has been built is let go of before the next are.
    constexpr size_t kBatch = 16;
    for (size_t first = 0; first < regions.size(); first += kBatch) {
      const size_t n = std::min(kBatch, regions.size() - first);
      std::vector<std::optional<RegionBuilder>> built(n);
      parallel_for(n, [&](size_t i) {
        const auto& [r, leaves] = regions[first + i];
        built[i].emplace(r);
        for (const auto& [index, blocks] : *leaves) built[i]->set_leaf(index, *blocks);
        leaves->clear();
      });
      for (std::optional<RegionBuilder>& region : built) store.adopt(std::move(*region));
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

  std::unordered_map<LeafPos, std::unique_ptr<Blocks>, PosHash> leaves_;
  std::unordered_set<RegionPos, PosHash> regions_;  // kept only with a budget
  MemoryBudget* budget_ = nullptr;
  Blocks* last_ = nullptr;
  LeafPos last_pos_;
};

}  // namespace world
