// Rays that meet meshes: the same hit as a loop over all triangles gives, wherever the meshes lie and rays start.
#include "render/trace/mesh_scene.h"

#include <atomic>
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <xmmintrin.h>

#include "tests/support.h"
#include "world/base/jobs.h"
#include "world/space/ray_shapes.h"

namespace render {
namespace {

using world::BlockId;
using world::GridRay;
using world::MeshInstance;
using world::TriangleMesh;
using world::VoxelPos;
using world::World;
using world::WorldPoint;

struct Random {
  std::mt19937_64 bits;
  explicit Random(uint64_t seed) : bits(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(bits); }
  int below(int n) { return static_cast<int>(bits() % static_cast<uint64_t>(n)); }
  Vec3d in_cube(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
  Vec3d direction() {
    while (true) {
      const Vec3d d = in_cube(1);
      if (length(d) > 0.1 && length(d) < 1) return normalize(d);
    }
  }
};

MeshInstance instance_of(TriangleMesh mesh, WorldPoint position = {}) {
  MeshInstance instance;
  instance.name = "m", instance.where = "s.toml:1:1";
  instance.mesh = std::make_shared<const TriangleMesh>(std::move(mesh));
  instance.position = position;
  return instance;
}

/// Triangles here and there, some large, some thin, some in the same plane or with corners in common.
TriangleMesh soup(Random& random, int count) {
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    const Vec3d at = random.in_cube(3);
    const double size = std::pow(10, random.uniform(-2, 0.3));
    for (int c = 0; c < 3; ++c) {
      if (!mesh.positions.empty() && random.below(4) == 0)
        mesh.positions.push_back(mesh.positions[random.bits() % mesh.positions.size()]);
      else
        mesh.positions.emplace_back(at + random.in_cube(size));
    }
    const uint32_t n = static_cast<uint32_t>(mesh.positions.size());
    mesh.triangles.emplace_back(n - 3, n - 2, n - 1);
  }
  return mesh;
}

/// A sphere of 2 * n^2 triangles whose corners are moved in and out: closed, not convex, every corner of many
/// triangles.
TriangleMesh potato(Random& random, int n) {
  TriangleMesh mesh;
  const double pi = 3.14159265358979323846;
  const auto add = [&](const Vec3d& p) { mesh.positions.emplace_back(p * random.uniform(0.5, 1.5)); };
  add({0, 1, 0});
  for (int j = 1; j < n; ++j)
    for (int i = 0; i < n; ++i)
      add({std::sin(pi * j / n) * std::cos(2 * pi * i / n), std::cos(pi * j / n),
           -std::sin(pi * j / n) * std::sin(2 * pi * i / n)});
  add({0, -1, 0});
  const auto at = [&](int j, int i) {
    return static_cast<uint32_t>(j == 0 ? 0 : j == n ? (n - 1) * n + 1 : (j - 1) * n + i % n + 1);
  };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      if (j > 0) mesh.triangles.emplace_back(at(j, i), at(j + 1, i), at(j, i + 1));
      if (j < n - 1 || j == 0) mesh.triangles.emplace_back(at(j, i + 1), at(j + 1, i), at(j + 1, i + 1));
    }
  std::erase_if(mesh.triangles, [](const glm::uvec3& t) { return t.x == t.y || t.y == t.z || t.x == t.z; });
  return mesh;
}

MeshScene built(const World& world) {
  auto scene = MeshScene::build(world);
  EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().message);
  return std::move(*scene);
}

/// The loop over all triangles, relative to the same origin as the scene's own: the voxel `base`.
MeshHit by_loop(const World& world, const GridRay& ray, MeshOrigin from, VoxelPos base) {
  MeshHit best;
  const Vec3d start = WorldPoint{ray.voxel, ray.fraction} - WorldPoint{base, Vec3d(0)};
  for (uint32_t i = 0; i < world.meshes.size(); ++i) {
    const MeshInstance& m = world.meshes[i];
    const Vec3d moved = m.position - WorldPoint{base, Vec3d(0)};
    for (uint32_t k = 0; k < m.mesh->triangles.size(); ++k) {
      if (i == from.instance && k == from.triangle) continue;
      const glm::uvec3& t = m.mesh->triangles[k];
      const auto corner = [&](uint32_t v) { return moved + m.transform * Vec3d(m.mesh->positions[v]); };
      const Vec3d a = corner(t.x), b = corner(t.y), c = corner(t.z);
      if (!world::triangle_normal(a, b, c)) continue;
      const auto hit = world::intersect_triangle(start, ray.direction, a, b, c, best.hit ? best.t : ray.t_max);
      if (!hit || (best.hit && hit->t >= best.t)) continue;
      best.hit = true, best.t = hit->t, best.instance = i, best.triangle = k;
    }
  }
  return best;
}

TEST(MeshScene, HitsAreThoseOfALoopOverAllTrianglesBitForBit) {
  Random random(1);
  World world;
  world.meshes.push_back(instance_of(soup(random, 300)));
  world.meshes.push_back(instance_of(soup(random, 100), {{2, 1, -3}, {0.25, 0.5, 0.125}}));
  world.meshes[1].transform = glm::dmat3(Vec3d(0.5, 1, 0), Vec3d(-1, 0.7, 0.2), Vec3d(0, -0.3, -2));
  const MeshScene scene = built(world);
  // The middle of the boxes of the corners.
  Vec3d low(1e300), high(-1e300);
  for (const MeshInstance& m : world.meshes)
    for (const Vec3f& p : m.mesh->positions) {
      const Vec3d corner = (m.position - WorldPoint{}) + m.transform * Vec3d(p);
      low = min(low, corner), high = max(high, corner);
    }
  const WorldPoint middle = WorldPoint{} + 0.5 * (low + high);
  int hits = 0, excluded = 0;
  for (int i = 0; i < 20000; ++i) {
    // From inside, from near, and from up to 10^9 m away.
    const double distance = i % 3 == 0 ? random.uniform(0, 3) : std::pow(10, random.uniform(0, 8.9));
    const WorldPoint target = WorldPoint{} + random.in_cube(3), start = target + distance * random.direction();
    GridRay ray(start, target - start);
    if (ray.degenerate()) continue;
    const double scale = std::pow(10, random.uniform(-6, 6));
    ray.direction *= scale;
    if (i % 5 == 0) ray.t_max = random.uniform(0.5, 2) / scale;
    if (i % 7 == 0) ray.direction[random.below(3)] = 0;
    MeshOrigin from;
    MeshHit expected = by_loop(world, ray, from, middle.voxel);
    if (expected.hit && i % 4 == 0) {
      from = {expected.instance, expected.triangle};
      expected = by_loop(world, ray, from, middle.voxel);
      ++excluded;
    }
    const MeshHit hit = scene.intersect(ray, from);
    ASSERT_EQ(hit.hit, expected.hit) << "ray " << i << " from " << distance << " m";
    EXPECT_EQ(scene.occluded(ray, from), expected.hit);
    if (!hit.hit) continue;
    ++hits;
    ASSERT_EQ(hit.t, expected.t) << "ray " << i;
    ASSERT_EQ(hit.instance, expected.instance);
    ASSERT_EQ(hit.triangle, expected.triangle);
    EXPECT_NEAR(length(Vec3d(hit.normal)), 1, 3e-7);
    EXPECT_EQ(hit.normal, hit.shading_normal);
  }
  EXPECT_GT(hits, 5000);
  EXPECT_GT(excluded, 1000);
}

TEST(MeshScene, NoRayLeavesAClosedMeshAnywhereInTheWorld) {  // hard case G3
  Random random(2);
  const TriangleMesh mesh = potato(random, 24);
  for (const VoxelPos where : {VoxelPos{0, 0, 0}, VoxelPos{100000000, -5, 7}, VoxelPos{-1000000000, 3, 1000000000}}) {
    World world;
    world.meshes.push_back(instance_of(mesh, {where, {0.3, 0.6, 0.1}}));
    const MeshScene scene = built(world);
    int leaks = 0;
    for (int i = 0; i < 30000; ++i) {
      const WorldPoint start = world.meshes[0].position + random.in_cube(0.2);
      // At a corner, at an edge, or anywhere.
      const glm::uvec3& t = mesh.triangles[random.bits() % mesh.triangles.size()];
      const Vec3d a(mesh.positions[t.x]), b(mesh.positions[t.y]);
      const double share = i % 3 == 0 ? 0.0 : random.uniform(0, 1);
      const Vec3d direction =
          i % 3 == 2 ? random.direction() : ((world.meshes[0].position + (a + share * (b - a))) - start);
      leaks += !scene.intersect(GridRay(start, direction)).hit;
      leaks += !scene.occluded(GridRay(start, direction));
    }
    EXPECT_EQ(leaks, 0) << where.x;
  }
}

TEST(MeshScene, ARayFromAHitNeverMeetsItsOwnTriangle) {  // hard case G4
  Random random(3);
  for (int power = -3; power <= 5; ++power) {
    TriangleMesh mesh;
    const double size = std::pow(10, power);
    for (int c = 0; c < 300; ++c) mesh.positions.emplace_back(random.in_cube(size));
    for (uint32_t t = 0; t < 100; ++t) mesh.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    World world;
    world.meshes.push_back(instance_of(std::move(mesh), {{random.below(1000000), 0, 0}, {0.7, 0.1, 0.9}}));
    const MeshScene scene = built(world);
    int hits = 0;
    for (int i = 0; i < 3000; ++i) {
      const WorldPoint start = world.meshes[0].position + random.in_cube(2 * size);
      const GridRay ray(start, random.direction());
      const MeshHit hit = scene.intersect(ray);
      if (!hit.hit) continue;
      ++hits;
      // By its name, from the point itself; and by the offset alone, to both sides.
      const Vec3d direction = random.direction();
      const MeshOrigin from{hit.instance, hit.triangle};
      const WorldPoint at = WorldPoint{ray.voxel, Vec3d(0)} + hit.point;
      const MeshHit named = scene.intersect(GridRay(at, direction), from);
      EXPECT_FALSE(named.hit && named.triangle == hit.triangle);
      const Vec3d moved = world::offset_ray_origin<double>({hit.point, hit.error}, Vec3d(hit.normal), direction);
      const WorldPoint away = WorldPoint{ray.voxel, Vec3d(0)} + moved;
      const MeshHit again = scene.intersect(GridRay(away, direction));
      EXPECT_FALSE(again.hit && again.triangle == hit.triangle) << "size " << size;
    }
    EXPECT_GT(hits, 300);
  }
}

TEST(MeshScene, ThePointLiesOnTheTriangleWithinItsError) {
  Random random(4);
  World world;
  world.meshes.push_back(instance_of(soup(random, 100), {{300000000, 20, -7}, {0.5, 0.25, 0.75}}));
  const MeshScene scene = built(world);
  using Exact = glm::vec<3, long double>;
  int hits = 0;
  for (int i = 0; i < 5000; ++i) {
    const WorldPoint start = world.meshes[0].position + std::pow(10, random.uniform(0, 6)) * random.direction();
    const GridRay ray(start, (world.meshes[0].position + random.in_cube(3)) - start);
    const MeshHit hit = scene.intersect(ray);
    if (!hit.hit) continue;
    ++hits;
    const TriangleMesh& mesh = *world.meshes[0].mesh;
    const glm::uvec3& t = mesh.triangles[hit.triangle];
    // Corners relative to the ray's voxel: sums of a whole number, a fraction of few bits and a float are exact enough.
    const Exact moved =
        Exact(world.meshes[0].position.fraction) + Exact(double(world.meshes[0].position.voxel.x) - ray.voxel.x,
                                                         double(world.meshes[0].position.voxel.y) - ray.voxel.y,
                                                         double(world.meshes[0].position.voxel.z) - ray.voxel.z);
    const Exact a = moved + Exact(mesh.positions[t.x]), b = moved + Exact(mesh.positions[t.y]),
                c = moved + Exact(mesh.positions[t.z]);
    const Exact normal = normalize(cross(b - a, c - a));
    const long double off = std::abs(dot(normal, Exact(hit.point) - a));
    // Corners relative to the scene's own base are rounded once more, at some 10 m.
    EXPECT_LE(static_cast<double>(off), dot(abs(Vec3d(normal)), hit.error) + 1e-14);
    EXPECT_LT(std::max({hit.error.x, hit.error.y, hit.error.z}), 1e-9);
  }
  EXPECT_GT(hits, 300);
}

TEST(MeshScene, MeshesFarAwayAreMetAsTheyAreAtTheOrigin) {
  Random random(5);
  World here, there;
  const TriangleMesh mesh = soup(random, 200);
  const VoxelPos far{1000000000, -900000000, 1000000001};
  here.meshes.push_back(instance_of(mesh));
  there.meshes.push_back(instance_of(mesh, {far, Vec3d(0)}));
  const MeshScene near_scene = built(here), far_scene = built(there);
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    GridRay ray(WorldPoint{} + random.in_cube(5), random.direction());
    const MeshHit a = near_scene.intersect(ray);
    ray.voxel = ray.voxel + far;
    const MeshHit b = far_scene.intersect(ray);
    ASSERT_EQ(a.hit, b.hit);
    EXPECT_EQ(a.t, b.t);
    EXPECT_EQ(a.triangle, b.triangle);
    EXPECT_EQ(a.point, b.point);
    hits += a.hit;
  }
  EXPECT_GT(hits, 300);
}

/// One triangle in the plane z = 0, counter-clockwise seen from +z, with normals that lean outwards.
TriangleMesh one_triangle() {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.normals = {{0, 0, 1}, {0.6f, 0, 0.8f}, {0, 0.6f, 0.8f}};
  mesh.texture_coordinates = {{0, 0}, {4, 0}, {0, 8}};
  return mesh;
}

TEST(MeshScene, NormalsPointOutOfTheFrontSideMirroredOrNot) {
  for (const bool mirrored : {false, true})
    for (const bool smooth : {false, true}) {
      World world;
      world.meshes.push_back(instance_of(one_triangle()));
      world.meshes[0].smooth = smooth;
      world.meshes[0].transform = glm::dmat3(mirrored ? -1.0 : 1.0);  // a mirror through a point
      const MeshScene scene = built(world);
      const double side = mirrored ? -1 : 1;
      for (const double from : {5.0, -5.0}) {  // both sides are met, the normal is the front's
        const MeshHit hit =
            scene.intersect(GridRay(WorldPoint{} + Vec3d(side * 0.25, side * 0.5, from), {0, 0, -from}));
        ASSERT_TRUE(hit.hit);
        EXPECT_EQ(hit.t, 1);
        EXPECT_EQ(hit.normal, Vec3f(0, 0, side));
        EXPECT_EQ(hit.u, 1.0f);
        EXPECT_EQ(hit.v, 4.0f);
        const Vec3d lean = smooth ? normalize(Vec3d(0.6 * 0.25, 0.6 * 0.5, 0.25 + 0.8 * 0.75)) : Vec3d(0, 0, 1);
        for (int a = 0; a < 3; ++a) EXPECT_NEAR(hit.shading_normal[a], side * lean[a], 2e-7);
      }
    }
  // Squeezed along z, a slanted plane's normal turns the other way than its points.
  World world;
  TriangleMesh slanted = one_triangle();
  slanted.positions = {{0, 0, 0}, {1, 0, -1}, {0, 1, 0}};
  slanted.normals.assign(3, Vec3f(0.70710678f, 0, 0.70710678f));
  world.meshes.push_back(instance_of(std::move(slanted)));
  world.meshes[0].smooth = true;
  world.meshes[0].transform[2] = {0, 0, 3};
  const MeshHit hit = built(world).intersect(GridRay(WorldPoint{} + Vec3d(0.25, 0.25, 9), {0, 0, -1}));
  ASSERT_TRUE(hit.hit);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(hit.normal[a], hit.shading_normal[a], 2e-7);
}

TEST(MeshScene, NullSurfacesAndGlassLetShadowRaysPassButAreMet) {
  World world;
  world::Block wall, glass;
  wall.name = "wall", glass.name = "glass";
  glass.opaque = false;
  const BlockId wall_id = *world.palette->add(wall), glass_id = *world.palette->add(glass);
  const GridRay ray(WorldPoint{} + Vec3d(0.25, 0.25, 5), {0, 0, -1});
  struct Case {
    std::string block;
    BlockId id;
    bool null_surface, occluded;
  };
  for (const Case& c : {Case{"wall", wall_id, false, true}, Case{"glass", glass_id, false, false},
                        Case{"", world::kAir, true, false}, Case{"", world::kAir, false, true}}) {
    world.meshes.clear();
    world.meshes.push_back(instance_of(one_triangle()));
    world.meshes[0].block = c.block, world.meshes[0].block_id = c.id, world.meshes[0].null_surface = c.null_surface;
    const MeshScene scene = built(world);
    EXPECT_TRUE(scene.intersect(ray).hit);
    EXPECT_EQ(scene.occluded(ray), c.occluded) << c.block;
    // What lies behind still blocks.
    world.meshes.push_back(instance_of(one_triangle(), {{0, 0, -3}, Vec3d(0)}));
    EXPECT_TRUE(built(world).occluded(ray));
  }
}

TEST(MeshScene, AHitAtTheEndOfTheRayCountsAndOneBeyondDoesNot) {
  World world;
  world.meshes.push_back(instance_of(one_triangle()));
  const MeshScene scene = built(world);
  GridRay ray(WorldPoint{} + Vec3d(0.25, 0.25, 5), {0, 0, -2}, 2.5);
  EXPECT_TRUE(scene.intersect(ray).hit);
  EXPECT_TRUE(scene.occluded(ray));
  ray.t_max = std::nextafter(2.5, 0.0);
  EXPECT_FALSE(scene.intersect(ray).hit);
  EXPECT_FALSE(scene.occluded(ray));
}

TEST(MeshScene, RaysThatAreNoneMeetNothing) {
  World world;
  world.meshes.push_back(instance_of(one_triangle()));
  const MeshScene scene = built(world);
  const double nan = std::nan("");
  for (const Vec3d direction : {Vec3d(0), Vec3d(nan, 0, 1), Vec3d(0, 0, INFINITY), Vec3d(1e-320, 0, 0)}) {
    EXPECT_FALSE(scene.intersect(GridRay(WorldPoint{}, direction)).hit);
    EXPECT_FALSE(scene.occluded(GridRay(WorldPoint{}, direction)));
  }
  GridRay outside(WorldPoint{{world::kWorldBorder, 0, 0}, Vec3d(0)}, {-1, 0, 0});
  EXPECT_FALSE(scene.intersect(outside).hit);
}

TEST(MeshScene, AWorldWithoutMeshesCostsNothing) {
  World world;
  const MeshScene scene = built(world);
  EXPECT_TRUE(scene.empty());
  EXPECT_EQ(scene.bytes(), 0u);
  EXPECT_FALSE(scene.intersect(GridRay(WorldPoint{}, {0, 0, 1})).hit);
  EXPECT_FALSE(scene.occluded(GridRay(WorldPoint{}, {0, 0, 1})));
  world.meshes.push_back(instance_of(one_triangle()));
  EXPECT_FALSE(built(world).empty());
  EXPECT_GT(built(world).bytes(), sizeof(Vec3d) * 3);
}

TEST(MeshScene, AMeshThatReachesOutOfTheWorldIsAnErrorThatNamesIt) {
  World world;
  world.meshes.push_back(instance_of(one_triangle(), {{world::kWorldBorder - 1, 0, 0}, {0.5, 0, 0}}));
  const auto scene = MeshScene::build(world);
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().message, "s.toml:1:1: the mesh \"m\" reaches outside the world");
}

TEST(MeshScene, FloatingPointModeOfCallerAndWorkersStaysAsItWas) {
  // Embree turns on flush-to-zero and denormals-are-zero while it builds. Bits 0..5 are flags that arithmetic sets.
  const auto mode = [] { return _mm_getcsr() & ~0x3fu; };
  const unsigned before = mode();
  ASSERT_EQ(before & 0x8040u, 0u);
  Random random(6);
  World world;
  world.meshes.push_back(instance_of(soup(random, 100000)));
  const MeshScene scene = built(world);
  EXPECT_EQ(mode(), before);
  scene.intersect(GridRay(WorldPoint{}, {0, 0, 1}));
  scene.occluded(GridRay(WorldPoint{}, {0, 0, 1}));
  EXPECT_EQ(mode(), before);
  std::atomic<int> changed{0};
  world::parallel_for(size_t{1000}, [&](size_t) { changed += mode() != before; });
  EXPECT_EQ(changed.load(), 0);
}

TEST(MeshScene, HitsDoNotDependOnTheThreadThatAsks) {
  Random random(7);
  World world;
  world.meshes.push_back(instance_of(soup(random, 500)));
  const MeshScene scene = built(world);
  std::vector<GridRay> rays;
  for (int i = 0; i < 4000; ++i) rays.emplace_back(WorldPoint{} + random.in_cube(8), random.direction());
  std::vector<MeshHit> alone, together(rays.size());
  for (const GridRay& ray : rays) alone.push_back(scene.intersect(ray));
  world::parallel_for(rays.size(), [&](size_t i) { together[i] = scene.intersect(rays[i]); });
  for (size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(alone[i].hit, together[i].hit);
    EXPECT_EQ(alone[i].t, together[i].t);
    EXPECT_EQ(alone[i].triangle, together[i].triangle);
  }
}

}  // namespace
}  // namespace render
