/// What marching cubes and marching tetrahedra make of one cell.
///
/// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2). An edge leads from corner `from` towards higher coordinates,
/// along the bits of `step`: cubes have those of one bit, tetrahedra all seven. `inside` has a bit for each corner
/// whose value is below or at 0.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace render {

struct CellEdge {
  uint8_t from, step;
  friend bool operator==(const CellEdge&, const CellEdge&) = default;
};

// ---- cubes ----

/// Edge 4 * axis + n: from the n-th of the corners that lie low along the axis.
const std::array<CellEdge, 12>& cube_edges();

/// Triangles of a cell, three numbers each: an edge of the cube below kCubeCentre, else kCubeCentre + n for the n-th
/// centre, the mean of the vertices on a loop that no triangles fill without a new edge on a face.
constexpr uint8_t kCubeCentre = 12;
struct CubeCase {
  std::vector<uint8_t> triangles;
  std::vector<std::vector<uint8_t>> centres;  // edges of their loops
};

/// Bit of a face whose corners change sides all along: set where the middle of its bilinear values is inside.
/// values: of the corners; other faces have 0.
uint32_t joined_faces(const std::array<float, 8>& values, uint32_t inside);
/// inside < 256, joined < 64: bits of faces that aren't ambiguous are ignored.
const CubeCase& cube_case(uint32_t inside, uint32_t joined);

// ---- tetrahedra ----

/// Triangles of the six tetrahedra along the diagonal from corner 0 to corner 7, three edges each. Those on the faces
/// of neighbouring cells fit.
std::span<const CellEdge> tetrahedra_case(uint32_t inside);

}  // namespace render
