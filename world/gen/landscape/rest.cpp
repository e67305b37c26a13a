#include "world/gen/landscape/rest.h"

#include <algorithm>

namespace world::landscape {

namespace {

/// What stands at a voxel, of the region or up to two voxels beside it.
struct Surroundings {
  const Columns& columns;
  const Terrain& terrain;
  std::span<const Homestead> homesteads;
  const Materials& m;
  const Canvas& canvas;

  bool is_closed(VoxelPos p) const {
    if (canvas.contains(p)) {
      const BlockId block = canvas.get(p);
      return block != kAir && block != m.water && block != m.lava;
    }
    const auto digs = [&](const Homestead& home) { return home.clears(p); };
    return !std::any_of(homesteads.begin(), homesteads.end(), digs) &&
           terrain.is_ground(columns, p.x - columns.x0, p.y, p.z - columns.z0);
  }
  /// Whether a grain stays there, wherever grains roll down a slope of one in two.
  bool holds(VoxelPos p) const {
    const VoxelPos down{0, -1, 0};
    if (!is_closed(p + down)) return false;
    for (const VoxelPos side : {VoxelPos{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}}) {
      if (is_closed(p + side)) continue;
      if (!is_closed(p + side + down)) return false;
      if (!is_closed(p + side + side) && !is_closed(p + side + side + down)) return false;
    }
    return true;
  }
};

}  // namespace

BlockId held(BlockId block, const Materials& m, BlockId rock) {
  if (block == m.sand) return m.rocks[4];
  if (block == m.mud) return m.clay;
  return block == m.gravel || block == m.scree ? rock : block;
}

void hold_grains(const Columns& columns, const Terrain& terrain, std::span<const Homestead> homesteads,
                 const Materials& m, Canvas& canvas) {
  const Surroundings around{columns, terrain, homesteads, m, canvas};
  for (int leaf = 0; leaf < kLeavesPerRegion; ++leaf) {
    Canvas::Leaf* blocks = canvas.opened(leaf);
    if (!blocks) continue;
    const auto is_grain = [&](BlockId b) { return (b == m.sand) | (b == m.mud) | (b == m.gravel) | (b == m.scree); };
    unsigned any = 0;  // of the whole leaf: most have none
    for (const BlockId b : *blocks) any |= is_grain(b);
    if (!any) continue;
    const VoxelPos low = canvas.origin + voxel_from_leaf(leaf_offset_in_region(leaf));
    for (int v = 0; v < kLeafVoxels; ++v) {
      BlockId& block = (*blocks)[static_cast<size_t>(v)];
      if (!is_grain(block)) continue;
      const VoxelPos p = low + offset_in_leaf(v);
      if (around.holds(p)) continue;
      const int x = p.x - columns.x0, z = p.z - columns.z0;
      block = held(block, m, terrain.rock(p.y, columns.strata[static_cast<size_t>(x * kRegionSize + z)]));
    }
  }
}

}  // namespace world::landscape
