/// The topology of a mask volume as an OpenVDB tree of masks: full leaves are active tiles. For rivals only; included
/// by their .cpp files after OpenVDB.
#pragma once

namespace tools {

template <class MaskGrid>
void fill_mask_grid(const world::MaskVolume& volume, MaskGrid& grid) {
  using Leaf = typename MaskGrid::TreeType::LeafNodeType;
  for (const world::MaskRegion* region : volume.regions())
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const world::LeafPos l = world::leaf_from_region(region->pos) + world::leaf_offset_in_region(i);
      if (!region->leaf_any(l)) continue;
      const world::VoxelPos v = world::voxel_from_leaf(l);
      const openvdb::Coord origin(v.x, v.y, v.z);
      if (region->leaf_full(l)) {
        grid.tree().addTile(1, origin, true, true);
        continue;
      }
      typename Leaf::NodeMaskType mask;  // the same order of bits as ours
      for (int w = 0; w < 8; ++w) mask.template getWord<uint64_t>(w) = region->leaf(l).word[w];
      grid.tree().touchLeaf(origin)->setValueMask(mask);
    }
}

}  // namespace tools
