#include "tools/bench/world_copy.h"

namespace tools {

world::World copy_regions(const world::World& from, world::RegionPos min, world::RegionPos max) {
  world::World copy(*from.palette);
  for (const world::RegionPos& r : from.store.regions()) {
    if (r.x < min.x || r.x > max.x || r.y < min.y || r.y > max.y || r.z < min.z || r.z > max.z) continue;
    world::RegionBuilder builder(r);
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const world::LeafBlocks leaf = from.store.leaf(world::leaf_from_region(r) + world::leaf_offset_in_region(i));
      if (leaf.values)
        builder.set_leaf(i, std::span<const world::BlockId, world::kLeafVoxels>(leaf.values, world::kLeafVoxels));
      else if (leaf.uniform != world::kAir)
        builder.set_uniform(i, leaf.uniform);
    }
    copy.store.adopt(std::move(builder));
  }
  return copy;
}

world::VoxelBox region_box(const world::Store& store) {
  world::VoxelBox box;
  for (const world::RegionPos& r : store.regions()) {
    const world::VoxelPos corner = world::voxel_from_region(r);
    box.include(world::VoxelBox{corner, corner + world::VoxelPos{127, 127, 127}});
  }
  return box;
}

}  // namespace tools
