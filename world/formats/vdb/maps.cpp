// How grids lie in their world, and resampling of those that lie askew.
#include "world/formats/vdb/grids.h"

#include <cmath>
#include <memory>
#include <set>

#include <fmt/format.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/SignedFloodFill.h>

namespace world::vdb {
namespace {

using openvdb::Mat4d;

constexpr uint64_t kMostResampledLeaves = uint64_t{1} << 16;
constexpr const char* kTooMany = "resampled along the axes it would fill too many voxels";

/// Row vectors: index * matrix = world.
Result<Mat4d> world_from_index(const openvdb::GridBase& grid) {
  if (!grid.transform().isLinear())
    return input_error("its map to the world is a frustum, which is not read; resample it as a linear grid first");
  return grid.transform().baseMap()->getAffineMap()->getMat4();
}

/// The box around a box of index space, seen through a matrix.
openvdb::CoordBBox mapped(const openvdb::CoordBBox& box, const Mat4d& matrix) {
  openvdb::BBoxd out;
  for (int i = 0; i < 8; ++i) {
    const openvdb::Vec3d corner(i & 1 ? box.max().x() + 1 : box.min().x() - 1,
                                i & 2 ? box.max().y() + 1 : box.min().y() - 1,
                                i & 4 ? box.max().z() + 1 : box.min().z() - 1);
    out.expand(matrix.transform(corner));
  }
  return {openvdb::Coord::floor(out.min()), openvdb::Coord::ceil(out.max())};
}

/// Samples only the leaves that the active voxels reach; a voxel is active where the nearest of the grid is.
/// (OpenVDB's own GridTransformer does not compile as C++20.)
Result<openvdb::FloatGrid::Ptr> resample(const openvdb::FloatGrid& grid, const openvdb::math::Transform::Ptr& target) {
  TRY(const Mat4d from, world_from_index(grid));
  const Mat4d target_from_grid = from * target->baseMap()->getAffineMap()->getMat4().inverse(),
              grid_from_target = target_from_grid.inverse();
  std::set<openvdb::Coord> leaves;
  const auto reach = [&](const openvdb::CoordBBox& box) -> Status {
    openvdb::CoordBBox to = mapped(box, target_from_grid);
    if (!inside_world(to.min()) || !inside_world(to.max())) return input_error("it reaches past the world's border");
    to = {to.min() >> kLeafLog2, to.max() >> kLeafLog2};
    if (to.volume() > kMostResampledLeaves) return input_error(kTooMany);
    for (auto l = to.begin(); l; ++l) leaves.insert(*l);
    return leaves.size() > kMostResampledLeaves ? Status(input_error(kTooMany)) : Status();
  };
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    if (!leaf->isEmpty()) TRY_STATUS(reach(leaf->getNodeBoundingBox()));
  }
  auto tile = grid.tree().cbeginValueOn();
  tile.setMaxDepth(tile.LEAF_DEPTH - 1);
  for (; tile; ++tile) TRY_STATUS(reach(tile.getBoundingBox()));

  auto out = openvdb::FloatGrid::create(grid.background());
  out->setName(grid.getName());
  out->setGridClass(grid.getGridClass());
  out->setTransform(target);
  openvdb::FloatGrid::ConstUnsafeAccessor values(grid.tree());
  for (const openvdb::Coord& l : leaves) {
    const openvdb::Coord origin = l << kLeafLog2;
    auto leaf = std::make_unique<openvdb::FloatTree::LeafNodeType>(origin, grid.background(), false);
    for (openvdb::Index n = 0; n < kLeafVoxels; ++n) {
      const openvdb::Vec3d at = grid_from_target.transform(leaf->offsetToGlobalCoord(n).asVec3d());
      if (!values.isValueOn(openvdb::Coord::round(at))) continue;
      leaf->setValueOn(n, openvdb::tools::BoxSampler::sample(values, at));
    }
    if (!leaf->isEmpty()) out->tree().addLeaf(leaf.release());
  }
  if (grid.getGridClass() == openvdb::GRID_LEVEL_SET) openvdb::tools::signedFloodFill(out->tree(), /*threaded=*/false);
  return out;
}

}  // namespace

bool maps_to_cubes(const openvdb::GridBase& grid) {
  const Result<Mat4d> matrix = world_from_index(grid);
  if (!matrix) return false;
  const double size = (*matrix)(0, 0);
  if (!(size > 0)) return false;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      if (std::abs((*matrix)(row, column) - (row == column ? size : 0)) > 1e-6 * size) return false;
  return true;
}

std::optional<openvdb::Coord> whole_voxels_between(const openvdb::GridBase& grid, const openvdb::GridBase& other) {
  const Result<Mat4d> from = world_from_index(grid), to = world_from_index(other);
  if (!from || !to) return std::nullopt;
  const Mat4d matrix = *from * to->inverse();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      if (!(std::abs(matrix(row, column) - (row == column)) < 1e-6)) return std::nullopt;
  openvdb::Coord shift;
  for (int axis = 0; axis < 3; ++axis) {
    const double moved = matrix(3, axis);
    if (!(std::abs(moved) < kWorldBorder) || std::abs(moved - std::round(moved)) > 1e-3) return std::nullopt;
    shift[axis] = static_cast<int32_t>(std::round(moved));
  }
  return shift;
}

Result<openvdb::FloatGrid::Ptr> resampled_to_cubes(const openvdb::FloatGrid& grid) {
  const openvdb::Vec3d size = grid.voxelSize();
  const double least = std::min({size.x(), size.y(), size.z()});
  if (!(least > 0)) return input_error("its map to the world makes voxels flat");
  return resample(grid, openvdb::math::Transform::createLinearTransform(least));
}

Result<openvdb::FloatGrid::Ptr> resampled_like(const openvdb::FloatGrid& grid, const openvdb::GridBase& other) {
  return resample(grid, other.transform().copy());
}

}  // namespace world::vdb
