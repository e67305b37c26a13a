#include "render/extract/isosurface.h"

#include <algorithm>
#include <bit>
#include <unordered_map>

#include <fmt/format.h>

#include "render/extract/marching_cells.h"
#include "world/base/jobs.h"
#include "world/store/volume_mesher.h"

namespace render {

namespace {

using world::kLeafVoxels;
using world::LeafPos;
using world::SolidField;
using world::Vec3d;
using world::VoxelMesh;
using world::VoxelPos;

constexpr std::string_view kMethodNames[] = {"blocks", "surface_nets", "marching_cubes", "marching_tetrahedra",
                                             "openvdb"};

constexpr VoxelPos corner_of_cell(int corner) { return {corner & 1, corner >> 1 & 1, corner >> 2}; }
constexpr Vec3d vec(VoxelPos v) { return Vec3d(v.x, v.y, v.z); }

/// What one leaf adds to the mesh. A vertex has a place, voxel * kinds + kind, of which `has` holds a bit; the vertices
/// lie in the order of their places. What comes after the last place counts the leaf's further vertices.
struct Piece {
  static constexpr int kMostKinds = 7, kNeighbourShift = 12;
  static_assert(kMostKinds * kLeafVoxels < 1 << kNeighbourShift);
  LeafPos leaf;
  std::array<uint64_t, kMostKinds * kLeafVoxels / 64> has{};
  std::array<uint16_t, kMostKinds * kLeafVoxels / 64> rank{};  // vertices before each word of `has`
  std::vector<Vec3d> vertices, further;                        // from the leaf's lowest voxel
  std::vector<uint16_t> corners;  // three a triangle: place, and above it which of the eight leaves it lies in
  size_t first_vertex = 0, first_triangle = 0;

  void add_vertex(size_t at, const Vec3d& vertex_place) {
    has[at / 64] |= uint64_t{1} << at % 64;
    vertices.push_back(vertex_place);
  }
  void finish() {
    uint16_t before = 0;
    for (size_t w = 0; w < has.size(); ++w) {
      rank[w] = before;
      before = static_cast<uint16_t>(before + std::popcount(has[w]));
    }
    vertices.insert(vertices.end(), further.begin(), further.end());
  }
  static size_t neighbour(uint16_t corner) { return corner >> kNeighbourShift; }
  static size_t place(uint16_t corner) { return corner & ((1u << kNeighbourShift) - 1); }
  /// Where the surface goes on beyond the leaves of the field, the mesh ends.
  void drop_triangles_beyond(const std::array<const Piece*, 8>& near) {
    const auto missing = [&](uint16_t corner) { return !near[neighbour(corner)]; };
    if (std::none_of(corners.begin(), corners.end(), missing)) return;
    std::vector<uint16_t> kept;
    for (size_t t = 0; t < corners.size(); t += 3)
      if (std::none_of(&corners[t], &corners[t] + 3, missing)) kept.insert(kept.end(), &corners[t], &corners[t] + 3);
    corners = std::move(kept);
  }
  size_t vertex(size_t at, size_t places) const {
    if (at >= places) return first_vertex + vertices.size() - further.size() + (at - places);
    return first_vertex + rank[at / 64] +
           static_cast<size_t>(std::popcount(has[at / 64] & ((uint64_t{1} << at % 64) - 1)));
  }
};

/// A cell that the surface passes: voxel `at` of the leaf, and the seven after it.
struct Cell {
  VoxelPos at;
  std::array<float, 8> values;
  uint32_t inside = 0;

  bool crosses(int from, int to) const { return (inside >> from & 1) != (inside >> to & 1); }
  /// Where the surface meets the edge between two corners, from the leaf's lowest voxel.
  Vec3d crossing(int from, int to) const {
    const double a = values[static_cast<size_t>(from)], b = values[static_cast<size_t>(to)];
    const Vec3d low = vec(at + corner_of_cell(from)), high = vec(at + corner_of_cell(to));
    return low + 0.5 + a / (a - b) * (high - low);
  }
};

/// Triangles between crossed edges: kinds are the steps of edges. `neighbours` lie above.
struct MarchingCubes {
  static constexpr int kKinds = 3, kNeighbours = 1;
  static constexpr int step(int kind) { return 1 << kind; }
  template <class Corner>
  static void triangles(const Cell& cell, Piece& piece, Corner corner) {
    const CubeCase& made = cube_case(cell.inside, joined_faces(cell.values, cell.inside));
    const size_t first_centre = piece.further.size();
    for (const auto& loop : made.centres) {
      Vec3d sum(0.0);
      for (const uint8_t e : loop) {
        const CellEdge edge = cube_edges()[e];
        sum += cell.crossing(edge.from, edge.from + edge.step);
      }
      piece.further.push_back(sum / static_cast<double>(loop.size()));
    }
    for (const uint8_t v : made.triangles) {
      if (v < kCubeCentre) {
        const CellEdge edge = cube_edges()[v];
        corner(corner_of_cell(edge.from), std::countr_zero(static_cast<unsigned>(edge.step)));
      } else {
        piece.corners.push_back(static_cast<uint16_t>(kKinds * kLeafVoxels + first_centre + (v - kCubeCentre)));
      }
    }
  }
};

struct MarchingTetrahedra {
  static constexpr int kKinds = 7, kNeighbours = 1;
  static constexpr int step(int kind) { return kind + 1; }
  template <class Corner>
  static void triangles(const Cell& cell, Piece&, Corner corner) {
    for (const CellEdge& edge : tetrahedra_case(cell.inside)) corner(corner_of_cell(edge.from), edge.step - 1);
  }
};

/// A vertex in each crossed cell, a square across each crossed edge. `neighbours` lie below.
template <bool kNets>
struct Dual {
  static constexpr int kKinds = 1, kNeighbours = -1;
  static Vec3d vertex(const Cell& cell) {
    if (!kNets) return vec(cell.at) + 1.0;
    Vec3d sum(0.0);
    int count = 0;
    for (const CellEdge& edge : cube_edges()) {
      if (!cell.crosses(edge.from, edge.from + edge.step)) continue;
      sum += cell.crossing(edge.from, edge.from + edge.step);
      ++count;
    }
    return sum / static_cast<double>(count);
  }
  template <class Corner>
  static void triangles(const Cell& cell, Piece&, Corner corner) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!cell.crosses(0, 1 << axis)) continue;
      VoxelPos u, v;
      u[(axis + 1) % 3] = 1, v[(axis + 2) % 3] = 1;
      // The cells around the edge, counter-clockwise seen from where it leads.
      const VoxelPos none, ring[4] = {none - u - v, none - v, none, none - u};
      for (const int k : {0, 1, 2, 0, 2, 3}) corner(ring[cell.inside & 1 ? k : (4 - k) % 4], 0);
    }
  }
};

template <class Method>
void mesh_leaf(const SolidField::Values& values, Piece& piece) {
  constexpr int kAlong = SolidField::kAlong;
  for (int i = 0; i < kLeafVoxels; ++i) {
    Cell cell{world::offset_in_leaf(i), {}};
    const size_t low = static_cast<size_t>((cell.at.x * kAlong + cell.at.y) * kAlong + cell.at.z);
    for (size_t c = 0; c < 8; ++c) {
      cell.values[c] = values[low + ((c & 1) * kAlong + (c >> 1 & 1)) * kAlong + (c >> 2)];
      cell.inside |= static_cast<uint32_t>(cell.values[c] <= 0) << c;
    }
    if (cell.inside == 0 || cell.inside == 255) continue;
    if constexpr (Method::kNeighbours > 0) {
      for (int kind = 0; kind < Method::kKinds; ++kind)
        if (cell.crosses(0, Method::step(kind)))
          piece.add_vertex(static_cast<size_t>(i * Method::kKinds + kind), cell.crossing(0, Method::step(kind)));
    } else {
      piece.add_vertex(static_cast<size_t>(i), Method::vertex(cell));
    }
    Method::triangles(cell, piece, [&](VoxelPos offset, int kind) {
      const VoxelPos at = cell.at + offset;
      const auto beyond = [&](int axis) { return (at[axis] & ~7) != 0 ? 1 << axis : 0; };
      const int neighbour = beyond(0) | beyond(1) | beyond(2);
      piece.corners.push_back(static_cast<uint16_t>(neighbour << Piece::kNeighbourShift |
                                                    (world::index_in_leaf(at) * Method::kKinds + kind)));
    });
  }
  piece.finish();
}

template <class Method>
world::Result<VoxelMesh> mesh_of(const SolidField& field) {
  // Mesh each leaf by itself.
  std::vector<SolidField::Values> values;
  const std::vector<LeafPos> leaves = world::crossed_leaves(field, values);
  std::vector<Piece> pieces(leaves.size());
  world::parallel_ranges(leaves.size(), 8, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      pieces[i].leaf = leaves[i];
      mesh_leaf<Method>(values[i], pieces[i]);
    }
  });
  values = {};
  std::unordered_map<LeafPos, const Piece*, world::PosHash> piece_at;
  for (const Piece& piece : pieces) piece_at[piece.leaf] = &piece;
  const auto neighbours = [&](LeafPos leaf) {
    std::array<const Piece*, 8> near{};
    for (int n = 0; n < 8; ++n) {
      const VoxelPos way = corner_of_cell(n);
      const int s = Method::kNeighbours;
      const auto found = piece_at.find(leaf + LeafPos{s * way.x, s * way.y, s * way.z});
      if (found != piece_at.end()) near[static_cast<size_t>(n)] = found->second;
    }
    return near;
  };
  world::parallel_ranges(pieces.size(), 8, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) pieces[i].drop_triangles_beyond(neighbours(pieces[i].leaf));
  });
  // Number vertices and triangles in the order of leaves.
  size_t vertices = 0, triangles = 0;
  for (Piece& piece : pieces) {
    piece.first_vertex = vertices, piece.first_triangle = triangles;
    vertices += piece.vertices.size(), triangles += piece.corners.size() / 3;
  }
  if (vertices > UINT32_MAX || triangles > UINT32_MAX)
    return world::input_error(fmt::format(
        "the surface has {} vertices and {} triangles, more than a mesh of 2^32 holds", vertices, triangles));
  VoxelMesh mesh;
  mesh.vertices.resize(vertices), mesh.triangles.resize(triangles);
  world::parallel_ranges(pieces.size(), 8, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Piece& piece = pieces[i];
      const Vec3d low = vec(voxel_from_leaf(piece.leaf));
      for (size_t v = 0; v < piece.vertices.size(); ++v)
        mesh.vertices[piece.first_vertex + v] = low + piece.vertices[v];
      const auto near = neighbours(piece.leaf);
      for (size_t c = 0; c < piece.corners.size(); ++c) {
        const size_t vertex = near[Piece::neighbour(piece.corners[c])]->vertex(Piece::place(piece.corners[c]),
                                                                               size_t{Method::kKinds} * kLeafVoxels);
        mesh.triangles[piece.first_triangle + c / 3][static_cast<int>(c % 3)] = static_cast<uint32_t>(vertex);
      }
    }
  });
  return mesh;
}

}  // namespace

std::span<const std::string_view> surface_method_names() { return kMethodNames; }

std::optional<SurfaceMethod> surface_method_from_name(std::string_view name) {
  for (size_t i = 0; i < std::size(kMethodNames); ++i)
    if (kMethodNames[i] == name) return static_cast<SurfaceMethod>(i);
  return std::nullopt;
}

world::Result<VoxelMesh> isosurface(const SolidField& field, SurfaceMethod method, double adaptivity) {
  switch (method) {
    case SurfaceMethod::blocks:
      return mesh_of<Dual<false>>(field);
    case SurfaceMethod::surface_nets:
      return mesh_of<Dual<true>>(field);
    case SurfaceMethod::marching_cubes:
      return mesh_of<MarchingCubes>(field);
    case SurfaceMethod::marching_tetrahedra:
      return mesh_of<MarchingTetrahedra>(field);
    case SurfaceMethod::openvdb:
      break;
  }
  return world::openvdb_mesh(field, adaptivity);
}

std::vector<world::Vec3f> vertex_normals(const VoxelMesh& mesh) {
  std::vector<Vec3d> sums(mesh.vertices.size(), Vec3d(0.0));
  for (const glm::uvec3& t : mesh.triangles) {
    const Vec3d &a = mesh.vertices[t.x], &b = mesh.vertices[t.y], &c = mesh.vertices[t.z];
    const Vec3d area = glm::cross(b - a, c - a);
    for (int k = 0; k < 3; ++k) sums[t[k]] += area;
  }
  std::vector<world::Vec3f> normals;
  normals.reserve(sums.size());
  for (const Vec3d& sum : sums) {
    const double length = glm::length(sum);
    normals.emplace_back(length > 0 ? sum / length : Vec3d(0.0));
  }
  return normals;
}

}  // namespace render
