// What rays meet: whose face a change of block shows, where the next ray starts, null surfaces, luminaires.
#include "render/trace/geometry.h"

#include <set>

#include "render/knobs.h"
#include "tests/render/trace/trace_worlds.h"

namespace render {
namespace {

using namespace world;

struct Traced {
  World world;
  WorldView view;
  TraceScene scene;
  Tracer tracer;
  std::vector<Crossing> crossings;
  explicit Traced(World w)
      : world(std::move(w)), view(world), scene(std::move(*TraceScene::build(view))), tracer(scene) {}

  Surface meet(Vec3d start, Vec3d direction) {
    TraceRay ray;
    ray.ray = GridRay(WorldPoint::from(start.x, start.y, start.z), glm::normalize(direction));
    return tracer.intersect(ray, crossings);
  }
};

BlockId clear_block(World& w, const std::string& name, float index) {
  Block b = matte(name, {0.5f, 0.5f, 0.5f});
  b.bsdf = "dielectric";
  b.opaque = false;
  b.index_of_refraction = index;
  return add_block(w, b);
}

TEST(Surfaces, EachChangeOfBlockShowsOneFaceOfOneBlock) {
  // Along x: stone, air, glass, water, stone, glass, leaf-like, air; one voxel each.
  World w = dark_world();
  const BlockId stone = add_block(w, matte("test_stone", {0.5f, 0.5f, 0.5f})), glass = clear_block(w, "clear_a", 1.5f),
                water = clear_block(w, "clear_b", 1.33f);
  Block leaf = matte("leaf_like", {0.5f, 0.5f, 0.5f});
  leaf.opaque = false;
  const BlockId leaves = add_block(w, leaf);
  const BlockId row[8] = {stone, kAir, glass, water, stone, glass, leaves, kAir};
  for (int x = 0; x < 8; ++x) fill(w, {{x, 0, 0}, {x, 0, 0}}, row[x]);
  Traced t(std::move(w));
  const auto expect = [&](double x, double direction, double t_hit, BlockId block, bool inside, float eta) {
    const Surface s = t.meet({x, 0.5, 0.5}, {direction, 0, 0});
    ASSERT_EQ(s.kind, SurfaceKind::voxel) << x;
    EXPECT_NEAR(s.t, t_hit, 1e-12) << x;
    EXPECT_EQ(s.block, block) << x;
    EXPECT_EQ(s.inside, inside) << x;
    if (eta > 0) {
      EXPECT_NEAR(s.parameters.eta, eta, 1e-5) << x;
    }
    EXPECT_EQ(s.normal, Vec3f(-direction, 0, 0)) << x;
  };
  const float air = 1.00029f;
  expect(1.5, -1, 0.5, stone, false, 0);
  expect(1.5, 1, 0.5, glass, false, 1.5f / air);    // into glass
  expect(2.5, -1, 0.5, glass, true, air / 1.5f);    // out of it
  expect(2.5, 1, 0.5, water, false, 1.33f / 1.5f);  // the face is water's, whose id is larger, seen from glass
  expect(3.5, -1, 0.5, water, true, 1.5f / 1.33f);  // the same face from within
  expect(3.5, 1, 0.5, stone, false, 0);
  expect(5.5, 1, 0.5, leaves, false, 0);  // lets no light through: its face, though glass has the smaller id
  // From within blocks that let no light through rays leave unseen: stone, then glass up to its own end.
  expect(4.5, 1, 1.5, leaves, false, 0);
  EXPECT_FALSE(t.meet({6.5, 0.5, 0.5}, {1, 0, 0}).hit());
}

TEST(Surfaces, GlossHasTheLobeThatTheSceneWasBuiltWith) {
  World w = dark_world();
  Block b = matte("plastic", {0.3f, 0.3f, 0.3f});
  b.bsdf = "blinn_phong";
  b.glossy = {0.04f, 0.04f, 0.04f};
  const BlockId plastic = add_block(w, b);
  const WorldView view(w);
  for (const uint32_t gloss : {shared::kGlossExact, shared::kGlossPublished, shared::kGlossFresnel}) {
    const auto scene = TraceScene::build(view, gloss);
    ASSERT_TRUE(scene.ok());
    EXPECT_EQ(scene->materials()[plastic].outside.gloss, gloss);
    EXPECT_EQ(scene->parameters(plastic, 1.33f, false).gloss, gloss);
  }
  EXPECT_EQ(static_cast<uint32_t>(GlossLobe::exact), shared::kGlossExact);
  EXPECT_EQ(static_cast<uint32_t>(GlossLobe::published), shared::kGlossPublished);
  EXPECT_EQ(static_cast<uint32_t>(GlossLobe::fresnel), shared::kGlossFresnel);
}

TEST(Surfaces, TheSameBlockIsOneBody) {
  World w = dark_world();
  fill(w, {{0, 0, 0}, {99, 3, 3}}, clear_block(w, "clear_a", 1.5f));
  Traced t(std::move(w));
  EXPECT_NEAR(t.meet({0.25, 1.5, 1.5}, {1, 0, 0}).t, 99.75, 1e-12);
  EXPECT_NEAR(t.meet({-1, 1.5, 1.5}, {1, 0, 0}).t, 1, 1e-12);
}

TEST(Surfaces, TheNextRayStartsOnTheFaceInTheVoxelThatItEnters) {
  for (const VoxelPos at : {VoxelPos{0, 0, 0}, VoxelPos{1000000000, -5000000, 77}}) {
    World w = dark_world();
    const BlockId glass = clear_block(w, "clear_a", 1.5f);
    fill(w, {at, at + VoxelPos{3, 3, 3}}, glass);
    Traced t(std::move(w));
    for (int i = 0; i < 3000; ++i) {
      const auto u = [&](int k) { return uniform01_double(random_bits(9, i, k, 0)); };
      TraceRay ray;
      ray.ray.voxel = at + VoxelPos{-3, 1, 1};
      ray.ray.fraction = {u(0), u(1), u(2)};
      ray.ray.direction = glm::normalize(Vec3d(1, u(3) - 0.5, u(4) - 0.5));
      const Surface s = t.tracer.intersect(ray, t.crossings);
      if (!s.hit()) continue;
      const int axis = face_axis(s.face);
      for (const float side : {1.0f, -1.0f}) {
        const Vec3f direction =
            glm::normalize(Vec3f(s.normal) * side + Vec3f(0.1f, 0.2f, -0.15f) * (1.0f - abs(s.normal)));
        const TraceRay next = s.spawn(direction);
        EXPECT_EQ(t.tracer.block(next.ray.voxel), side > 0 ? kAir : glass);
        EXPECT_TRUE(next.ray.fraction[axis] == 0 || next.ray.fraction[axis] == 1);
        // It doesn't meet the face that it starts on.
        const Surface after = t.tracer.intersect(next, t.crossings);
        if (side > 0) {
          EXPECT_FALSE(after.hit());
        }
        if (side < 0) {
          EXPECT_TRUE(after.hit() && after.inside && after.t > 0);
        }
      }
    }
  }
}

std::shared_ptr<TriangleMesh> box_mesh(Vec3f half) {
  auto mesh = std::make_shared<TriangleMesh>();
  for (int i = 0; i < 8; ++i) mesh->positions.push_back(half * Vec3f(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  for (const auto& q : {std::array{0u, 4u, 6u, 2u},
                        {1u, 3u, 7u, 5u},
                        {0u, 1u, 5u, 4u},
                        {2u, 6u, 7u, 3u},
                        {0u, 2u, 3u, 1u},
                        {4u, 5u, 7u, 6u}}) {
    mesh->triangles.push_back({q[0], q[1], q[2]});
    mesh->triangles.push_back({q[0], q[2], q[3]});
  }
  return mesh;
}

World with_nested_boxes() {
  World w = dark_world();
  Medium m;
  m.kind = "homogeneous";
  m.name = "haze";
  m.scattering = {1, 1, 1};
  w.media.push_back(m);
  m.name = "smoke";
  w.media.push_back(m);
  for (const auto& [half, medium] : {std::pair(4.0f, "haze"), {2.0f, "smoke"}}) {
    MeshInstance box;
    box.mesh = box_mesh(Vec3f(half));
    box.null_surface = true;
    box.interior_medium = medium;
    box.position = WorldPoint::from(0.5, 0.5, 0.5);
    w.meshes.push_back(box);
  }
  fill(w, {{20, -20, -20}, {20, 20, 20}}, add_block(w, matte("wall", {0.5f, 0.5f, 0.5f})));
  return w;
}

TEST(NullSurfaces, AreCrossedAndNamedInOrder) {
  Traced t(with_nested_boxes());
  const Surface s = t.meet({-9.5, 0.5, 0.5}, {1, 0, 0});
  EXPECT_EQ(s.kind, SurfaceKind::voxel);
  EXPECT_NEAR(s.t, 29.5, 1e-9);
  ASSERT_EQ(t.crossings.size(), 4u);
  const double where[4] = {6, 8, 12, 14};
  const uint32_t which[4] = {0, 1, 1, 0};
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(t.crossings[i].t, where[i], 1e-9);
    EXPECT_EQ(t.crossings[i].instance, which[i]);
    EXPECT_EQ(t.crossings[i].enters, i < 2);
  }
  EXPECT_EQ(s.around.count(), 0);
}

TEST(NullSurfaces, APointKnowsTheMeshesAroundIt) {
  Traced t(with_nested_boxes());
  EXPECT_EQ(t.tracer.around(WorldPoint::from(9, 0, 0)).count(), 0);
  EXPECT_EQ(t.tracer.around(WorldPoint::from(3, 0, 0)).count(), 1);
  EXPECT_EQ(t.tracer.around(WorldPoint::from(1, 0, 0)).count(), 2);
}

TEST(NullSurfaces, OfAMediumWithoutStrengthDontChangeABit) {
  // Hard case X1 for meshes: the voxels behind are met at the same bits of t.
  World with = with_nested_boxes(), without = with_nested_boxes();
  for (Medium& m : with.media) m.scattering = {};
  without.meshes.clear();
  without.media.clear();
  Traced a(std::move(with)), b(std::move(without));
  for (int i = 0; i < 1000; ++i) {
    const auto u = [&](int k) { return uniform01_double(random_bits(11, i, k, 0)); };
    const Vec3d direction(1, u(0) - 0.5, u(1) - 0.5);
    const Surface x = a.meet({-9.3, 0.4, 0.6}, direction), y = b.meet({-9.3, 0.4, 0.6}, direction);
    EXPECT_EQ(x.t, y.t);
    EXPECT_EQ(x.point, y.point);
    EXPECT_TRUE(a.crossings.empty());
  }
}

TEST(Luminaires, EndARayAtTheirEmittingSideOnly) {
  World w = dark_world();
  Luminaire l;
  l.kind = l.name = "rectangle";
  l.position = WorldPoint::from(0.5, 3, 0.5);  // shines down
  l.extent = {2, 2};
  l.power = {1, 1, 1};
  w.luminaires.push_back(l);
  Traced t(std::move(w));
  const Surface below = t.meet({0.5, 0.5, 0.5}, {0, 1, 0});
  EXPECT_EQ(below.kind, SurfaceKind::luminaire);
  EXPECT_NEAR(below.t, 2.5, 1e-6);
  EXPECT_NEAR(below.emission.x, 1 / (kTestPi * 4), 1e-6);
  EXPECT_FALSE(t.meet({0.5, 5.5, 0.5}, {0, -1, 0}).hit());
}

TEST(Luminaires, AmongManyTheNearestIsMetAsALoopOverAllFindsIt) {
  // Far from the origin, and of each kind that has an area.
  World w = dark_world();
  const VoxelPos far{100000000, -20000000, 3};
  const auto u = [](int i, int k) { return uniform01_double(random_bits(14, i, k, 0)); };
  for (int i = 0; i < 500; ++i) {
    Luminaire l;
    l.kind = l.name = i % 3 == 0 ? "rectangle" : i % 3 == 1 ? "disk" : "sphere";
    l.position = WorldPoint::from(40 * u(i, 0), 40 * u(i, 1), 40 * u(i, 2));
    l.position.voxel = l.position.voxel + far;
    l.axis = Vec3f(glm::normalize(Vec3d(u(i, 3), u(i, 4), u(i, 5)) - 0.5));
    l.up = Vec3f(glm::normalize(cross(Vec3d(l.axis), Vec3d(0.3, 0.2, 0.9))));
    l.radius = static_cast<float>(0.1 + u(i, 6));
    l.extent = {static_cast<float>(0.1 + 3 * u(i, 6)), 1};
    l.power = {1, 2, 3};
    w.luminaires.push_back(l);
  }
  Traced t(std::move(w));
  int met = 0;
  for (int i = 0; i < 3000; ++i) {
    TraceRay ray;
    WorldPoint start = WorldPoint::from(40 * u(i, 7), 40 * u(i, 8), 40 * u(i, 9));
    start.voxel = start.voxel + far;
    ray.ray = GridRay(start, glm::normalize(Vec3d(u(i, 10), u(i, 11), u(i, 12)) - 0.5));
    if (i % 5 == 0) ray.ray.t_max = 3;
    uint32_t expected = UINT32_MAX;
    double nearest = ray.ray.t_max / (1 - kLuminaireTolerance);
    for (uint32_t k = 0; k < t.scene.luminaires().size(); ++k) {
      const auto hit = t.scene.luminaires()[k].sampler.meet(start - t.scene.luminaires()[k].luminaire->position,
                                                            Vec3f(ray.ray.direction));
      if (hit && hit->distance < nearest) nearest = hit->distance, expected = k;
    }
    const Surface s = t.tracer.intersect(ray, t.crossings);
    ASSERT_EQ(s.kind == SurfaceKind::luminaire ? s.index : UINT32_MAX, expected) << i;
    if (expected == UINT32_MAX) continue;
    ++met;
    EXPECT_EQ(s.t, std::min(nearest, ray.ray.t_max)) << i;
    // Without it, the next behind.
    const Surface behind = t.tracer.intersect(ray, t.crossings, true, expected);
    EXPECT_TRUE(behind.kind != SurfaceKind::luminaire || (behind.index != expected && behind.t >= s.t)) << i;
  }
  EXPECT_GT(met, 150);
}

TEST(Luminaires, OnAFaceLieBeforeIt) {
  World w = dark_world();
  fill(w, {{-4, 3, -4}, {4, 3, 4}}, add_block(w, matte("ceiling", {0.5f, 0.5f, 0.5f})));
  Luminaire l;
  l.kind = l.name = "rectangle";
  l.position = WorldPoint::from(0.5, 3, 0.5);  // in the plane of the ceiling's face
  l.power = {1, 1, 1};
  w.luminaires.push_back(l);
  Traced t(std::move(w));
  for (int i = 0; i < 1000; ++i) {
    const auto u = [&](int k) { return uniform01_double(random_bits(13, i, k, 0)); };
    const Vec3d start(4 * u(0) - 2, 0.3, 4 * u(1) - 2), target(u(2) * 0.98 + 0.01, 3, u(3) * 0.98 + 0.01);
    EXPECT_EQ(t.meet(start, target - start).kind, SurfaceKind::luminaire) << i;
  }
}

TEST(Scenes, AMediumThatAMeshNamesMustExist) {
  World w = with_nested_boxes();
  w.meshes[0].interior_medium = "mist";
  w.meshes[0].where = "a.toml:3:1";
  const WorldView view(w);
  const auto scene = TraceScene::build(view);
  ASSERT_FALSE(scene.ok());
  EXPECT_NE(scene.error().message.find("a.toml:3:1: interior_medium \"mist\""), std::string::npos);
}

}  // namespace
}  // namespace render
