// The light set: densities that samples really have, for every kind of light.
#include "render/trace/lights.h"

#include <cmath>
#include <map>

#include "render/shading.h"
#include "tests/render/trace/trace_worlds.h"
#include "world/meshes/mesh.h"

namespace render {
namespace {

using namespace world;

double uniform(uint64_t seed, int index) { return uniform01_double(random_bits(seed, index, 0, 0)); }
float unit(uint64_t seed, int index) { return uniform01(random_bits(seed, index, 1, 0)); }
Vec2f pair(uint64_t seed, int index) { return {unit(seed, index), unit(seed + 1000, index)}; }

MeshInstance shining_square() {
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->positions = {{0, 0, 0}, {2, 0, 0}, {2, 0, 1}, {0, 0, 1}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};  // faces down
  MeshInstance m;
  m.mesh = mesh;
  m.position = WorldPoint::from(-6, 5, -2);
  m.radiance = {4, 5, 6};
  return m;
}

/// Lights of every kind over a floor.
World lit_world() {
  World w = dark_world();
  w.environment.sun_irradiance = {2, 2, 2};
  w.environment.sky_zenith = {1, 2, 3};
  w.environment.sky_horizon = {0.5f, 0.5f, 0.5f};
  w.environment.sky_ground = {0.1f, 0.1f, 0.1f};
  fill(w, {{-9, -1, -9}, {9, -1, 9}}, add_block(w, matte("floor", {0.5f, 0.5f, 0.5f})));
  const BlockId lamp = add_block(w, matte("lamp", {0.5f, 0.5f, 0.5f}, {3, 3, 3}));
  fill(w, {{2, 0, 2}, {2, 0, 2}}, lamp);
  fill(w, {{-3, 2, 4}, {-2, 2, 4}}, lamp);
  Block torch = matte("torch_like", {0.1f, 0.1f, 0.1f}, {2, 1, 1});
  torch.opaque = false;
  torch.proxy = "torch";
  fill(w, {{4, 0, -3}, {4, 0, -3}}, add_block(w, torch));
  Luminaire l;
  l.kind = l.name = "rectangle";
  l.position = WorldPoint::from(1, 4, -2);
  l.power = {30, 30, 30};
  w.luminaires.push_back(l);
  l.kind = l.name = "sphere";
  l.radius = 0.5f;
  l.position = WorldPoint::from(-5, 3, -5);
  w.luminaires.push_back(l);
  w.meshes.push_back(shining_square());
  w.meshes.back().block_id = w.palette->find("floor").value();
  return w;
}

struct Lit {
  World world;
  WorldView view;
  TraceScene scene;
  LightSet lights;
  explicit Lit(World w)
      : world(std::move(w)), view(world), scene(std::move(*TraceScene::build(view))), lights(LightSet::build(scene)) {}
};

Receiver receiver_at(Vec3d point, Vec3f normal) { return {WorldPoint::from(point.x, point.y, point.z), normal, true}; }

/// The density with which sample() would have found what a ray meets, as the path tracer asks for it.
double density_of(Lit& lit, Tracer& tracer, const Receiver& r, const Vec3f& direction) {
  TraceRay ray;
  ray.ray = GridRay(r.position, Vec3d(direction));
  std::vector<Crossing> crossings;
  const Surface s = tracer.intersect(ray, crossings);
  if (!s.hit()) return lit.lights.pdf_sky(r, direction);
  if (s.kind == SurfaceKind::luminaire) return lit.lights.pdf_luminaire(r, s.index, s.luminaire_pdf);
  if (s.emission == Vec3f(0)) return 0;
  const double distance = glm::length(s.position() - r.position);
  return s.kind == SurfaceKind::mesh ? lit.lights.pdf_triangle(r, s.index, s.triangle, direction, distance)
                                     : lit.lights.pdf_voxel(r, s, direction, distance);
}

TEST(LightSet, ASamplesDensityIsTheOneThatItsRayIsToldOfTheSameLight) {
  Lit lit(lit_world());
  Tracer tracer(lit.scene);
  std::map<LightKind, int> seen;
  for (int i = 0; i < 20000; ++i) {
    const Receiver r = receiver_at({uniform(1, i) * 12 - 6, 0, uniform(2, i) * 12 - 6}, {0, 1, 0});
    if (tracer.block(r.position.voxel) != kAir) continue;
    LightSample sample;
    if (!lit.lights.sample(r, unit(3, i), pair(4, i), sample) || sample.pdf == 0) continue;
    TraceRay ray;
    ray.ray = GridRay(r.position, Vec3d(sample.direction));
    std::vector<Crossing> crossings;
    const Surface s = tracer.intersect(ray, crossings);
    // Of those that arrive.
    const bool arrives =
        s.hit() ? std::abs(s.t - sample.distance) < 1e-4 * sample.distance : sample.target.kind == LightKind::sky;
    if (!arrives) continue;
    const double told = density_of(lit, tracer, r, sample.direction);
    // A direction is rounded to float: of a light seen edge-on the density moves with it.
    EXPECT_NEAR(told / sample.pdf, 1, 2e-3) << static_cast<int>(sample.target.kind) << " sample " << i;
    ++seen[sample.target.kind];
  }
  for (const LightKind kind : {LightKind::sky, LightKind::luminaire, LightKind::voxel, LightKind::triangle})
    EXPECT_GT(seen[kind], 100) << static_cast<int>(kind);
}

TEST(LightSet, TheMeanOfRadianceOverDensityIsTheIrradiance) {
  // Of each kind alone, unhidden: a rectangle's and a lamp's form factor, a sky's closed form, a sphere as an omni.
  const auto irradiance = [](World w, const Receiver& r) {
    Lit lit(std::move(w));
    PixelSamples sum;
    for (int i = 0; i < 200000; ++i) {
      LightSample s;
      double e = 0;
      if (lit.lights.sample(r, unit(3, i), pair(4, i), s))
        e = s.radiance.x * std::max(0.0f, dot(s.direction, r.normal)) / (s.pdf > 0 ? s.pdf : 1);
      sum.add(Vec3d(e));
    }
    return std::pair(sum.mean[0], std::sqrt(sum.squares[0] / sum.count / sum.count));
  };
  {
    World w = dark_world();
    w.environment = lit_world().environment;
    w.environment.sun_irradiance = {};
    for (const Vec3d n : {Vec3d(0, 1, 0), Vec3d(0.6, 0, 0.8), glm::normalize(Vec3d(0.3, -0.5, 0.4))}) {
      World sky = dark_world();
      sky.environment = w.environment;
      const auto [lit, spread] = irradiance(std::move(sky), receiver_at({0.5, 0, 0.5}, Vec3f(n)));
      EXPECT_NEAR(lit, sky_irradiance(w.environment, n).r, 4 * spread + 1e-5);
    }
  }
  {
    World w = dark_world();
    fill(w, {{0, 1, 0}, {0, 1, 0}}, add_block(w, matte("lamp", {0.5f, 0.5f, 0.5f}, {3, 3, 3})));
    const auto [e, error] = irradiance(std::move(w), receiver_at({0.5, 0, 0.5}, {0, 1, 0}));
    EXPECT_NEAR(e, kTestPi * 3 * 0.23947, 4 * error + 1e-4);
  }
  {
    World w = dark_world();
    w.meshes.push_back(shining_square());
    const auto [e, error] = irradiance(std::move(w), receiver_at({-5, 4, -1.5}, {0, 1, 0}));
    // Four rectangles of 1 x 0.5 with a corner above, at height 1: form factor by Howell's catalogue, C-11... with
    // a = 1, b = 1/2: F = (a / sqrt(1 + a^2) atan(b / sqrt(1 + a^2)) + b / sqrt(1 + b^2) atan(a / sqrt(1 + b^2))) / 2
    // pi.
    const double a = 1, b = 0.5, p = std::sqrt(1 + a * a), q = std::sqrt(1 + b * b);
    const double f = 4 * (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * kTestPi);
    EXPECT_NEAR(e, kTestPi * 4 * f, 4 * error + 1e-4);
  }
}

TEST(LightSet, EveryDirectionToALampsFacesIsAsLikely) {
  // A lamp as near and as far as one may be; directions binned by where they meet the lamp's faces must fill each face
  // in proportion to its solid angle: by the mean of indicator over density, which is the solid angle.
  for (const Vec3d at : {Vec3d(2.5, 0.3, 0.4), Vec3d(1.01, 0.5, 0.5), Vec3d(3, 2.5, -1.2), Vec3d(9, 20, 5)}) {
    World w = dark_world();
    fill(w, {{0, 0, 0}, {0, 0, 0}}, add_block(w, matte("lamp", {0.5f, 0.5f, 0.5f}, {1, 1, 1})));
    Lit lit(std::move(w));
    const Receiver r{WorldPoint::from(at.x, at.y, at.z), Vec3f(0), false};
    // Moments of the lamp's light at the receiver by uniform directions over the sphere, and by samples.
    PixelSamples by_sphere, by_samples;
    Tracer tracer(lit.scene);
    std::vector<Crossing> crossings;
    constexpr int kSamples = 400000;
    for (int i = 0; i < kSamples; ++i) {
      const double y = 1 - 2 * uniform(5, i), angle = 2 * kTestPi * uniform(6, i);
      // Only a cap around the lamp, so that few are lost.
      const Vec3d axis = glm::normalize(Vec3d(0.5) - at);
      const double reach = std::min(1.0, 0.9 / glm::length(Vec3d(0.5) - at)),
                   least = reach < 1 ? std::sqrt(1 - reach * reach) : -1;
      const double z = least + (1 - least) * (y + 1) / 2, s = std::sqrt(std::max(0.0, 1 - z * z));
      Vec3d a, b;
      basis_around(axis, a, b);
      const Vec3d direction = glm::normalize(z * axis + s * (std::cos(angle) * a + std::sin(angle) * b));
      TraceRay ray;
      ray.ray = GridRay(r.position, direction);
      const Surface hit = tracer.intersect(ray, crossings);
      const double cap = 2 * kTestPi * (1 - least);
      by_sphere.add(hit.emission.x > 0 ? cap * Vec3d(1, direction.x, direction.y * direction.z) : Vec3d(0));
      LightSample sample;
      if (!lit.lights.sample(r, unit(7, i), pair(8, i), sample)) {
        by_samples.add(Vec3d(0));
        continue;
      }
      const Vec3d d(sample.direction);
      by_samples.add(Vec3d(1, d.x, d.y * d.z) / sample.pdf);
    }
    for (int b = 0; b < 3; ++b) {
      const double error = std::sqrt((by_sphere.squares[b] + by_samples.squares[b]) / kSamples / kSamples);
      EXPECT_NEAR(by_sphere.mean[b], by_samples.mean[b], 4 * error + 1e-9) << at.x << " moment " << b;
    }
  }
}

TEST(LightSet, AHundredThousandLampsAreAllFoundAndTheNearOnesMost) {
  World w = dark_world();
  const BlockId lamp = add_block(w, matte("lamp", {0.5f, 0.5f, 0.5f}, {1, 1, 1}));
  EditBatch batch;
  for (int x = 0; x < 320; ++x)
    for (int z = 0; z < 320; ++z) batch.set({2 * x, 3 + (x * 7 + z * 13) % 5, 2 * z}, lamp);
  ASSERT_TRUE(w.store.apply(batch).ok());
  Lit lit(std::move(w));
  EXPECT_EQ(lit.lights.voxel_count(), 102400u);
  EXPECT_LT(lit.lights.bytes(), 102400u * 300);
  const Receiver r = receiver_at({320.5, 0, 320.5}, {0, 1, 0});
  // The sum over all lamps by samples of the tree, against samples of all lamps alike.
  PixelSamples by_tree;
  int near = 0;
  for (int i = 0; i < 200000; ++i) {
    LightSample s;
    if (!lit.lights.sample(r, unit(3, i), pair(4, i), s)) {
      by_tree.add(Vec3d(0));
      continue;
    }
    near += s.distance < 20;
    by_tree.add(Vec3d(s.radiance.x * std::max(0.0f, s.direction.y) / s.pdf));
  }
  double all = 0;
  for (int x = 0; x < 320; ++x)
    for (int z = 0; z < 320; ++z) {
      // Of each face that shows, seen from afar: cos cos / d^2 at its middle; of near lamps by 8 x 8 patches.
      for (int face = 0; face < kFaces; ++face) {
        const int axis = face_axis(face);
        Vec3d corner(2 * x, 3 + (x * 7 + z * 13) % 5, 2 * z), n(0);
        n[axis] = face_sign(face);
        if (face_sign(face) > 0) corner[axis] += 1;
        const bool close = glm::length(corner - Vec3d(320.5, 0, 320.5)) < 30;
        const int patches = close ? 8 : 1;
        for (int k = 0; k < patches * patches; ++k) {
          Vec3d p = corner;
          p[(axis + 1) % 3] += (k / patches + 0.5) / patches, p[(axis + 2) % 3] += (k % patches + 0.5) / patches;
          const Vec3d to = p - Vec3d(320.5, 0, 320.5);
          const double d = glm::length(to), cosine = -dot(n, to) / d;
          if (cosine > 0) all += cosine * (to.y / d) / (d * d) / (patches * patches);
        }
      }
    }
  const double error = std::sqrt(by_tree.squares[0] / by_tree.count / by_tree.count);
  EXPECT_NEAR(by_tree.mean[0], all, 4 * error + 0.002 * all);
  EXPECT_LT(error / all, 0.01);
  EXPECT_GT(near, 20000);  // 314 of 102400 lamps lie so near: 613 if all were as likely
}

TEST(LightSet, OfNoLightNothingIsSampled) {
  Lit lit(dark_world());
  LightSample sample;
  EXPECT_TRUE(lit.lights.empty());
  EXPECT_EQ(lit.lights.bytes(), 0u);
  EXPECT_FALSE(lit.lights.sample(receiver_at({0, 0, 0}, {0, 1, 0}), 0.5f, {0.5f, 0.5f}, sample));
}

TEST(LightSet, PhotonsCarryThePowerOfAllLights) {
  World w = lit_world();
  w.environment.sun_irradiance = {};
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};
  const WorldView view(w);
  const auto scene = TraceScene::build(view);
  ASSERT_TRUE(scene.ok());
  const LightSet lights = LightSet::build(*scene, true);
  // Faces that show: five of the lamp on the floor, ten of the two beside each other; a torch of radiance 2 if it were
  // a cube; two luminaires; 2 m^2 of mesh.
  const double torch = 2 * 6 * kTestPi;
  const double expected = kTestPi * 3 * 15 + torch + 60 + kTestPi * 4 * 2;
  PixelSamples power;
  for (int i = 0; i < 200000; ++i) {
    const float u[5] = {unit(1, i), unit(2, i), unit(3, i), unit(4, i), unit(5, i)};
    LightPhoton photon;
    power.add(lights.emit(u, photon) ? photon.power : Vec3d(0));
    EXPECT_NEAR(glm::length(photon.direction), 1, 1e-5);
  }
  EXPECT_NEAR(power.mean[0] / expected, 1, 4 * std::sqrt(power.squares[0]) / power.count / expected + 1e-4);
}

}  // namespace
}  // namespace render
