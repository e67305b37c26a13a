#include "world/store/volume_mesher.h"

#include <algorithm>
#include <exception>

#include <fmt/format.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>

#include "world/base/jobs.h"
#include "world/store/tree.h"

namespace world {

namespace {

/// All values of the leaves that the crossed cells touch, shifted by `origin`; what lies between has the sign of its
/// side.
openvdb::FloatGrid::Ptr dense_grid(const SolidField& field, const std::vector<LeafPos>& crossed, VoxelPos origin) {
  std::vector<LeafPos> leaves;
  for (const LeafPos& l : crossed)
    for (int i = 0; i < 8; ++i) leaves.push_back(l + LeafPos{i & 1, i >> 1 & 1, i >> 2});
  std::sort(leaves.begin(), leaves.end());
  leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());

  using Leaf = openvdb::FloatTree::LeafNodeType;
  std::vector<std::unique_ptr<Leaf>> filled(leaves.size());
  parallel_ranges(leaves.size(), 16, [&](size_t begin, size_t end) {
    SolidField::Values values;
    for (size_t i = begin; i < end; ++i) {
      field.read(leaves[i], values);
      filled[i] = std::make_unique<Leaf>(coord(voxel_from_leaf(leaves[i]) - origin), field.beyond(), true);
      float* out = filled[i]->buffer().data();
      for (int v = 0; v < kLeafVoxels; ++v) {
        const VoxelPos at = offset_in_leaf(v);
        out[v] = values[static_cast<size_t>((at.x * SolidField::kAlong + at.y) * SolidField::kAlong + at.z)];
      }
    }
  });
  const auto grid = openvdb::FloatGrid::create(field.beyond());
  for (auto& leaf : filled) grid->tree().addLeaf(leaf.release());
  openvdb::tools::signedFloodFill(grid->tree());
  return grid;
}

}  // namespace

Result<VoxelMesh> openvdb_mesh(const SolidField& field, double adaptivity) {
  VoxelMesh mesh;
  std::vector<SolidField::Values> unused;
  const std::vector<LeafPos> crossed = crossed_leaves(field, unused);
  if (crossed.empty()) return mesh;
  VoxelBox bounds;
  for (const LeafPos& l : crossed) bounds.include(voxel_from_leaf(l));
  const auto middle = [&](int axis) { return (int64_t{bounds.min[axis]} + bounds.max[axis]) / 2; };
  VoxelPos origin;
  for (int axis = 0; axis < 3; ++axis) origin[axis] = static_cast<int32_t>(middle(axis)) & ~(kLeafSize - 1);
  try {
    const openvdb::FloatGrid::Ptr grid = dense_grid(field, crossed, origin);
    openvdb::tools::VolumeToMesh mesher(0, adaptivity);
    mesher(*grid);
    // Its points lie in the space of indices, where the middle of voxel v is v.
    mesh.vertices.reserve(mesher.pointListSize());
    for (size_t i = 0; i < mesher.pointListSize(); ++i) {
      const openvdb::Vec3s& p = mesher.pointList()[i];
      mesh.vertices.emplace_back(origin.x + 0.5 + p.x(), origin.y + 0.5 + p.y(), origin.z + 0.5 + p.z());
    }
    for (size_t n = 0; n < mesher.polygonPoolListSize(); ++n) {
      const openvdb::tools::PolygonPool& pool = mesher.polygonPoolList()[n];
      for (size_t i = 0; i < pool.numQuads(); ++i) {
        const openvdb::Vec4I& q = pool.quad(i);
        const auto apart = [&](int a, int b) { return glm::length(mesh.vertices[q[a]] - mesh.vertices[q[b]]); };
        if (apart(0, 2) <= apart(1, 3)) {
          mesh.triangles.insert(mesh.triangles.end(), {{q[0], q[1], q[2]}, {q[0], q[2], q[3]}});
        } else {
          mesh.triangles.insert(mesh.triangles.end(), {{q[0], q[1], q[3]}, {q[1], q[2], q[3]}});
        }
      }
      for (size_t i = 0; i < pool.numTriangles(); ++i) {
        const openvdb::Vec3I& t = pool.triangle(i);
        mesh.triangles.push_back({t[0], t[1], t[2]});
      }
    }
  } catch (const std::exception& e) {
    return input_error(fmt::format("OpenVDB's mesher failed: {}", e.what()));
  }
  return mesh;
}

}  // namespace world
