#include "world/sources/mesh/mesh_shape.h"

#include "world/meshes/topology.h"
#include "world/sources/mesh/triangle_tree.h"

namespace world {
namespace {

std::vector<TriangleTree::Triangle> corners_of(const TriangleMesh& mesh) {
  std::vector<TriangleTree::Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const glm::uvec3& t : mesh.triangles)
    triangles.push_back({Vec3d(mesh.positions[t.x]), Vec3d(mesh.positions[t.y]), Vec3d(mesh.positions[t.z])});
  return triangles;
}

class SolidMesh final : public Shape {
 public:
  SolidMesh(const TriangleMesh& mesh, bool oriented) : tree_(corners_of(mesh)), oriented_(oriented) {}
  ShapeBox bounds() const override { return tree_.bounds(); }
  Cover classify(const ShapeBox& box) const override {
    if (tree_.touches(box)) return Cover::mixed;
    return contains(box.centre()) ? Cover::inside : Cover::outside;
  }
  bool contains(const Vec3d& p) const override {
    if (!tree_.bounds().contains(p)) return false;
    const TriangleTree::Crossings crossings = tree_.crossings(p);
    return oriented_ ? crossings.winding != 0 : crossings.count % 2 != 0;
  }

 private:
  TriangleTree tree_;
  bool oriented_;
};

/// Everything within a distance of triangles, or of points, which are triangles without extent.
class Shell final : public Shape {
 public:
  Shell(std::vector<TriangleTree::Triangle> triangles, double reach) : tree_(std::move(triangles)), reach_(reach) {}
  ShapeBox bounds() const override { return {tree_.bounds().min - reach_, tree_.bounds().max + reach_}; }
  Cover classify(const ShapeBox& box) const override {
    if (reach_ == 0) return tree_.touches(box) ? Cover::mixed : Cover::outside;
    // Distances within the box differ from that of its middle by at most half its diagonal.
    const double diagonal = 0.5 * glm::length(box.max - box.min);
    if (!tree_.within(box.centre(), reach_ + diagonal)) return Cover::outside;
    return reach_ >= diagonal && tree_.within(box.centre(), reach_ - diagonal) ? Cover::inside : Cover::mixed;
  }
  bool contains(const Vec3d& p) const override { return tree_.within(p, reach_); }

 private:
  TriangleTree tree_;
  double reach_;
};

}  // namespace

std::shared_ptr<const Shape> mesh_shape(const TriangleMesh& mesh, const MeshFill& fill, MeshShapeReport& report) {
  TriangleMesh closed = welded(mesh);
  const HalfEdges edges = half_edges(closed.triangles, closed.positions.size());
  report = {.triangles = closed.triangles.size(),
            .vertices = closed.positions.size(),
            .edges = edges.edges(),
            .border_edges = edges.border,
            .conflicts = edges.conflicts};
  if (fill.shell) return std::make_shared<Shell>(corners_of(closed), 0.5 * fill.thickness);
  if (edges.border > 0) report.holes_closed = close_holes(closed);
  return std::make_shared<SolidMesh>(closed, edges.conflicts == 0);
}

std::shared_ptr<const Shape> point_shape(const std::vector<Vec3d>& points, double radius) {
  std::vector<TriangleTree::Triangle> triangles;
  triangles.reserve(points.size());
  for (const Vec3d& p : points) triangles.push_back({p, p, p});
  return std::make_shared<Shell>(std::move(triangles), radius);
}

}  // namespace world
