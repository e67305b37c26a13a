/// A triangle mesh as a solid, or as a shell. What the sources of meshes, patches,
/// subdivision surfaces and points share.
#pragma once

#include <memory>

#include "world/meshes/mesh.h"
#include "world/sources/shape.h"

namespace world {

struct MeshFill {
  /// Off: what the surface encloses. On: a shell around the surface.
  bool shell = false;
  /// Of a shell, in the mesh's units; 0: only what the surface itself touches.
  double thickness = 0;
};

struct MeshShapeReport {
  uint64_t triangles = 0, vertices = 0, edges = 0;  // after equal positions were made one
  uint64_t border_edges = 0, holes_closed = 0;
  uint64_t conflicts = 0;  // edges with more than two faces, or faces that disagree on what is outside
};

/// Holes of a solid are closed by fans over their borders, so that it has an inside. Inside is where the surface winds
/// round a point: a ray along +x counts crossings by their direction, so parts that overlap unite. Where faces disagree
/// on what is outside, an odd number of crossings is inside. Each edge is tested the same way from both of its faces
/// and ties are broken as if the ray were moved by an infinitesimal, so no ray slips between two triangles. A box is
/// told to be mixed exactly where a triangle meets it (separating axes), so no voxel is missed.
std::shared_ptr<const Shape> mesh_shape(const TriangleMesh& mesh, const MeshFill& fill, MeshShapeReport& report);

/// Balls of a radius around points.
std::shared_ptr<const Shape> point_shape(const std::vector<Vec3d>& points, double radius);

}  // namespace world
