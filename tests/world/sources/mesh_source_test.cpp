/// Meshes as solids and shells, and points as splats.
#include <fstream>
#include <set>

#include <fmt/format.h>

#include "tests/support.h"
#include "tests/world/sources/sources_support.h"
#include "world/meshes/points.h"
#include "world/meshes/topology.h"
#include "world/sources/mesh/mesh_shape.h"

namespace world {
namespace {

/// A box of 12 triangles, turned outside.
TriangleMesh box_mesh(Vec3f low, Vec3f high) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z);
  for (const auto& quad : {std::array{0u, 4u, 6u, 2u},
                           {1u, 3u, 7u, 5u},
                           {0u, 1u, 5u, 4u},
                           {2u, 6u, 7u, 3u},
                           {0u, 2u, 3u, 1u},
                           {4u, 5u, 7u, 6u}}) {
    mesh.triangles.emplace_back(quad[0], quad[1], quad[2]);
    mesh.triangles.emplace_back(quad[0], quad[2], quad[3]);
  }
  return mesh;
}

TriangleMesh joined(TriangleMesh a, const TriangleMesh& b, bool turned = false) {
  const uint32_t first = static_cast<uint32_t>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const glm::uvec3& t : b.triangles) a.triangles.push_back(turned ? glm::uvec3(t.x, t.z, t.y) + first : t + first);
  return a;
}

uint64_t voxels_of(const TriangleMesh& mesh, const MeshFill& fill = {}, Sampling sampling = {}) {
  MeshShapeReport report;
  Sampled out;
  const auto sampled = sample_shape(out.store, *mesh_shape(mesh, fill, report), {}, sampling, 1);
  return sampled.ok() ? out.voxels() : UINT64_MAX;
}

TEST(MeshSource, ABoxOnTheGridIsExact) {
  EXPECT_EQ(voxels_of(box_mesh({-3, 2, 5}, {4, 9, 10})), 7u * 7 * 5);
  // Vertices and edges right on the rays through the middles of voxels.
  EXPECT_EQ(voxels_of(box_mesh({-3.25f, 2.5f, 5.5f}, {4.25f, 9.5f, 10.5f})), 7u * 7 * 5);
}

TEST(MeshSource, CavitiesStayEmptyAndOverlapsUnite) {
  const TriangleMesh outer = box_mesh({0, 0, 0}, {10, 10, 10}), inner = box_mesh({3, 3, 3}, {7, 7, 7});
  EXPECT_EQ(voxels_of(joined(outer, inner, /*turned=*/true)), 1000u - 64);
  EXPECT_EQ(voxels_of(joined(outer, inner)), 1000u) << "two that overlap are one";
  EXPECT_EQ(voxels_of(joined(outer, box_mesh({8, 2, 2}, {14, 6, 6}))), 1000u + 4 * 4 * 4);
}

TEST(MeshSource, HolesAreClosed) {
  TriangleMesh open = box_mesh({0, 0, 0}, {8, 8, 8});
  open.triangles.resize(10);  // without its +z side
  MeshShapeReport report;
  EXPECT_TRUE(mesh_shape(open, {}, report)->contains({4, 4, 4}));
  EXPECT_EQ(report.border_edges, 4u);
  EXPECT_EQ(report.holes_closed, 1u);
  EXPECT_EQ(voxels_of(open), 512u);
}

TEST(MeshSource, ShellsAreTight) {
  const TriangleMesh box = box_mesh({0.5f, 0.5f, 0.5f}, {20.5f, 20.5f, 20.5f});
  const uint64_t shell = 21 * 21 * 21 - 19 * 19 * 19;
  EXPECT_EQ(voxels_of(box, {.shell = true, .thickness = 1}), shell);
  EXPECT_EQ(voxels_of(box, {.shell = true, .thickness = 0}, {.coverage = 0}), shell) << "what its surface touches";
}

TEST(MeshSource, ListStripAndFanAreTheSameSolid) {
  const TriangleMesh box = box_mesh({0, 0, 0}, {6, 5, 4});
  std::string positions;
  for (const Vec3f& p : box.positions) positions += fmt::format("{},{},{},", p.x, p.y, p.z);
  const auto keys = [&](const char* order, const std::vector<uint32_t>& indices) {
    std::string list;
    for (const uint32_t i : indices) list += fmt::format("{},", i);
    return fmt::format("kind='mesh'\nvertices=8\npositions=[{}]\norder='{}'\ncount={}\nindices=[{}]", positions, order,
                       indices.size(), list);
  };
  std::vector<uint32_t> list;
  for (const glm::uvec3& t : box.triangles) list.insert(list.end(), {t.x, t.y, t.z});
  const auto of_list = sample(keys("list", list)),
             of_strip = sample(keys("strip", joined_strip(strips_from_triangles(box.triangles))));
  ASSERT_TRUE(of_list.ok()) << of_list.error().message;
  ASSERT_TRUE(of_strip.ok()) << of_strip.error().message;
  EXPECT_EQ(of_list->voxels(), 120u);
  EXPECT_EQ(of_strip->store.content_hash(), of_list->store.content_hash());
  EXPECT_FALSE(sample(keys("list", {0, 1, 99})).ok());
}

TEST(MeshSource, TheCowsVolumeIsThatOfItsTriangles) {
  const auto path = shared_data("mesh/spot.obj");
  if (!path) GTEST_SKIP();
  MeshReport read;
  const TriangleMesh mesh = read_mesh_file(*path, read).value();
  double volume = 0;  // divergence theorem
  for (const glm::uvec3& t : mesh.triangles) {
    const Vec3d a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
    volume += glm::dot(a, glm::cross(b, c)) / 6;
  }
  for (const double size : {0.04, 0.02, 0.01}) {
    const auto cow = sample(fmt::format("kind='mesh'\nfile='{}'\nvoxel_size_m={}", path->string(), size));
    ASSERT_TRUE(cow.ok()) << cow.error().message;
    const double cell = size * size * size;
    EXPECT_NEAR(static_cast<double>(cow->voxels()) * cell / volume, 1, size) << size;
  }
}

TEST(PointSource, BallsOfPointsOverlap) {
  TemporaryFolder folder;
  std::ofstream(folder / "two.pcd")
      << "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
         "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n0.5 0.5 0.5\n4.5 0.5 0.5\n";
  const std::string file = (folder / "two.pcd").string();
  const auto apart = sample(fmt::format("kind='points'\nfile='{}'", file)),
             touching = sample(fmt::format("kind='points'\nfile='{}'\nradius_m=3", file)),
             ball = sample("kind='implicit'\nsurface='sphere'\nradius=3\nposition=[0.5,0.5,0.5]");
  ASSERT_TRUE(apart.ok() && touching.ok() && ball.ok());
  EXPECT_EQ(apart->voxels(), 2u);
  EXPECT_LT(touching->voxels(), 2 * ball->voxels());
  EXPECT_GT(touching->voxels(), ball->voxels());
  for (int x = -3; x < 0; ++x) EXPECT_EQ(touching->store.get({x, 0, 0}), ball->store.get({x, 0, 0}));
}

}  // namespace
}  // namespace world
