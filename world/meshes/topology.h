/// What a mesh's indices say of its shape: list, strip and fan, and who borders whom.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "world/meshes/mesh.h"

namespace world {

// ---- the three ways to list the triangles of a mesh ----
//
//   list   3n indices    triangle t: 3t, 3t + 1, 3t + 2
//   strip  n + 2         even t: t, t + 2, t + 1; odd t: t, t + 1, t + 2   (figure 14.14's order)
//   fan    n + 2         triangle t: 0, t + 1, t + 2

/// Triangles of two equal corners (with which strips jump) are left out. An index list that is too short gives none.
std::vector<glm::uvec3> triangles_from_list(std::span<const uint32_t> indices);
std::vector<glm::uvec3> triangles_from_strip(std::span<const uint32_t> indices);
std::vector<glm::uvec3> triangles_from_fan(std::span<const uint32_t> indices);

/// Strips that hold each triangle once, in its orientation. Greedy: from the first triangle that is left, along the
/// longest run of the three that start on its edges.
std::vector<std::vector<uint32_t>> strips_from_triangles(std::span<const glm::uvec3> triangles);
/// The strips as one, joined by triangles without area.
std::vector<uint32_t> joined_strip(std::span<const std::vector<uint32_t>> strips);
/// Fans that hold each triangle once, in its orientation: around the vertex with the most triangles left, each time.
std::vector<std::vector<uint32_t>> fans_from_triangles(std::span<const glm::uvec3> triangles);

// ---- adjacency ----

/// Vertices, faces and edges by half-edges. Half-edge 3t + k runs from corner k to corner k + 1 of triangle t, so
/// `next` within a triangle needs no table. A half-edge without a twin lies on the border.
struct HalfEdges {
  static constexpr uint32_t kNone = 0xffffffffu;
  std::vector<uint32_t> start;     // by half-edge: vertex
  std::vector<uint32_t> twin;      // by half-edge, or kNone
  std::vector<uint32_t> outgoing;  // by vertex: a half-edge that starts there, on the border where there is one; kNone
  uint64_t border = 0;             // half-edges without a twin
  uint64_t conflicts = 0;          // edges with more than two faces, or two faces of opposite orientation

  static uint32_t face_of(uint32_t half_edge) { return half_edge / 3; }
  static uint32_t next(uint32_t half_edge) { return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1; }
  static uint32_t previous(uint32_t half_edge) { return half_edge % 3 == 0 ? half_edge + 2 : half_edge - 1; }
  uint32_t end(uint32_t half_edge) const { return start[next(half_edge)]; }

  /// Closed, and each edge has exactly two faces that agree on what is outside.
  bool watertight() const { return border == 0 && conflicts == 0; }
  /// Faces around a vertex, and its neighbours, in order from `outgoing`.
  std::vector<uint32_t> faces_of_vertex(uint32_t vertex) const;
  std::vector<uint32_t> neighbours_of_vertex(uint32_t vertex) const;
  /// The faces across a face's three edges; kNone on the border.
  glm::uvec3 faces_of_face(uint32_t face) const;
  uint64_t edges() const;  // each once

  /// Border loops, as vertices in the order that a face which closes one would have. Loops that touch themselves in a
  /// vertex come as several.
  std::vector<std::vector<uint32_t>> border_loops() const;
};

HalfEdges half_edges(std::span<const glm::uvec3> triangles, size_t vertices);

/// The mesh with equal positions made one vertex, so that seams of normals and textures are no borders; without
/// triangles that this leaves without area.
TriangleMesh welded(const TriangleMesh& mesh);
/// Adds to a welded mesh a fan over each border loop, around the loop's middle. Returns the number of loops.
uint64_t close_holes(TriangleMesh& mesh);

}  // namespace world
