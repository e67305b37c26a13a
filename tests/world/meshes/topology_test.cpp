#include "world/meshes/topology.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "world/base/random.h"

namespace world {
namespace {

/// Rotated so that the smallest corner comes first: equal for equal faces of equal orientation.
std::vector<std::array<uint32_t, 3>> sorted_faces(std::span<const glm::uvec3> triangles) {
  std::vector<std::array<uint32_t, 3>> faces;
  for (const glm::uvec3& t : triangles) {
    std::array<uint32_t, 3> f{t.x, t.y, t.z};
    std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
    faces.push_back(f);
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

/// A grid of quads, each two triangles.
TriangleMesh grid_mesh(uint32_t nx, uint32_t ny) {
  TriangleMesh mesh;
  for (uint32_t y = 0; y <= ny; ++y)
    for (uint32_t x = 0; x <= nx; ++x) mesh.positions.emplace_back(x, y, 0);
  for (uint32_t y = 0; y < ny; ++y) {
    for (uint32_t x = 0; x < nx; ++x) {
      const uint32_t a = y * (nx + 1) + x, b = a + 1, c = a + nx + 1, d = c + 1;
      mesh.triangles.emplace_back(a, b, d);
      mesh.triangles.emplace_back(a, d, c);
    }
  }
  return mesh;
}

const TriangleMesh& spot() {
  static const TriangleMesh mesh = [] {
    const auto path = shared_data("mesh/spot.obj");
    MeshReport report;
    return path ? welded(read_mesh_file(*path, report).value()) : grid_mesh(20, 20);
  }();
  return mesh;
}

TEST(Topology, FiguresOfTheThreeOrders) {
  const std::vector<uint32_t> indices{0, 1, 2, 3, 4, 5};
  EXPECT_EQ(triangles_from_list(indices), (std::vector<glm::uvec3>{{0, 1, 2}, {3, 4, 5}}));
  // Figure 14.14: even t: t, t + 2, t + 1; odd t: t, t + 1, t + 2.
  EXPECT_EQ(triangles_from_strip(indices), (std::vector<glm::uvec3>{{0, 2, 1}, {1, 2, 3}, {2, 4, 3}, {3, 4, 5}}));
  // Figure 14.15: 0, t + 1, t + 2.
  EXPECT_EQ(triangles_from_fan(indices), (std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}));
  EXPECT_TRUE(triangles_from_strip(std::vector<uint32_t>{1, 2}).empty());
  EXPECT_TRUE(triangles_from_fan(std::vector<uint32_t>{}).empty());
}

TEST(Topology, StripsAndFansHoldEachTriangleOnceInItsOrientation) {
  for (const TriangleMesh& mesh : {grid_mesh(7, 5), spot()}) {
    const auto expected = sorted_faces(mesh.triangles);
    const auto strips = strips_from_triangles(mesh.triangles);
    std::vector<glm::uvec3> of_strips, of_fans;
    size_t indices = 0;
    for (const auto& strip : strips) {
      const auto part = triangles_from_strip(strip);
      EXPECT_EQ(part.size() + 2, strip.size());
      of_strips.insert(of_strips.end(), part.begin(), part.end());
      indices += strip.size();
    }
    EXPECT_EQ(sorted_faces(of_strips), expected);
    EXPECT_LT(indices, 3 * mesh.triangles.size() * 2 / 3) << "a strip takes few more than n indices, a list 3n";
    EXPECT_EQ(sorted_faces(triangles_from_strip(joined_strip(strips))), expected);
    for (const auto& fan : fans_from_triangles(mesh.triangles)) {
      const auto part = triangles_from_fan(fan);
      EXPECT_EQ(part.size() + 2, fan.size());
      of_fans.insert(of_fans.end(), part.begin(), part.end());
    }
    EXPECT_EQ(sorted_faces(of_fans), expected);
  }
}

TEST(Topology, HalfEdgesKnowTheirNeighbours) {
  const TriangleMesh mesh = grid_mesh(3, 2);
  const HalfEdges edges = half_edges(mesh.triangles, mesh.positions.size());
  EXPECT_EQ(edges.border, 10u) << "the outline of 3 x 2 quads";
  EXPECT_EQ(edges.conflicts, 0u);
  // Euler: V - E + F = 1 for a disk.
  EXPECT_EQ(mesh.positions.size() + mesh.triangles.size(), edges.edges() + 1);
  for (uint32_t h = 0; h < edges.start.size(); ++h) {
    if (edges.twin[h] == HalfEdges::kNone) continue;
    EXPECT_EQ(edges.twin[edges.twin[h]], h);
    EXPECT_EQ(edges.start[edges.twin[h]], edges.end(h));
  }
  // Against a search of all faces.
  for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
    std::vector<uint32_t> faces, neighbours;
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        if (mesh.triangles[t][k] != v) continue;
        faces.push_back(t);
        neighbours.push_back(mesh.triangles[t][(k + 1) % 3]), neighbours.push_back(mesh.triangles[t][(k + 2) % 3]);
      }
    }
    std::sort(neighbours.begin(), neighbours.end());
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
    auto found = edges.faces_of_vertex(v), around = edges.neighbours_of_vertex(v);
    std::sort(found.begin(), found.end()), std::sort(around.begin(), around.end());
    EXPECT_EQ(found, faces) << v;
    EXPECT_EQ(around, neighbours) << v;
  }
  EXPECT_EQ(edges.faces_of_face(0)[0], HalfEdges::kNone);
  EXPECT_EQ(edges.faces_of_face(0)[2], 1u);
}

TEST(Topology, RealMeshesAreWhatTheyAre) {
  if (!shared_data("mesh/spot.obj") || !shared_data("mesh/stanford-bunny.obj")) GTEST_SKIP();
  const HalfEdges cow = half_edges(spot().triangles, spot().positions.size());
  EXPECT_TRUE(cow.watertight());
  EXPECT_EQ(spot().positions.size() + spot().triangles.size(), cow.edges() + 2) << "a sphere in topology";
  MeshReport report;
  TriangleMesh bunny = welded(read_mesh_file(*shared_data("mesh/stanford-bunny.obj"), report).value());
  const HalfEdges open = half_edges(bunny.triangles, bunny.positions.size());
  EXPECT_FALSE(open.watertight());
  EXPECT_EQ(open.border_loops().size(), 5u) << "the bunny has five holes in its base";
  close_holes(bunny);
  EXPECT_TRUE(half_edges(bunny.triangles, bunny.positions.size()).watertight());
}

TEST(Topology, TwinsAreTheFirstOfTheOtherDirection) {
  // Any triangles over few vertices, against each pair of half-edges.
  for (uint64_t round = 0; round < 20; ++round) {
    std::vector<glm::uvec3> triangles;
    const auto draw = [&](int64_t i, int64_t k) {
      return static_cast<uint32_t>(random_bits(round, i, k, 0) % (6 + round));
    };
    for (int64_t i = 0; i < 40; ++i) {
      const glm::uvec3 t(draw(i, 0), draw(i, 1), draw(i, 2));
      if (t.x != t.y && t.y != t.z && t.z != t.x) triangles.push_back(t);
    }
    const HalfEdges edges = half_edges(triangles, 30);  // of which some have none
    const auto count = static_cast<uint32_t>(edges.start.size());
    const auto first_of = [&](uint32_t from, uint32_t to) {
      uint32_t h = 0;
      while (h < count && !(edges.start[h] == from && edges.end(h) == to)) ++h;
      return h < count ? h : HalfEdges::kNone;
    };
    uint64_t conflicts = 0, border = 0;
    for (uint32_t h = 0; h < count; ++h) {
      const bool first = first_of(edges.start[h], edges.end(h)) == h;
      EXPECT_EQ(edges.twin[h], first ? first_of(edges.end(h), edges.start[h]) : HalfEdges::kNone) << round << ' ' << h;
      conflicts += !first;
      border += edges.twin[h] == HalfEdges::kNone;
    }
    EXPECT_EQ(edges.conflicts, conflicts);
    EXPECT_EQ(edges.border, border);
  }
}

TEST(Topology, DamageIsCounted) {
  const std::vector<glm::uvec3> three_at_an_edge{{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  EXPECT_EQ(half_edges(three_at_an_edge, 5).conflicts, 1u);
  const std::vector<glm::uvec3> turned{{0, 1, 2}, {0, 1, 3}};
  EXPECT_EQ(half_edges(turned, 4).conflicts, 1u);
}

}  // namespace
}  // namespace world
