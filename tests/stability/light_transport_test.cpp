// Hard cases B14, B15, S5, S6, S7 and L17: light from lamps near, inside and between voxels, and samples that are no
// numbers. X1 and X2 of light are in tests/render/trace/transport_test.cpp.
#include <cmath>

#include "tests/render/trace/trace_worlds.h"
#include "render/trace/lights.h"

namespace render {
namespace {

using namespace world;

double uniform(uint64_t seed, int index) { return uniform01_double(random_bits(seed, index, 0, 0)); }

Luminaire omni(Vec3d position, float power) {
  Luminaire l;
  l.kind = l.name = "omni";
  l.position = WorldPoint::from(position.x, position.y, position.z);
  l.power = {power, power, power};
  l.radius = 0.01f;
  return l;
}

// Where a wall meets a lamp's face, 1/r^2 grows without bound; what one sample adds must not.
TEST(HardCaseB14, NoSampleBesideALampExceedsPiTimesItsRadiance) {
  World w = dark_world();
  const BlockId wall = add_block(w, matte("wall", {0.999f, 0.999f, 0.999f})),
                lamp = add_block(w, matte("lamp", {0.001f, 0.001f, 0.001f}, {1, 1, 1}));
  fill(w, {{-5, -1, -5}, {5, -1, 5}}, wall);
  fill(w, {{0, 0, 0}, {0, 0, 0}}, lamp);
  RenderKnobs knobs = sampled(1);
  knobs.max_depth = 1;
  // The floor within 0.1 m of the lamp's side; one sample a pixel, so pixels are samples.
  const Frame f = trace(w, looking({1.05, 0.5, 0.5}, {1.05, 0, 0.50001}, 12), knobs, 200, 200);
  double most = 0, mean = 0;
  for (const Rgb& p : f.image.pixels) {
    ASSERT_TRUE(std::isfinite(p.g));
    most = std::max<double>(most, p.g);
    mean += p.g / 40000;
  }
  // A pixel is the lamp sampled from the light, at most pi L albedo / pi, and, found by the path, as much again.
  EXPECT_LE(most, 2 + 1e-3);
  EXPECT_GT(mean, 0.3);
  EXPECT_LT(mean, 0.55);  // half of the hemisphere is the lamp where it touches: at most 1/2
}

TEST(HardCaseB15, ASampleThatIsNotFiniteIsCountedAndLeftOut) {
  Film film(2, 1);
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 1000000; ++i)
    film.at(0, 0).add(i == 499999 ? Vec3d(1, nan, 1) : i == 500000 ? Vec3d(-inf, 1, 1) : Vec3d(1, 2, 3));
  film.at(1, 0).add(Vec3d(inf));
  EXPECT_EQ(film.rejected(), 3u);
  const Image image = film.mean();
  EXPECT_EQ(image.at(0, 0), (Rgb{1, 2, 3}));
  EXPECT_EQ(image.at(1, 0), (Rgb{0, 0, 0}));
}

TEST(HardCaseS5, APointLightInASolidVoxelIsDarkAndAnEmittingVoxelShinesByItsFaces) {
  World w = dark_world();
  const BlockId stone = add_block(w, matte("test_stone", {0.5f, 0.5f, 0.5f}));
  fill(w, {{-5, -1, -5}, {5, -1, 5}}, stone);
  fill(w, {{0, 2, 0}, {0, 2, 0}}, stone);
  w.luminaires.push_back(omni({0.5, 2.5, 0.5}, 1000));
  const Camera camera = looking({3, 3, 4}, {0.5, 1, 0.5}, 60);
  for (const LightTransport transport : {LightTransport::direct, LightTransport::path, LightTransport::photons}) {
    RenderKnobs knobs = sampled(4);
    knobs.light_transport = transport;
    knobs.photons = 1000;
    for (const Rgb& p : trace(w, camera, knobs, 16, 16).image.pixels) ASSERT_EQ(p, (Rgb{0, 0, 0}));
  }
  w.luminaires.clear();
  fill(w, {{0, 2, 0}, {0, 2, 0}}, add_block(w, matte("lamp", {0.5f, 0.5f, 0.5f}, {3, 3, 3})));
  RenderKnobs knobs = sampled(16);
  EXPECT_GT(mean_of(trace(w, camera, knobs, 16, 16).image).mean[0], 0.05);
}

// A shadow ray ends on its lamp's face: only other voxels may block it, at any distance from the origin.
TEST(HardCaseS6, ShadowRaysAreBlockedByOtherVoxelsOnly) {
  for (const VoxelPos at : {VoxelPos{0, 0, 0}, VoxelPos{100000, 5000, -100000}, VoxelPos{1000000000, 7, -1000000000}}) {
    World w = dark_world();
    const BlockId lamp = add_block(w, matte("lamp", {0.5f, 0.5f, 0.5f}, {1, 1, 1}));
    fill(w, {at, at}, lamp);
    fill(w, {at + VoxelPos{-20, -10, -20}, at + VoxelPos{20, -10, 20}},
         add_block(w, matte("floor", {0.5f, 0.5f, 0.5f})));
    const WorldView view(w);
    auto scene = TraceScene::build(view);
    ASSERT_TRUE(scene.ok());
    const LightSet lights = LightSet::build(*scene);
    const TransportScene shared{&*scene, &lights, sampled(1)};
    Transport transport(shared);
    int blocked = 0, sampled_lights = 0;
    for (int i = 0; i < 100000; ++i) {
      Receiver r;
      r.position.voxel =
          at + VoxelPos{static_cast<int>(uniform(1, i) * 40) - 20, -9, static_cast<int>(uniform(2, i) * 40) - 20};
      r.position.fraction = {uniform(3, i), 0, uniform(4, i)};
      r.normal = {0, 1, 0};
      r.one_sided = true;
      LightSample sample;
      const Vec2f u(static_cast<float>(uniform(5, i) * 0.999999), static_cast<float>(uniform(6, i) * 0.999999));
      if (!lights.sample(r, static_cast<float>(uniform(7, i) * 0.999999), u, sample)) continue;
      ++sampled_lights;
      TraceRay ray;
      ray.ray = GridRay(r.position, Vec3d(sample.direction));
      blocked += transport.arrival(ray, sample).value == Vec3d(0);
    }
    EXPECT_EQ(sampled_lights, 100000);
    // A point within a float's rounding of the face's border may be seen on the face beside it.
    EXPECT_LE(blocked, 2) << at.x;
  }
}

TEST(HardCaseS7, NoLightPassesBetweenTwoVoxelsThatTouchAtAnEdge) {
  // Two walls that meet only in a diagonal of edges; all light is behind.
  World w = dark_world();
  const BlockId stone = add_block(w, matte("test_stone", {0.5f, 0.5f, 0.5f}));
  fill_walls(w, {{0, 0, 0}, {9, 9, 9}}, stone);
  for (int i = 0; i < 10; ++i) fill(w, {{i, 0, 9 - i}, {i, 9, 9 - i}}, stone);
  w.luminaires.push_back(omni({1, 5, 1}, 1e6f));
  w.luminaires.push_back(omni({4.5, 4.5, 4.5}, 1e6f));  // on a corner's diagonal
  RenderKnobs knobs = sampled(16);
  for (const Rgb& p : trace(w, looking({8.5, 5, 8.5}, {4.5, 5, 4.5}, 90), knobs, 64, 64).image.pixels)
    ASSERT_EQ(p, (Rgb{0, 0, 0}));
}

// 10,000 lights of 1 W and one of 10^8 W, far away: the dim ones' light isn't lost in the sum.
TEST(HardCaseL17, DimLightsAreNotLostBesideAHugeOne) {
  World w = dark_world();
  fill(w, {{-5, -1, -5}, {5, -1, 5}}, add_block(w, matte("floor", {0.5f, 0.5f, 0.5f})));
  for (int i = 0; i < 10000; ++i) {
    Luminaire l = omni({(i % 100) * 0.1 - 5, 2 + (i / 100) * 0.01, (i / 100) * 0.1 - 5}, 1);
    l.power = {1, 0, 0};
    w.luminaires.push_back(l);
  }
  Luminaire huge = omni({0, 10, 0}, 0);
  huge.power = {1e8f, 1e8f, 1e8f};
  w.luminaires.push_back(huge);
  double dim = 0;
  const auto irradiance = [](const Luminaire& l) {
    const Vec3d to = l.position - WorldPoint::from(0.5, 0, 0.5);
    const double d = glm::length(to);
    return double{l.power.r} * (to.y / d) / (4 * kTestPi * d * d);
  };
  for (size_t i = 0; i < 10000; ++i) dim += irradiance(w.luminaires[i]);
  const double all = dim + irradiance(huge);
  RenderKnobs knobs;
  knobs.spp = 2;
  knobs.light_transport = LightTransport::direct;
  const Image image = trace(w, looking({0.5, 1, 1.5}, {0.5, 0, 0.5}, 0.001), knobs, 1, 1).image;
  // The bands differ by the dim part alone; a float's ulp of the sum is 0.001 W/(m^2 sr).
  EXPECT_NEAR(image.at(0, 0).r, all * 0.5 / kTestPi, 2e-7 * all);
  EXPECT_NEAR(double{image.at(0, 0).r} - image.at(0, 0).g, dim * 0.5 / kTestPi,
              1e-3 * dim * 0.5 / kTestPi + 1e-7 * all);
}

}  // namespace
}  // namespace render
