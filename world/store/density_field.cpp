#include "world/store/density_field.h"

#include <algorithm>
#include <cmath>
#include <map>

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

Status fill_density_grids(const FloatLayer* layer, std::vector<Medium>& media) {
  std::map<FieldSampling, std::shared_ptr<const DensityField>> fields;
  for (Medium& medium : media) {
    if (medium.kind != "density_grid" || medium.field) continue;
    std::shared_ptr<const DensityField>& field = fields[medium.sampling];
    if (!field) {
      if (!layer) return input_error(medium.where + ": the world has no density layer: its file holds no fog volume");
      TRY(field, density_field(*layer, medium.sampling, medium.where));
    }
    medium.field = field;
  }
  return {};
}

bool is_copy_of(const DensityField& field, const FloatLayer& layer) {
  std::array<float, kLeafVoxels> values;
  const auto read = [&](LeafPos l) {
    LeafMask active;
    layer.read_leaf(l, values, active);
  };
  bool same = true;
  size_t leaves = 0;
  field.for_each_leaf([&](const FieldLeaf& leaf) {
    ++leaves;
    if (!same) return;
    read(leaf.leaf);
    same = values == leaf.values;
  });
  if (!same) return false;
  for (const LeafPos& l : layer.leaves()) {
    read(l);
    leaves -= std::any_of(values.begin(), values.end(), [](float v) { return v > 0; });
  }
  return leaves == 0;
}

}  // namespace world
