#include "world/store/density_field.h"

#include <algorithm>

#include <fmt/format.h>

#include "world/store/tree.h"

namespace world {

Result<std::shared_ptr<const DensityField>> density_field(const FloatLayer& layer, FieldSampling sampling,
                                                          const std::string& name) {
  const auto& tree = layer.grid().grid->constTree();
  std::vector<FieldLeaf> leaves;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    FieldLeaf& copy = leaves.emplace_back();
    copy.leaf = leaf_from_voxel(voxel(leaf->origin()));
    std::copy_n(leaf->buffer().data(), kLeafVoxels, copy.values.begin());
  }
  // Tiles: whole leaves of one value.
  auto value = tree.cbeginValueOn();
  value.setMaxDepth(decltype(value)::LEAF_DEPTH - 1);
  for (; value; ++value) {
    if (*value == 0) continue;
    openvdb::CoordBBox box;
    value.getBoundingBox(box);
    const LeafPos low = leaf_from_voxel(voxel(box.min())), high = leaf_from_voxel(voxel(box.max()));
    const VoxelBox of_leaves{{low.x, low.y, low.z}, {high.x, high.y, high.z}};
    if (of_leaves.volume() > BrickField::kMostBricks || leaves.size() > BrickField::kMostBricks)
      return input_error(fmt::format("{}: the densities fill more than the {} bricks of 8^3 voxels that fit", name,
                                     BrickField::kMostBricks));
    for (int32_t x = low.x; x <= high.x; ++x)
      for (int32_t y = low.y; y <= high.y; ++y)
        for (int32_t z = low.z; z <= high.z; ++z) {
          FieldLeaf& tile = leaves.emplace_back();
          tile.leaf = {x, y, z};
          tile.values.fill(*value);
        }
  }
  TRY(std::shared_ptr<const DensityField> field, BrickField::make(std::move(leaves), sampling, name));
  return field;
}

}  // namespace world
