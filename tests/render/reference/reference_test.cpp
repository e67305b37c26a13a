// The reference against closed forms, and against itself.
#include "render/reference/reference.h"

#include <array>
#include <cstring>
#include <filesystem>

#include "tests/render/trace/trace_worlds.h"
#include "tests/support.h"
#include "world/base/jobs.h"

namespace render {
namespace {

using namespace world;

/// A closed box whose walls shine with `emitted` and scatter `albedo` of what they get.
World furnace(Ratio3 albedo, Radiance3 emitted) {
  World w = dark_world();
  fill_walls(w, {{0, 0, 0}, {5, 3, 4}}, add_block(w, matte("furnace_wall", albedo, emitted)));
  return w;
}

TEST(Reference, AFurnaceShinesWithEmissionOverOneLessAlbedo) {
  const World w = furnace({0.5f, 0.2f, 0.8f}, {1, 2, 0.5f});
  const Frame f = trace(w, looking({2.3, 1.7, 2.1}, {5, 1, 4}, 90), sampled(64), 24, 24);
  expect_mean(f.image, {2, 2.5, 2.5}, "furnace");
  EXPECT_EQ(f.report.nan_samples, 0u);
  EXPECT_GT(work(f.report, "block_light"), 0u);
}

/// The same of triangles: a box of 12 that face inwards, askew, whose emission and scattering make 1 together.
World mesh_furnace(double mirror) {
  World w = dark_world();
  auto mesh = std::make_shared<TriangleMesh>();
  for (unsigned i = 0; i < 8; ++i) mesh->positions.push_back(Vec3f(i & 1, i >> 1 & 1, i >> 2) - 0.5f);
  for (const auto& [a, b, c, d] : {std::array{0u, 2u, 6u, 4u},
                                   {1u, 5u, 7u, 3u},
                                   {0u, 4u, 5u, 1u},
                                   {2u, 3u, 7u, 6u},
                                   {0u, 1u, 3u, 2u},
                                   {4u, 6u, 7u, 5u}}) {
    // Seen from within, counter-clockwise.
    mesh->triangles.push_back({a, b, c});
    mesh->triangles.push_back({a, c, d});
  }
  MeshInstance m;
  m.name = "furnace";
  m.mesh = mesh;
  m.block_id = add_block(w, matte("furnace_wall", {0.5f, 0.2f, 0.8f}));
  m.radiance = {0.5f, 0.8f, 0.2f};
  const double c = std::cos(0.4), d = std::sin(0.4);
  m.transform = glm::dmat3(Vec3d(c, d, 0), Vec3d(-d, c, 0), Vec3d(0, 0, 1)) *
                glm::dmat3(Vec3d(6 * mirror, 0, 0), Vec3d(0, 4, 0), Vec3d(0, 0, 5));
  m.position = WorldPoint::from(2, 2, 2);
  w.meshes.push_back(m);
  return w;
}

TEST(Reference, AWhiteFurnaceOfTrianglesShinesWithOneMirroredToo) {
  for (const double mirror : {1.0, -1.0}) {
    const World w = mesh_furnace(mirror);
    const Frame f = trace(w, looking({2.3, 1.7, 2.1}, {5, 1, 4}, 90), sampled(256), 32, 32);
    expect_mean(f.image, {1, 1, 1}, mirror > 0 ? "furnace of triangles" : "mirrored");
    double squares = 0;
    for (const Rgb& p : f.image.pixels)
      for (const float v : {p.r, p.g, p.b}) squares += (v - 1) * (v - 1) / 3;
    const double error = std::sqrt(squares / (32 * 32));
    EXPECT_LT(error, 0.05);
    EXPECT_NEAR(error / f.report.relative_error, 1, 0.1) << mirror;  // of 3072 values: 1.3 % at 1 sigma
    EXPECT_EQ(f.report.nan_samples, 0u);
    EXPECT_GT(work(f.report, "meshes"), 0u);
  }
}

TEST(Reference, AFurnaceFarFromTheOriginIsTheSamePicture) {
  const VoxelPos far{1000000000, -700000000, 300000000};
  World w = dark_world(), moved = dark_world();
  const Block wall = matte("furnace_wall", {0.5f, 0.2f, 0.8f}, {1, 2, 0.5f});
  fill_walls(w, {{0, 0, 0}, {5, 3, 4}}, add_block(w, wall));
  fill_walls(moved, {far, far + VoxelPos{5, 3, 4}}, add_block(moved, wall));
  Camera camera = looking({2.3, 1.7, 2.1}, {5, 1, 4}, 90);
  const Image here = trace(w, camera, sampled(4), 8, 8).image;
  camera.position.voxel = camera.position.voxel + far;
  EXPECT_TRUE(same_bits(here, trace(moved, camera, sampled(4), 8, 8).image));
}

TEST(Reference, InALightFromAllSidesMirrorsAndGlassVanish) {
  for (const char* bsdf : {"mirror", "dielectric", "lambert"}) {
    World w = dark_world();
    set_sky(w, 1);
    Block b = matte("thing", {0.999f, 0.999f, 0.999f});
    b.bsdf = bsdf;
    b.opaque = std::string(bsdf) != "dielectric";
    b.index_of_refraction = 1.5f;
    fill(w, {{0, 0, 0}, {2, 3, 1}}, add_block(w, b));
    const Image image = trace(w, looking({5, 4.3, 6}, {1.5, 2, 1}, 45), sampled(32), 24, 24).image;
    if (!std::strcmp(bsdf, "lambert")) {
      expect_mean(image, {1, 1, 1}, bsdf, 1e-3);  // its albedo
      continue;
    }
    // Not one sample differs: impulses of glass sum to 1, a mirror's albedo takes 0.001 at each of few events.
    for (const Rgb& p : image.pixels) EXPECT_NEAR(p.g, 1, std::strcmp(bsdf, "mirror") ? 1e-4 : 0.003) << bsdf;
  }
}

constexpr double kFormFactorOfUnitSquareAtHeightOne = 0.23947;  // hard case L5

TEST(Reference, AFaceOfALampLightsTheFloorBelowByItsFormFactor) {
  World w = dark_world();
  fill(w, {{-20, -1, -20}, {20, -1, 20}}, add_block(w, matte("floor", {0.5f, 0.25f, 0.75f})));
  fill(w, {{0, 1, 0}, {0, 1, 0}}, add_block(w, matte("lamp", {0.5f, 0.5f, 0.5f}, {10, 20, 30})));
  RenderKnobs knobs = sampled(256);
  knobs.max_depth = 1;
  // A narrow look at the point of the floor below the middle of the lamp: from aside, under it.
  const Frame f = trace(w, looking({2.5, 0.9, 0.5}, {0.5, 0, 0.5}, 0.05), knobs, 8, 8);
  const double k = kFormFactorOfUnitSquareAtHeightOne;
  expect_mean(f.image, {5 * k, 5 * k, 22.5 * k}, "voxel lamp", 1e-4);
}

Luminaire luminaire(const std::string& kind, Vec3d position) {
  Luminaire l;
  l.kind = kind;
  l.name = kind;
  l.position = WorldPoint::from(position.x, position.y, position.z);
  return l;
}

TEST(Reference, ARectangleOverAParallelPlaneLightsItByItsFormFactor) {
  World w = dark_world();
  fill(w, {{-20, -1, -20}, {20, -1, 20}}, add_block(w, matte("floor", {0.5f, 0.25f, 0.75f})));
  Luminaire l = luminaire("rectangle", {0.5, 1, 0.5});
  const float pi = static_cast<float>(kTestPi);
  l.power = {10 * pi, 20 * pi, 30 * pi};  // of 1 m^2: radiance 10, 20, 30
  w.luminaires.push_back(l);
  RenderKnobs knobs = sampled(256);
  knobs.max_depth = 1;
  const Frame f = trace(w, looking({2.5, 0.9, 0.5}, {0.5, 0, 0.5}, 0.05), knobs, 8, 8);
  const double k = kFormFactorOfUnitSquareAtHeightOne;
  expect_mean(f.image, {5 * k, 5 * k, 22.5 * k}, "rectangle", 1e-4);
  EXPECT_GT(work(f.report, "luminaires"), 0u);
}

TEST(Reference, ASphereAboveTheHorizonLightsAsAnOmniOfItsPowerDoes) {
  const auto lit = [](const std::string& kind) {
    World w = dark_world();
    fill(w, {{-20, -1, -20}, {20, -1, 20}}, add_block(w, matte("floor", {0.5f, 0.5f, 0.5f})));
    Luminaire l = luminaire(kind, {0.5, 3, 0.5});
    l.radius = kind == "sphere" ? 1.5f : 0.001f;
    l.power = {1000, 500, 250};
    w.luminaires.push_back(l);
    RenderKnobs knobs = sampled(256);
    knobs.max_depth = 1;
    return trace(w, looking({4.5, 0.9, 0.5}, {2.5, 0, 0.5}, 0.05), knobs, 8, 8).image;
  };
  // E = Phi cos / (4 pi d^2), with d^2 = 9 + 4.
  const double irradiance = 1000 * (3 / std::sqrt(13.0)) / (4 * kTestPi * 13), l = irradiance * 0.5 / kTestPi;
  expect_mean(lit("omni"), {l, l / 2, l / 4}, "omni", 1e-4);
  expect_mean(lit("sphere"), {l, l / 2, l / 4}, "sphere", 1e-4);
}

TEST(Reference, TheErrorFallsAsOneOverTheRootOfTheSamples) {
  const World w = furnace({0.6f, 0.6f, 0.6f}, {1, 1, 1});
  const Camera camera = looking({2.3, 1.7, 2.1}, {5, 1, 4}, 90);
  double errors[4], reported[4];
  for (int i = 0; i < 4; ++i) {
    const Frame f = trace(w, camera, sampled(4 << (2 * i)), 32, 32);
    double squares = 0;
    for (const Rgb& p : f.image.pixels) squares += (p.g - 2.5) * (p.g - 2.5);
    errors[i] = std::sqrt(squares / (32 * 32)) / 2.5;
    reported[i] = f.report.relative_error;
  }
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(reported[i] / errors[i], 1, 0.15) << i;  // of 1024 pixels: 2 % at 1 sigma
  for (int i = 1; i < 4; ++i) EXPECT_NEAR(std::log2(errors[0] / errors[i]) / (2 * i), 0.5, 0.05) << i;
}

TEST(Reference, ItStopsOnceTheErrorIsAsSmallAsAsked) {
  const World w = furnace({0.6f, 0.6f, 0.6f}, {1, 1, 1});
  Sampling sampling;
  sampling.error = 0.05;
  const Frame f = trace(w, looking({2.3, 1.7, 2.1}, {5, 1, 4}, 90), sampled(4096), 8, 8, sampling);
  EXPECT_LE(f.report.relative_error, 0.05);
  EXPECT_LT(f.report.samples, 4096u);
  EXPECT_EQ(f.report.samples % 16, 0u);
}

/// A room with lamps of all kinds, glass, a mirror and a mesh of light.
World everything() {
  World w = dark_world();
  w.environment.sun_irradiance = {10, 9, 8};
  set_sky(w, 0.5f);
  fill(w, {{-8, -1, -8}, {8, -1, 8}}, add_block(w, matte("floor", {0.5f, 0.4f, 0.3f})));
  fill(w, {{-3, 0, -3}, {-2, 2, -3}}, w.palette->find("glass_red").value());
  fill(w, {{2, 0, -4}, {3, 3, -4}}, w.palette->find("mercury").value());
  fill(w, {{0, 0, 0}, {0, 0, 0}}, w.palette->find("lamp_dim").value());
  fill(w, {{4, 1, 1}, {4, 1, 1}}, w.palette->find("lamp_dim").value());
  Luminaire l = luminaire("rectangle", {1.5, 4, 1.5});
  l.power = {50, 50, 50};
  w.luminaires.push_back(l);
  l = luminaire("omni", {-3, 3, 2});
  l.power = {100, 0, 0};
  w.luminaires.push_back(l);
  return w;
}
const Camera kOverview = looking({6.5, 4.5, 8.5}, {0, 1, 0}, 55);

TEST(Reference, APictureIsTheSameBitsForAnyNumberOfThreads) {
  const World w = everything();
  for (const LightTransport transport :
       {LightTransport::path, LightTransport::photons, LightTransport::whitted, LightTransport::ambient_occlusion}) {
    RenderKnobs knobs = sampled(3, SampleSequence::sobol);
    knobs.light_transport = transport;
    knobs.photons = 5000;
    const ThreadLimit one(1);
    const Frame alone = trace(w, kOverview, knobs, 40, 30);
    const ThreadLimit two(2);
    const Frame together = trace(w, kOverview, knobs, 40, 30);
    EXPECT_TRUE(same_bits(alone.image, together.image)) << static_cast<int>(transport);
    EXPECT_EQ(alone.report.rays, together.report.rays) << static_cast<int>(transport);
  }
}

TEST(Reference, SeedsMakeDifferentPictures) {
  const World w = everything();
  Sampling other;
  other.seed = 2;
  EXPECT_FALSE(
      same_bits(trace(w, kOverview, sampled(1), 20, 15).image, trace(w, kOverview, sampled(1), 20, 15, other).image));
}

TEST(Reference, APictureThatGoesOnIsTheOneThatNeverStopped) {
  const World w = everything();
  for (const SampleSequence sequence : {SampleSequence::random, SampleSequence::sobol})
    for (const LightTransport transport : {LightTransport::path, LightTransport::photons}) {
      const TemporaryFolder folder;
      Sampling sampling;
      sampling.film = folder / "film";
      RenderKnobs knobs = sampled(0, sequence);
      knobs.light_transport = transport;
      knobs.photons = 3000;
      for (const int spp : {3, 7, 20}) {
        knobs.spp = spp;
        trace(w, kOverview, knobs, 20, 15, sampling);
      }
      const Image at_once = trace(w, kOverview, knobs, 20, 15).image;
      EXPECT_TRUE(same_bits(at_once, trace(w, kOverview, knobs, 20, 15, sampling).image));
    }
}

TEST(Reference, AFilmOfAnotherSceneIsRefused) {
  const TemporaryFolder folder;
  Sampling sampling;
  sampling.film = folder / "film";
  World w = everything();
  trace(w, kOverview, sampled(1), 8, 6, sampling);
  const auto refused = [&](auto change) {
    World other = everything();
    Camera camera = kOverview;
    RenderKnobs knobs = sampled(2);
    change(other, camera, knobs);
    const WorldView view(other);
    const auto frame = trace_picture(view, camera, knobs, sampling, 8, 6);
    return !frame.ok() && frame.error().message.find("another picture") != std::string::npos;
  };
  EXPECT_TRUE(refused([](World& o, Camera&, RenderKnobs&) { o.luminaires[0].power.g = 51; }));
  EXPECT_TRUE(refused([](World& o, Camera&, RenderKnobs&) { o.environment.sky_zenith.b = 0.25f; }));
  EXPECT_TRUE(refused([](World& o, Camera&, RenderKnobs&) { fill(o, {{5, 0, 5}, {5, 0, 5}}, 1); }));
  EXPECT_TRUE(refused([](World& o, Camera&, RenderKnobs&) { o.media.emplace_back(); }));
  EXPECT_TRUE(refused([](World&, Camera& c, RenderKnobs&) { c.lens_radius = 0.1; }));
  EXPECT_TRUE(refused([](World&, Camera& c, RenderKnobs&) { c.forward = glm::normalize(c.forward + Vec3d(0.01)); }));
  EXPECT_TRUE(refused([](World&, Camera&, RenderKnobs& k) { k.max_depth = 3; }));
  EXPECT_FALSE(refused([](World&, Camera&, RenderKnobs&) {}));
}

TEST(Reference, AStoppedPictureKeepsItsSamples) {
  const World w = everything();
  const TemporaryFolder folder;
  std::atomic<bool> stop{false};
  Sampling sampling;
  sampling.film = folder / "film";
  sampling.stop = &stop;
  sampling.progress = [&](uint32_t, double) { stop = true; };
  const Frame stopped = trace(w, kOverview, sampled(40), 20, 15, sampling);
  EXPECT_EQ(stopped.report.samples, 16u);
  stop = false;
  sampling.progress = {};
  EXPECT_TRUE(same_bits(trace(w, kOverview, sampled(40), 20, 15, sampling).image,
                        trace(w, kOverview, sampled(40), 20, 15).image));
}

TEST(Reference, WhatIsAskedWrongIsRefusedInOneSentence) {
  const World w = dark_world();
  const WorldView view(w);
  const auto refusal = [&](auto change) {
    RenderKnobs knobs = sampled(1);
    Camera camera = kOverview;
    change(knobs, camera);
    const auto frame = trace_picture(view, camera, knobs, {}, 4, 4);
    EXPECT_TRUE(!frame.ok() && frame.error().kind == ErrorKind::usage);
    return frame.ok() ? std::string() : frame.error().message;
  };
  EXPECT_NE(refusal([](RenderKnobs& k, Camera&) { k.spp = 0; }).find("knob spp: 0 is outside [1, "), std::string::npos);
  EXPECT_NE(refusal([](RenderKnobs& k, Camera&) { k.max_depth = -1; }).find("max_depth"), std::string::npos);
  EXPECT_NE(refusal([](RenderKnobs&, Camera& c) { c.forward = Vec3d(0); }), "");
  EXPECT_NE(refusal([](RenderKnobs&, Camera& c) { c.lens_radius = -1; }), "");
  EXPECT_NE(refusal([](RenderKnobs&, Camera& c) { c.focus_distance = 0; }), "");
}

TEST(ThinLens, WhatLiesInThePlaneOfFocusIsAsSharpAsThroughAPinhole) {
  World w = dark_world();
  fill(w, {{-10, -10, -11}, {10, 10, -11}}, add_block(w, matte("dark", {0.1f, 0.1f, 0.1f}, {1, 1, 1})));
  fill(w, {{0, -10, -11}, {10, 10, -11}}, add_block(w, matte("bright", {0.1f, 0.1f, 0.1f}, {5, 5, 5})));
  RenderKnobs knobs = sampled(16);
  knobs.max_depth = 1;
  Camera camera = looking({0, 0.5, 0}, {0, 0.5, -1}, 10);  // 0.12 m a pixel at the wall
  const auto blurred_pixels = [&] {
    int between = 0;
    for (const Rgb& p : trace(w, camera, knobs, 64, 16).image.pixels) between += p.g > 1.8f && p.g < 4.2f;
    return between;
  };
  EXPECT_EQ(blurred_pixels(), 0);  // the edge lies between two columns
  camera.lens_radius = 0.3;
  camera.focus_distance = 10;
  EXPECT_EQ(blurred_pixels(), 0);
  camera.focus_distance = 5;
  EXPECT_GT(blurred_pixels(), 8);
}

}  // namespace
}  // namespace render
