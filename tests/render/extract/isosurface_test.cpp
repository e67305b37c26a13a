/// Laws of all methods that turn a field into triangles, and what each promises beyond.
#include "render/extract/isosurface.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "render/extract/marching_cells.h"
#include "world/base/jobs.h"
#include "world/base/random.h"

namespace render {
namespace {

using world::LeafPos;
using world::SolidField;
using world::Vec3d;
using world::VoxelBox;
using world::VoxelMesh;
using world::VoxelPos;

constexpr SurfaceMethod kAll[] = {SurfaceMethod::blocks, SurfaceMethod::surface_nets, SurfaceMethod::marching_cubes,
                                  SurfaceMethod::marching_tetrahedra, SurfaceMethod::openvdb};
std::string name_of(SurfaceMethod method) { return std::string(surface_method_names()[static_cast<size_t>(method)]); }

Vec3d middle_of(VoxelPos v) { return Vec3d(v.x, v.y, v.z) + 0.5; }

/// A function of places as a field, its leaves in any order.
class Shape : public world::SurfaceField {
 public:
  Shape(std::function<double(const Vec3d&)> value, const VoxelBox& box) : value_(std::move(value)) {
    field_ = world::function_surface([this](VoxelPos v) { return static_cast<float>(value_(middle_of(v))); }, box);
  }
  void read(LeafPos leaf, std::span<float> values) const override { field_->read(leaf, values); }
  std::vector<LeafPos> leaves() const override {
    std::vector<LeafPos> all = field_->leaves();
    if (reversed) std::reverse(all.begin(), all.end());
    return all;
  }
  float beyond() const override { return 3; }
  double value(const Vec3d& at) const { return value_(at); }
  bool reversed = false;

 private:
  std::function<double(const Vec3d&)> value_;
  std::unique_ptr<world::SurfaceField> field_;
};

VoxelMesh mesh_of(const world::SurfaceField& shape, SurfaceMethod method, double adaptivity = 0,
                  const world::MaskVolume* blocks = nullptr) {
  auto mesh = isosurface(SolidField(shape, blocks), method, adaptivity);
  EXPECT_TRUE(mesh.ok());
  return std::move(*mesh);
}

/// Edges that don't run as often one way as the other; and those that more than two triangles have.
struct Edges {
  size_t open = 0, crowded = 0;
};
Edges edges_of(const VoxelMesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, std::pair<int, int>> seen;  // low, high: runs up, runs down
  for (const glm::uvec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const uint32_t a = t[k], b = t[(k + 1) % 3];
      auto& runs = seen[{std::min(a, b), std::max(a, b)}];
      ++(a < b ? runs.first : runs.second);
    }
  Edges edges;
  for (const auto& [ends, runs] : seen) edges.open += runs.first != runs.second, edges.crowded += runs.first > 1;
  return edges;
}

double volume_of(const VoxelMesh& mesh) {
  double sum = 0;
  for (const glm::uvec3& t : mesh.triangles)
    sum += glm::dot(mesh.vertices[t.x], glm::cross(mesh.vertices[t.y], mesh.vertices[t.z])) / 6;
  return sum;
}

double ball(const Vec3d& p, const Vec3d& middle, double radius) { return glm::length(p - middle) - radius; }
double torus(const Vec3d& p, const Vec3d& middle, double large, double small) {
  const Vec3d d = p - middle;
  return std::hypot(std::hypot(d.x, d.z) - large, d.y) - small;
}
/// Values without any order, full of ambiguous cells; outside at the border of the box.
double noise(const Vec3d& p, int size, uint64_t seed) {
  const VoxelPos v{static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)),
                   static_cast<int>(std::floor(p.z))};
  for (int axis = 0; axis < 3; ++axis)
    if (v[axis] <= 0 || v[axis] >= size - 1) return 1;
  return world::uniform01_double(
             world::random_bits(seed, static_cast<uint64_t>((v.x * size + v.y) * size + v.z), 0, 0)) -
         0.5;
}

class EveryMethod : public ::testing::TestWithParam<SurfaceMethod> {
 protected:
  SurfaceMethod method() const { return GetParam(); }
  bool marching() const {
    return method() == SurfaceMethod::marching_cubes || method() == SurfaceMethod::marching_tetrahedra;
  }
};
INSTANTIATE_TEST_SUITE_P(Isosurface, EveryMethod, ::testing::ValuesIn(kAll),
                         [](const auto& method) { return name_of(method.param); });

TEST_P(EveryMethod, ClosesBallsAndToriAcrossLeavesAndRegionsAndFacesOutwards) {
  const Vec3d near(0.31, -0.17, 0.43), at_regions(128.2, -127.7, 255.9);
  for (const Vec3d& middle : {near, at_regions}) {
    const VoxelPos low{static_cast<int>(middle.x) - 16, static_cast<int>(middle.y) - 16,
                       static_cast<int>(middle.z) - 16};
    const VoxelBox box{low, low + VoxelPos{32, 32, 32}};
    const Shape round([&](const Vec3d& p) { return ball(p, middle, 10.3); }, box);
    const VoxelMesh of_ball = mesh_of(round, method());
    EXPECT_EQ(edges_of(of_ball).open, 0u);
    EXPECT_EQ(static_cast<int64_t>(of_ball.vertices.size()) - static_cast<int64_t>(of_ball.triangles.size()) / 2, 2)
        << "the Euler characteristic of a ball";
    const double exact = 4 / 3.0 * M_PI * std::pow(10.3, 3);
    EXPECT_NEAR(volume_of(of_ball), exact, 0.02 * exact);
    const Shape ring([&](const Vec3d& p) { return torus(p, middle, 9, 4); }, box);
    const VoxelMesh of_torus = mesh_of(ring, method());
    EXPECT_EQ(edges_of(of_torus).open, 0u);
    EXPECT_NEAR(volume_of(of_torus), 2 * M_PI * M_PI * 9 * 16, 0.03 * 2 * M_PI * M_PI * 9 * 16);
    if (marching()) {
      EXPECT_EQ(edges_of(of_torus).crowded, 0u);
      EXPECT_EQ(of_torus.vertices.size() * 2, of_torus.triangles.size()) << "the Euler characteristic of a torus is 0";
    }
  }
}

TEST_P(EveryMethod, IsClosedOnNoiseFullOfAmbiguousCells) {
  for (uint64_t seed = 0; seed < 4; ++seed) {
    const Shape random([&](const Vec3d& p) { return noise(p, 20, seed); }, {{0, 0, 0}, {19, 19, 19}});
    const VoxelMesh mesh = mesh_of(random, method());
    const Edges edges = edges_of(mesh);
    EXPECT_GT(mesh.triangles.size(), 10000u);
    EXPECT_EQ(edges.open, 0u);
    EXPECT_TRUE(edges.crowded == 0 || !marching()) << edges.crowded;
    EXPECT_GT(volume_of(mesh), 0);
  }
}

TEST_P(EveryMethod, LiesOnPlanesWhereTheFieldIsLinear) {
  if (method() == SurfaceMethod::blocks) return;
  const Vec3d normal = glm::normalize(Vec3d(0.3, 0.8, -0.5));
  const VoxelBox box{{0, 0, 0}, {23, 23, 23}};
  const auto outer = [](const Vec3d& p) { return std::min({p.x, p.y, p.z}) < 1 || std::max({p.x, p.y, p.z}) > 23; };
  const Shape plane([&](const Vec3d& p) { return outer(p) ? 3 : glm::dot(normal, p) - 4.2; }, box);
  const VoxelMesh mesh = mesh_of(plane, method());
  const auto inner = [](const Vec3d& p) { return std::min({p.x, p.y, p.z}) > 2 && std::max({p.x, p.y, p.z}) < 22; };
  size_t seen = 0;
  for (const Vec3d& v : mesh.vertices) {
    if (!inner(v)) continue;
    ASSERT_NEAR(plane.value(v), 0, 1e-5);
    ++seen;
  }
  EXPECT_GT(seen, 300u);
  for (const glm::uvec3& t : mesh.triangles) {
    const Vec3d &a = mesh.vertices[t.x], &b = mesh.vertices[t.y], &c = mesh.vertices[t.z];
    const Vec3d area = glm::cross(b - a, c - a);
    if (!inner(a) || !inner(b) || !inner(c) || glm::length(area) < 1e-3) continue;
    ASSERT_GT(glm::dot(glm::normalize(area), normal), 1 - 1e-5);
  }
}

TEST_P(EveryMethod, CutsASurfaceThatLeavesTheFieldsLeaves) {
  const Shape plane([&](const Vec3d& p) { return p.y + 0.1 * p.x - 4.2; }, {{0, 0, 0}, {15, 15, 15}});
  const VoxelMesh mesh = mesh_of(plane, method());
  EXPECT_GT(mesh.triangles.size(), 100u);
  for (const glm::uvec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ASSERT_LT(t[k], mesh.vertices.size());
}

TEST_P(EveryMethod, LiesNearTheShapeByItsOrderAndWithinItsCells) {
  for (const double radius : {6.0, 24.0}) {
    const Vec3d middle(0.31, -0.17, 0.43);
    const int reach = static_cast<int>(radius) + 4;
    const VoxelBox box{{-reach, -reach, -reach}, {reach, reach, reach}};
    const Shape round([&](const Vec3d& p) { return ball(p, middle, radius); }, box);
    for (const double adaptivity : {0.0, 0.5}) {
      if (adaptivity > 0 && method() != SurfaceMethod::openvdb) continue;
      const VoxelMesh mesh = mesh_of(round, method(), adaptivity);
      for (const Vec3d& v : mesh.vertices) {
        // A chord of a cell's diagonal lies 3 / (8 radius) below the sphere; merged cells are wider.
        const double bound = method() == SurfaceMethod::blocks ? 0.87 : adaptivity > 0 ? 0.3 : 0.5 / radius;
        ASSERT_LE(std::abs(round.value(v)), bound) << radius;
        // Some corner of its cell is inside, some outside.
        if (adaptivity > 0) continue;
        const VoxelPos low{static_cast<int>(std::floor(v.x - 0.5)), static_cast<int>(std::floor(v.y - 0.5)),
                           static_cast<int>(std::floor(v.z - 0.5))};
        int inside = 0;
        for (int c = 0; c < 8; ++c) inside += round.value(middle_of(low + VoxelPos{c & 1, c >> 1 & 1, c >> 2})) <= 0;
        ASSERT_TRUE(inside > 0 && inside < 8);
      }
    }
  }
}

TEST_P(EveryMethod, IsTheSameForAnyNumberOfThreadsAndOrderOfLeaves) {
  Shape random([](const Vec3d& p) { return noise(p, 30, 9); }, {{0, 0, 0}, {29, 29, 29}});
  const VoxelMesh mesh = mesh_of(random, method());
  random.reversed = true;
  for (const int threads : {1, 2}) {
    const world::ThreadLimit limit(threads);
    const VoxelMesh again = mesh_of(random, method());
    EXPECT_TRUE(again.vertices == mesh.vertices);
    EXPECT_TRUE(again.triangles == mesh.triangles);
  }
}

TEST_P(EveryMethod, TakesNothingNaNsAndInfinitiesWithoutHarm) {
  const VoxelBox box{{0, 0, 0}, {15, 15, 15}};
  const Shape outside([](const Vec3d&) { return 1.0; }, box), inside([](const Vec3d&) { return -1.0; }, box);
  const Shape unknown([](const Vec3d&) { return std::nan(""); }, box);
  for (const Shape* shape : {&outside, &inside, &unknown}) EXPECT_TRUE(mesh_of(*shape, method()).triangles.empty());
  EXPECT_TRUE(mesh_of(Shape([](const Vec3d&) { return 1.0; }, VoxelBox{}), method()).triangles.empty());
  // A ball of infinities with some NaN, which count as outside.
  const Shape odd(
      [](const Vec3d& p) {
        if (p.x == 8.5 && p.y == 8.5) return std::nan("");
        return ball(p, Vec3d(8.0), 5) <= 0 ? -HUGE_VAL : HUGE_VAL;
      },
      box);
  const VoxelMesh mesh = mesh_of(odd, method());
  EXPECT_FALSE(mesh.triangles.empty());
  EXPECT_EQ(edges_of(mesh).open, 0u);
  for (const Vec3d& v : mesh.vertices) ASSERT_TRUE(std::isfinite(v.x + v.y + v.z));
  // Values of 0 at many middles.
  const Shape level(
      [](const Vec3d& p) {
        return std::max({std::abs(p.x - 8.5), std::abs(p.y - 8.5), std::abs(p.z - 8.5)}) - 4;
      },
      box);
  const VoxelMesh cube = mesh_of(level, method());
  EXPECT_EQ(edges_of(cube).open, 0u);
  for (const Vec3d& v : cube.vertices) ASSERT_TRUE(std::isfinite(v.x + v.y + v.z));
  EXPECT_GT(volume_of(cube), 0.85 * 512);  // edges are cut off
  EXPECT_LE(volume_of(cube), 729 + 1e-9);
}

TEST_P(EveryMethod, FollowsLayersOfAStoreAndTheBlocksThatStandInTheirGaps) {
  world::BlockPalette palette;
  world::Block block;
  block.name = "stuff";
  const world::BlockId id = palette.add(block).value();
  world::Store store(palette);
  world::EditBatch batch;
  const Vec3d middle(70.3, 60.2, 50.1);
  world::FloatLayer& distance = store.make_layer(world::Layer::distance);
  for (int x = 40; x <= 100; ++x)
    for (int y = 30; y <= 90; ++y)
      for (int z = 20; z <= 80; ++z) {
        const double d = ball(middle_of({x, y, z}), middle, 20);
        if (d <= 0) batch.set({x, y, z}, id);
        if (std::abs(d) < 3) distance.set({x, y, z}, static_cast<float>(d));
      }
  ASSERT_TRUE(store.apply(batch).ok());
  const auto field = world::surface_field(store, 0);
  ASSERT_NE(field, nullptr);
  const world::MaskVolume& blocks = store.masks(world::MaskKind::occupied);
  const VoxelMesh whole = mesh_of(*field, method(), 0, &blocks);
  EXPECT_EQ(edges_of(whole).open, 0u);
  const double exact = 4 / 3.0 * M_PI * 8000;
  EXPECT_NEAR(volume_of(whole), exact, 0.01 * exact);
  // Dig a room beyond the band, bore into it from the side, and build far away: all of it is closed too.
  world::EditBatch dig;
  dig.fill({{64, 56, 44}, {71, 63, 55}}, world::kAir);
  dig.fill({{71, 59, 50}, {100, 60, 51}}, world::kAir);
  dig.fill({{500, 500, 500}, {503, 503, 503}}, id);
  ASSERT_TRUE(store.apply(dig).ok());
  const VoxelMesh dug = mesh_of(*field, method(), 0, &blocks);
  EXPECT_EQ(edges_of(dug).open, 0u);
  EXPECT_LT(volume_of(dug), volume_of(whole) - 400);
  EXPECT_GT(std::max_element(dug.vertices.begin(), dug.vertices.end(),
                             [](const Vec3d& a, const Vec3d& b) { return a.x < b.x; })
                ->x,
            503);
}

TEST_P(EveryMethod, OfADensityIsWhereItPassesTheLevelThoughBlocksStandInThinFogToo) {
  world::BlockPalette palette;
  world::Block block;
  block.name = "fog";
  const world::BlockId id = palette.add(block).value();
  world::Store store(palette);
  world::EditBatch batch;
  const Vec3d middle(7.7, 8.1, 7.9);
  world::FloatLayer& density = store.make_layer(world::Layer::density);
  for (int x = 0; x < 16; ++x)
    for (int y = 0; y < 16; ++y)
      for (int z = 0; z < 16; ++z) {
        const double d = 8 - glm::length(middle_of({x, y, z}) - middle);
        if (d <= 0) continue;
        batch.set({x, y, z}, id);
        density.set({x, y, z}, static_cast<float>(d / 8));
      }
  ASSERT_TRUE(store.apply(batch).ok());
  EXPECT_EQ(world::surface_field(store, 0), nullptr);
  const auto field = world::surface_field(store, 0.375f);
  const VoxelMesh mesh = mesh_of(*field, method(), 0, &store.masks(world::MaskKind::occupied));
  EXPECT_EQ(edges_of(mesh).open, 0u);
  EXPECT_NEAR(volume_of(mesh), 4 / 3.0 * M_PI * 125, 25);
}

TEST_P(EveryMethod, NormalsOfVerticesPointOutwards) {
  const Vec3d middle(0.31, -0.17, 0.43);
  const Shape round([&](const Vec3d& p) { return ball(p, middle, 9); }, {{-12, -12, -12}, {12, 12, 12}});
  const VoxelMesh mesh = mesh_of(round, method());
  const std::vector<world::Vec3f> normals = vertex_normals(mesh);
  ASSERT_EQ(normals.size(), mesh.vertices.size());
  for (size_t v = 0; v < normals.size(); ++v) {
    const double least = method() == SurfaceMethod::blocks ? 0.5 : 0.97;
    ASSERT_GT(glm::dot(Vec3d(normals[v]), glm::normalize(mesh.vertices[v] - middle)), least);
  }
}

TEST(Isosurface, AtADistanceKeepsItsShape) {
  const int far = 100'000'000;
  const Vec3d middle = Vec3d(far) + Vec3d(0.31, -0.17, 0.43);
  const Shape round([&](const Vec3d& p) { return ball(p, middle, 6); },
                    {{far - 9, far - 9, far - 9}, {far + 9, far + 9, far + 9}});
  for (const SurfaceMethod method : kAll) {
    if (method == SurfaceMethod::blocks) continue;
    SCOPED_TRACE(name_of(method));
    for (const Vec3d& v : mesh_of(round, method).vertices) ASSERT_NEAR(round.value(v), 0, 0.5 / 6);
  }
}

TEST(Isosurface, AdaptivityOfOpenVdbGivesFewerTriangles) {
  const Shape round([](const Vec3d& p) { return ball(p, Vec3d(0.3), 20); }, {{-23, -23, -23}, {23, 23, 23}});
  size_t before = SIZE_MAX;
  for (const double adaptivity : {0.0, 0.1, 0.5}) {
    const VoxelMesh mesh = mesh_of(round, SurfaceMethod::openvdb, adaptivity);
    EXPECT_LT(mesh.triangles.size(), before);
    EXPECT_EQ(edges_of(mesh).open, 0u);
    before = mesh.triangles.size();
  }
}

TEST(Isosurface, NamesAreThoseOfTheMethods) {
  for (const SurfaceMethod method : kAll) EXPECT_EQ(surface_method_from_name(name_of(method)), method);
  EXPECT_EQ(surface_method_from_name("cubes"), std::nullopt);
}

// ---- one cell ----

/// Edges that border no triangle of another face of the cell lie on its faces, each once; others twice, once each way.
TEST(MarchingCells, EveryCaseIsOrientedHasNoEdgeTwiceAndNoNewEdgeOnAFace) {
  for (uint32_t inside = 0; inside < 256; ++inside)
    for (uint32_t joined = 0; joined < 64; ++joined) {
      const CubeCase& made = cube_case(inside, joined);
      std::map<std::pair<int, int>, int> runs;
      for (size_t i = 0; i < made.triangles.size(); i += 3)
        for (size_t k = 0; k < 3; ++k) ++runs[{made.triangles[i + k], made.triangles[i + (k + 1) % 3]}];
      std::set<int> used;
      for (const auto& [ends, count] : runs) {
        ASSERT_EQ(count, 1) << inside << ' ' << joined;
        used.insert(ends.first);
        const bool both = runs.count({ends.second, ends.first}) > 0;
        if (ends.first >= kCubeCentre || ends.second >= kCubeCentre) {
          ASSERT_TRUE(both);
          continue;
        }
        const CellEdge a = cube_edges()[static_cast<size_t>(ends.first)],
                       b = cube_edges()[static_cast<size_t>(ends.second)];
        bool on_a_face = false;
        for (int bit = 1; bit < 8; bit *= 2)
          on_a_face |= !((a.step | b.step) & bit) && (a.from & bit) == (b.from & bit);
        ASSERT_EQ(both, !on_a_face) << inside << ' ' << joined;
      }
      for (int e = 0; e < 12; ++e) {
        const CellEdge edge = cube_edges()[static_cast<size_t>(e)];
        const bool crossed = (inside >> edge.from & 1) != (inside >> (edge.from + edge.step) & 1);
        ASSERT_EQ(used.count(e) > 0, crossed) << inside << ' ' << joined;
      }
    }
}

TEST(MarchingCells, AnAmbiguousFaceIsJoinedWhereItsMiddleIsInside) {
  // Corners 0 and 3 of the face z = 0 inside, 1 and 2 outside: the saddle is inside where 0 * 3 outweighs 1 * 2.
  std::array<float, 8> values{-2, 1, 1, -2, 5, 5, 5, 5};
  const uint32_t inside = 1 | 1 << 3, face_low_z = 1 << 4;
  EXPECT_EQ(joined_faces(values, inside), face_low_z);
  EXPECT_EQ(cube_case(inside, face_low_z).triangles.size(), 12u);  // a saddle: one loop of six edges
  values = {-1, 2, 2, -1, 5, 5, 5, 5};
  EXPECT_EQ(joined_faces(values, inside), 0u);
  EXPECT_EQ(cube_case(inside, 0).triangles.size(), 6u);  // two corners by themselves
}

/// How the triangles of a cell with one corner, and with all others, inside are turned.
TEST(MarchingCells, TrianglesTurnCounterClockwiseSeenFromOutside) {
  const auto middle = [](const CellEdge& edge) {
    return Vec3d(edge.from & 1, edge.from >> 1 & 1, edge.from >> 2) +
           0.5 * Vec3d(edge.step & 1, edge.step >> 1 & 1, edge.step >> 2);
  };
  for (uint32_t corner = 0; corner < 8; ++corner)
    for (const bool most : {false, true}) {
      const uint32_t inside = most ? 255 ^ 1u << corner : 1u << corner;
      const Vec3d outwards = (most ? 1.0 : -1.0) * (Vec3d(corner & 1, corner >> 1 & 1, corner >> 2) - 0.5);
      std::vector<Vec3d> places;
      for (const uint8_t e : cube_case(inside, 0).triangles) places.push_back(middle(cube_edges()[e]));
      for (const CellEdge& edge : tetrahedra_case(inside)) places.push_back(middle(edge));
      ASSERT_GE(places.size(), 6u);
      for (size_t i = 0; i < places.size(); i += 3)
        ASSERT_GT(glm::dot(glm::cross(places[i + 1] - places[i], places[i + 2] - places[i]), outwards), 0);
    }
}

}  // namespace
}  // namespace render
