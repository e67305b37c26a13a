/// One rule of matter on the cells of a world of its own, for benchmarks.
#pragma once

#include <memory>
#include <string_view>

#include "sim/matter/matter.h"
#include "sim/matter/thermal.h"
#include "tools/bench/world_fill.h"
#include "world/base/errors.h"

namespace tools {

struct RuleBench {
  world::World world{world::standard_blocks()};
  sim::MatterOptions options;
  std::unique_ptr<sim::Cells> cells;
  std::unique_ptr<sim::Rule> rule;
  std::vector<sim::PageId> pages;
  uint64_t tick = 0;

  void fill(const world::VoxelBox& box, std::string_view block) { fill_block(world, box, block); }
  /// Opens the leaves of the box.
  void start(std::string_view name, const world::VoxelBox& box) {
    cells = std::make_unique<sim::Cells>(world.store, options.seed, 1, box.min.y);
    for (const sim::RuleRow& row : sim::rule_rows())
      if (row.info.name == name) rule = row.make(0);
    CHECK(rule != nullptr);
    cells->set_feels_heat({1});
    const world::LeafPos low = world::leaf_from_voxel(box.min), high = world::leaf_from_voxel(box.max);
    for (int x = low.x; x <= high.x; ++x)
      for (int y = low.y; y <= high.y; ++y)
        for (int z = low.z; z <= high.z; ++z) pages.push_back(cells->open({x, y, z}));
  }
  void wake() {
    for (const sim::PageId p : pages) cells->awake(0).add(p);
  }
  /// A tick; returns the voxels of the leaves that were visited.
  double step() {
    return static_cast<double>(rule->step(*cells, {tick++, options.seed, &options}).leaves_visited) *
           world::kLeafVoxels;
  }
};

}  // namespace tools
