/// What the tests of heat, reactions and fire share: one rule on a world's cells, and conduction once more, voxel by
/// voxel over a dense box.
#pragma once

#include <cmath>

#include "sim/matter/heat_kernel.h"
#include "sim/matter/heat_plan.h"
#include "tests/sim/matter/matter_support.h"
#include "world/base/random.h"

namespace sim {

/// One rule alone, on the cells of a world.
class RuleAlone {
 public:
  RuleAlone(world::World& world, std::string_view name, MatterOptions options = {})
      : options_(std::move(options)), cells_(world.store, options_.seed, 1, floor_of(world)) {
    for (const RuleRow& row : rule_rows())
      if (row.info.name == name) rule_ = row.make(0);
    CHECK(rule_ != nullptr);
    cells_.set_feels_heat({1});
    cells_.wake_all(blocks_out_of_rest(*world.palette));
    rule_->start(cells_, options_);
  }
  RuleReport step() {
    cells_.follow_edits();
    return rule_->step(cells_, {tick_++, options_.seed, &options_});
  }
  Cells& cells() { return cells_; }
  uint64_t tick() const { return tick_; }
  bool settled() const { return cells_.settled(); }

  int32_t heat(world::VoxelPos v) {
    const PageId p = cells_.find(world::leaf_from_voxel(v));
    const int32_t* heats = p == kClosedPage ? nullptr : cells_.find_heats(p);
    return heats ? heats[world::index_in_leaf(v)] : 0;
  }
  void set_heat(world::VoxelPos v, int32_t heat) {
    const PageId p = cells_.open(world::leaf_from_voxel(v));
    CHECK(p != kClosedPage);
    cells_.heats(p)[static_cast<size_t>(world::index_in_leaf(v))] = heat;
    cells_.stir_heat(p);
    cells_.spread();
  }
  /// Wakes all leaves of a box, whatever is in them.
  void wake(world::LeafPos low, world::LeafPos high) {
    for (int x = low.x; x <= high.x; ++x)
      for (int y = low.y; y <= high.y; ++y)
        for (int z = low.z; z <= high.z; ++z) cells_.awake(0).add(cells_.open({x, y, z}));
  }
  /// Of all pages.
  int64_t total() const {
    int64_t sum = 0;
    for (PageId p = 1; p < cells_.page_limit(); ++p)
      if (const int32_t* heats = cells_.find_heats(p))
        for (int i = 0; i < world::kLeafVoxels; ++i) sum += heats[i];
    return sum;
  }

 private:
  static int32_t floor_of(const world::World& world) {
    int32_t lowest = 0;
    for (const world::RegionPos& r : world.store.regions()) lowest = std::min(lowest, r.y * world::kRegionSize);
    return lowest;
  }
  MatterOptions options_;
  Cells cells_;
  std::unique_ptr<Rule> rule_;
  uint64_t tick_ = 0;
};

/// A dense box; what is outside exchanges nothing. Conduction as heat_kernel.h states it.
class DenseHeat {
 public:
  DenseHeat(const world::World& world, const world::VoxelBox& box)
      : box_(box), size_(box.max - box.min + world::VoxelPos{1, 1, 1}), thermal_(*world.palette, {}) {
    world::StoreReader reader(world.store);
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z) voxels_.push_back(thermal_.voxel(reader.get({x, y, z})));
    heats_.assign(voxels_.size(), 0);
  }
  int32_t& heat(world::VoxelPos v) { return heats_[index(v)]; }

  void step(double dt, uint64_t number) {
    const auto scale = static_cast<float>(dt / kHeatUnitJ);
    const float phase = heat_phase(number);
    std::vector<int32_t> next = heats_;
    for (int x = box_.min.x; x <= box_.max.x; ++x)
      for (int y = box_.min.y; y <= box_.max.y; ++y)
        for (int z = box_.min.z; z <= box_.max.z; ++z)
          for (int axis = 0; axis < 3; ++axis) {
            const world::VoxelPos v{x, y, z}, w = v + world::face_step(axis * 2 + 1);
            if (!box_.contains(w)) continue;
            const int32_t flow = flux(index(v), index(w), scale, phase);
            next[index(v)] += flow;
            next[index(w)] -= flow;
          }
    heats_ = std::move(next);
  }

 private:
  size_t index(world::VoxelPos v) const {
    const world::VoxelPos d = v - box_.min;
    return (static_cast<size_t>(d.x) * static_cast<size_t>(size_.y) + static_cast<size_t>(d.y)) *
               static_cast<size_t>(size_.z) +
           static_cast<size_t>(d.z);
  }
  int32_t flux(size_t i, size_t j, float scale, float phase) const {
    const ThermalVoxel &a = voxels_[i], &b = voxels_[j];
    const float difference = temperature(b, heats_[j]) - temperature(a, heats_[i]), size = std::abs(difference);
    const float wanted = size * (1.0f / (a.resistance + b.resistance) * scale);
    const float allowed = size * std::min(a.share, b.share);
    return static_cast<int32_t>(std::copysign(std::min(wanted + phase, allowed), difference));
  }
  world::VoxelBox box_;
  world::VoxelPos size_;
  ThermalTraits thermal_;
  std::vector<ThermalVoxel> voxels_;
  std::vector<int32_t> heats_;
};

}  // namespace sim
