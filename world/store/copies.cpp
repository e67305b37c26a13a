#include "world/store/copies.h"

#include <algorithm>

#include "world/store/layer.h"
#include "world/store/tree.h"

namespace world {

namespace {

template <class Tree>
void copy_moved(const Tree& from, VoxelPos offset, Tree& to) {
  using Leaf = typename Tree::LeafNodeType;
  const openvdb::Coord by = coord(offset);
  for (auto leaf = from.cbeginLeaf(); leaf; ++leaf) {
    auto* copy = new Leaf(*leaf);
    copy->setOrigin(leaf->origin() + by);
    to.addLeaf(copy);
  }
  auto tile = from.cbeginValueOn();
  tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    openvdb::CoordBBox box = tile.getBoundingBox();
    box.translate(by);
    to.sparseFill(box, *tile, true);
  }
}

/// leaf_of(leaf, buffer) gives what becomes of a leaf; it may use the buffer for it.
template <class LeafOf>
Store copied(const Store& from, VoxelPos offset, const BlockPalette& palette, LeafOf leaf_of) {
  Store to(palette);
  StoreReader reader(from);
  const RegionPos step = region_from_voxel(offset);
  BlockId buffer[kLeafVoxels];
  for (const RegionPos& r : from.regions()) {
    RegionBuilder builder(r + step);
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LeafBlocks leaf = leaf_of(reader.leaf(leaf_from_region(r) + leaf_offset_in_region(i)), buffer);
      if (leaf.values)
        builder.set_leaf(i, std::span<const BlockId, kLeafVoxels>(leaf.values, kLeafVoxels));
      else if (leaf.uniform != kAir)
        builder.set_uniform(i, leaf.uniform);
    }
    to.adopt(std::move(builder));
  }
  for (size_t i = 0; i < layer_rows().size(); ++i) {
    const auto layer = static_cast<Layer>(i);
    if (layer == Layer::block) continue;
    const AnyLayer* any = from.find_any_layer(layer);
    if (!any) continue;
    std::visit(
        [&](const auto& values) {
          auto& copy = std::get<std::decay_t<decltype(values)>>(to.make_any_layer(layer));
          copy_moved(values.grid().grid->constTree(), offset, copy.grid().grid->tree());
        },
        *any);
  }
  return to;
}

}  // namespace

Store moved(const Store& from, VoxelPos offset, const BlockPalette& palette) {
  return copied(from, offset, palette, [](LeafBlocks leaf, BlockId*) { return leaf; });
}

Store without_block(const Store& from, BlockId block, const BlockPalette& palette) {
  return copied(from, VoxelPos{0, 0, 0}, palette, [block](LeafBlocks leaf, BlockId* buffer) {
    if (!leaf.values) return leaf.uniform == block ? LeafBlocks{} : leaf;
    std::replace_copy(leaf.values, leaf.values + kLeafVoxels, buffer, block, kAir);
    return LeafBlocks{buffer, kAir};
  });
}

}  // namespace world
