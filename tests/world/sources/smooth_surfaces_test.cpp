/// Spline patches and subdivision surfaces: against each other, and against what is known of them.
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "tests/support.h"
#include "tests/world/sources/sources_support.h"
#include "world/base/random.h"
#include "world/sources/mesh/patches.h"
#include "world/sources/mesh/subdivide.h"

namespace world {
namespace {

/// A closed net around a ring, off every symmetry, big enough for voxels of 1 m.
std::vector<Vec3d> ring_net(int rows, int columns) {
  std::vector<Vec3d> net;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double turn = 6.283185307179586 * row / rows, tube = 6.283185307179586 * column / columns;
      const double r = 20 + 8 * std::cos(tube) + 2 * std::cos(3 * turn);
      net.emplace_back(r * std::cos(turn) + 0.3, 8 * std::sin(tube) + 0.17, -r * std::sin(turn) + 0.41);
    }
  }
  return net;
}

TEST(SplinePatch, TrianglesLieWithinTheBound) {
  for (uint64_t i = 0; i < 30; ++i) {
    BezierPatch patch;
    for (size_t k = 0; k < 16; ++k) {
      const auto draw = [&](uint64_t n) { return uniform01_double(random_bits(5, 0, 0, 0, i, 3 * k + n)); };
      patch[k] =
          Vec3d(static_cast<double>(k % 4), static_cast<double>(k / 4), 0) + Vec3d(draw(0), draw(1), 2 * draw(2));
    }
    const double error = 0.02;
    const int n = divisions_for(patch, error);
    const TriangleMesh mesh = triangles_of({patch}, n);
    double worst = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
      // The middle of a triangle, where it is furthest from the patch, against the patch at the same place.
      const glm::uvec3& v = mesh.triangles[t];
      Vec3d middle(0.0), uv(0.0);
      for (int k = 0; k < 3; ++k) {
        middle += Vec3d(mesh.positions[v[k]]) / 3.0;
        uv += Vec3d(v[k] % (static_cast<uint32_t>(n) + 1), v[k] / (static_cast<uint32_t>(n) + 1), 0) / (3.0 * n);
      }
      worst = std::max(worst, glm::length(middle - patch_point(patch, uv.x, uv.y)));
    }
    EXPECT_LE(worst, error);
    EXPECT_GT(worst, error / 100) << "the bound is not idle";
  }
}

TEST(SplinePatch, ASpikeOfTooManyTrianglesIsAnErrorThatSaysWhatToDo) {
  std::string points;
  for (int i = 0; i < 16; ++i) points += fmt::format("{},{},{},", i % 4, i / 4, i == 5 ? 5000 : 0);
  const auto said = [&](double error) {
    const auto source = source_from(fmt::format(
        "kind='spline_patch'\nbasis='bezier'\nrows=4\ncolumns=4\nerror_voxels={}\npoints=[{}]", error, points));
    return source ? "" : source.error().message;
  };
  EXPECT_EQ(said(0.1),
            "test.toml:7:14: 1 patches of 513 x 513 parts would be more than 263168 triangles: allow a larger error, "
            "or a larger voxel_size_m");
  EXPECT_EQ(said(1), "");
}

TEST(SplinePatch, ABSplineOfAPlaneIsThatPlane) {
  std::vector<Vec3d> net;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 5; ++column) net.emplace_back(column, 2 * row, 3 + column - row);
  for (const BezierPatch& patch : patches_from_bspline(net, 6, 5, false, false)) {
    const Vec3d p = patch_point(patch, 0.3, 0.7);
    EXPECT_NEAR(p.z, 3 + p.x - 0.5 * p.y, 1e-12);
  }
}

TEST(Subdivision, OfARegularCageIsTheBSplineOfItsNet) {
  const int rows = 12, columns = 6;
  const std::vector<Vec3d> net = ring_net(rows, columns);
  const TemporaryFolder folder;
  std::string points;
  {
    std::ofstream cage(folder / "cage.obj");
    for (const Vec3d& p : net) {
      cage << fmt::format("v {:.9g} {:.9g} {:.9g}\n", p.x, p.y, p.z);
      points += fmt::format("{:.9g},{:.9g},{:.9g},", p.x, p.y, p.z);
    }
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        const auto v = [&](int r, int c) { return 1 + r % rows * columns + c % columns; };
        cage << fmt::format("f {} {} {} {}\n", v(row, column), v(row, column + 1), v(row + 1, column + 1),
                            v(row + 1, column));
      }
  }
  const auto spline = sample(fmt::format(
      "kind='spline_patch'\nrows={}\ncolumns={}\nclosed_rows=true\nclosed_columns=true\nerror_voxels=0.01\npoints=[{}]",
      rows, columns, points));
  const auto cage = sample(fmt::format("kind='subdivision'\nfile='{}'\nlevels=5", (folder / "cage.obj").string()));
  ASSERT_TRUE(spline.ok()) << spline.error().message;
  ASSERT_TRUE(cage.ok()) << cage.error().message;
  EXPECT_GT(spline->voxels(), 10000u);
  uint64_t differ = 0;
  const VoxelBox box = spline->store.bounds();
  for (int x = box.min.x - 1; x <= box.max.x + 1; ++x)
    for (int y = box.min.y - 1; y <= box.max.y + 1; ++y)
      for (int z = box.min.z - 1; z <= box.max.z + 1; ++z)
        differ += spline->store.get({x, y, z}) != cage->store.get({x, y, z});
  // Only voxels whose middles lie within a hundredth or so of the surface may: of some 5000 on it.
  EXPECT_LT(differ, 120u);
  EXPECT_GT(spline->voxels(), cage->voxels() - 120);
}

PolygonMesh cube() {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.positions.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
  mesh.face_sizes.assign(6, 4);
  mesh.face_corners = {0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6};
  return mesh;
}

TEST(Subdivision, CornersOfACubeHaveTheirKnownLimits) {
  // (n^2 v + 4 sum of edge neighbours + sum of the face's others) / (n (n + 5)), n = 3.
  // source Mark Halstead, Michael Kass, Tony DeRose. Efficient, Fair Interpolation using Catmull-Clark Surfaces. 1993
  for (const int levels : {1, 3, 5}) {
    const TriangleMesh mesh = subdivided(cube(), levels, "cube").value();
    float nearest = 9;
    for (const Vec3f& p : mesh.positions) nearest = std::min(nearest, glm::length(p - Vec3f(0.5f)));
    EXPECT_LT(nearest, 1e-6f) << levels;
    EXPECT_EQ(mesh.triangles.size(), 12u << (2 * levels));
  }
}

TEST(Subdivision, CreasesKeepTheCube) {
  const TemporaryFolder folder;
  const PolygonMesh mesh = cube();
  {
    std::ofstream out(folder / "cube.obj");
    for (const Vec3f& p : mesh.positions) out << fmt::format("v {} {} {}\n", 5 * p.x, 5 * p.y, 5 * p.z);
    for (size_t f = 0; f < 6; ++f)
      out << fmt::format("f {} {} {} {}\n", mesh.face_corners[4 * f] + 1, mesh.face_corners[4 * f + 1] + 1,
                         mesh.face_corners[4 * f + 2] + 1, mesh.face_corners[4 * f + 3] + 1);
  }
  const std::string keys = fmt::format("kind='subdivision'\nfile='{}'", (folder / "cube.obj").string());
  const auto smooth = sample(keys), sharp = sample(keys + "\ncrease_angle_deg=80");
  ASSERT_TRUE(smooth.ok() && sharp.ok());
  EXPECT_EQ(sharp->voxels(), 1000u);
  EXPECT_LT(smooth->voxels(), 500u);
  // A crease of the file: with the four edges of the top sharp, the shape stands between the two.
  std::ofstream(folder / "cube.obj", std::ios::app)
      << "t crease 2/1/0 2 3 10\nt crease 2/1/0 3 7 10\nt crease 2/1/0 7 6 10\nt crease 2/1/0 6 2 10\n";
  const auto lid = sample(keys);
  ASSERT_TRUE(lid.ok()) << lid.error().message;
  EXPECT_GT(lid->voxels(), smooth->voxels());
  EXPECT_LT(lid->voxels(), sharp->voxels());
  EXPECT_NE(lid->store.get({0, 4, 0}), kAir) << "its flat top reaches the cage";
  EXPECT_EQ(smooth->store.get({0, 4, 0}), kAir);
  std::ofstream(folder / "cube.obj", std::ios::app) << "t crease 2/1/0 2 99 10\n";
  EXPECT_FALSE(sample(keys).ok());
}

TEST(Subdivision, WhatIsNoSurfaceIsRefused) {
  PolygonMesh mesh = cube();
  mesh.face_sizes.push_back(4);
  mesh.face_corners.insert(mesh.face_corners.end(), {0, 4, 6, 2});
  const auto result = subdivided(mesh, 2, "cube");
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("edge"), std::string::npos);
  EXPECT_FALSE(subdivided(PolygonMesh{cube()}, 30, "cube").ok());
}

}  // namespace
}  // namespace world
