// Integrators against each other and against closed forms; and effects that a world doesn't call for.
#include "render/trace/transport.h"

#include <cstring>

#include "tests/render/trace/trace_worlds.h"
#include "world/base/jobs.h"

namespace render {
namespace {

using namespace world;

Luminaire luminaire(const std::string& kind, Vec3d position, Power3 power) {
  Luminaire l;
  l.kind = l.name = kind;
  l.position = WorldPoint::from(position.x, position.y, position.z);
  l.power = power;
  l.radius = 0.01f;
  return l;
}

Medium homogeneous(Absorption3 absorption, Absorption3 scattering) {
  Medium m;
  m.kind = m.name = "homogeneous";
  m.absorption = absorption;
  m.scattering = scattering;
  return m;
}
Medium box_fog(Vec3d centre, Vec3f half_extent, Absorption3 absorption, Absorption3 scattering) {
  Medium m = homogeneous(absorption, scattering);
  m.kind = "box_fog";
  m.position = WorldPoint::from(centre.x, centre.y, centre.z);
  m.half_extent = half_extent;
  return m;
}

RenderKnobs knobs_of(LightTransport transport, int spp) {
  RenderKnobs k = sampled(spp);
  k.light_transport = transport;
  return k;
}

// --- transport through blocks ---------------------------------------------------------------------------------------

TEST(Transport, AGlassSlabLetsThroughWhatFresnelAndAbsorptionLeave) {
  // Behind 1 to 4 voxels of glass stands a wall that shines; seen along the normal.
  for (int thickness = 1; thickness <= 4; ++thickness) {
    World w = dark_world();
    Block glass = matte("pane", {0.5f, 0.5f, 0.5f});
    glass.bsdf = "dielectric";
    glass.opaque = false;
    glass.index_of_refraction = 1.5f;
    glass.absorption = {0.1f, 0.5f, 2};
    fill(w, {{-20, -20, -20}, {20, 20, -20}}, add_block(w, matte("wall", {0.001f, 0.001f, 0.001f}, {1, 1, 1})));
    fill(w, {{-20, -20, -3 - thickness}, {20, 20, -4}}, add_block(w, glass));
    const Image image = trace(w, looking({0.5, 0.5, 0}, {0.5, 0.5, -1}, 0.1), sampled(512), 8, 8).image;
    const double n = 1.5 / 1.00029, r = (n - 1) * (n - 1) / ((n + 1) * (n + 1));
    Vec3d expected;
    for (int b = 0; b < 3; ++b) {
      const double a = std::exp(-Vec3d(0.1, 0.5, 2)[b] * thickness);
      expected[b] = (1 - r) * (1 - r) * a / (1 - r * r * a * a);
    }
    // The wall's own albedo of 0.001 adds at most so much.
    expect_mean(image, expected, "slab", 2e-3);
  }
}

TEST(Transport, MirrorsShowThePathTracerWhatWhittedSees) {
  // A mirror seen at an angle, a matte floor in it, an omni light. Whitted follows eye, mirror, floor, light.
  World w = dark_world();
  fill(w, {{-10, -1, -10}, {10, -1, 10}}, add_block(w, matte("floor", {0.5f, 0.3f, 0.2f})));
  fill(w, {{-4, 0, -8}, {4, 6, -8}}, w.palette->find("mercury").value());
  w.luminaires.push_back(luminaire("omni", {1, 4, -3}, {500, 500, 500}));
  RenderKnobs whitted = knobs_of(LightTransport::whitted, 64), path = knobs_of(LightTransport::path, 64);
  whitted.max_depth = path.max_depth = 2;
  // Through the mirror alone.
  const Camera camera = looking({0, 3, 2}, {0, 2.5, -7}, 25);
  const Image a = trace(w, camera, whitted, 24, 16).image, b = trace(w, camera, path, 24, 16).image;
  double squares = 0, mean = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    squares += (a.pixels[i].g - b.pixels[i].g) * (a.pixels[i].g - b.pixels[i].g);
    mean += a.pixels[i].g / static_cast<double>(a.pixels.size());
  }
  // Both sample the pixel's area alike and ask the one light; where the path also bounces it finds no light to meet.
  EXPECT_GT(mean, 0.01);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(a.pixels.size())), 1e-3 * mean);
}

TEST(Transport, DirectLightIsThePathTracersFirstEvent) {
  World w = dark_world();
  fill(w, {{-10, -1, -10}, {10, -1, 10}}, add_block(w, matte("floor", {0.5f, 0.3f, 0.2f})));
  fill(w, {{0, 0, 0}, {1, 2, 1}}, add_block(w, matte("box", {0.2f, 0.3f, 0.6f})));
  Luminaire l = luminaire("rectangle", {-2, 5, 1}, {300, 200, 100});
  l.extent = {2, 1};
  w.luminaires.push_back(l);
  w.environment.sun_irradiance = {3, 2, 1};
  RenderKnobs direct = knobs_of(LightTransport::direct, 64), path = knobs_of(LightTransport::path, 256);
  path.max_depth = 1;
  const Camera camera = looking({6, 5, 7}, {0, 0, 0}, 50);
  const Image a = trace(w, camera, direct, 16, 12).image, b = trace(w, camera, path, 16, 12).image;
  const PictureMean x = mean_of(a), y = mean_of(b);
  for (int band = 0; band < 3; ++band) EXPECT_NEAR(x.mean[band] / y.mean[band], 1, 0.01);
}

TEST(Transport, OcclusionOfAnOpenSkyIsNone) {
  World w = dark_world();
  set_sky(w, 2);
  fill(w, {{-30, -1, -30}, {30, -1, 30}}, add_block(w, matte("floor", {0.5f, 0.3f, 0.2f})));
  const Camera camera = looking({0.5, 2, 0.5}, {0.5, 0, 0.6}, 30);
  const Image direct = trace(w, camera, knobs_of(LightTransport::direct, 4), 8, 8).image;
  EXPECT_TRUE(same_bits(direct, trace(w, camera, knobs_of(LightTransport::ambient_occlusion, 4), 8, 8).image));
  // In a corner of two walls 20 m high, less than a quarter of the sky is left.
  fill(w, {{-1, 0, -30}, {-1, 20, 30}}, add_block(w, matte("wall", {0.5f, 0.3f, 0.2f})));
  fill(w, {{-30, 0, -1}, {30, 20, -1}}, w.palette->find("wall").value());
  const Image corner = trace(w, camera, knobs_of(LightTransport::ambient_occlusion, 4), 8, 8).image;
  EXPECT_LT(mean_of(corner).mean[0], 0.45 * mean_of(direct).mean[0]);
  EXPECT_GT(mean_of(corner).mean[0], 0.05 * mean_of(direct).mean[0]);
}

TEST(Transport, PhotonsConvergeToThePathTracersPicture) {
  // A closed room with one lamp: most of its light comes over several walls.
  World w = dark_world();
  fill_walls(w, {{0, 0, 0}, {5, 4, 5}}, add_block(w, matte("wall", {0.7f, 0.5f, 0.3f})));
  Luminaire l = luminaire("rectangle", {3, 4.9, 3}, {100, 100, 100});
  w.luminaires.push_back(l);
  const Camera camera = looking({1, 2, 1}, {4, 1.5, 4}, 60);
  RenderKnobs photons = knobs_of(LightTransport::photons, 24);
  photons.photons = 20000;
  photons.photon_radius = 0.4f;
  const Frame by_photons = trace(w, camera, photons, 24, 24);
  const Image& a = by_photons.image;
  const Image b = trace(w, camera, knobs_of(LightTransport::path, 256), 24, 24).image;
  EXPECT_GT(work(by_photons.report, "photon_rays"), 0u);
  const PictureMean x = mean_of(a), y = mean_of(b);
  // Bias: faces lose what the disk of the estimate has beyond their edges; of 5 m and a radius of 0.2 m a few percent.
  for (int band = 0; band < 3; ++band) EXPECT_NEAR(x.mean[band] / y.mean[band], 1, 0.05) << band;
}

TEST(Transport, TheLightOfManyLampsIsTheSumOfEach) {
  // Hard case L17 in the small: the tree picks among 400 voxels; the sun is a thousand times as strong.
  World w = dark_world();
  w.environment.sun_irradiance = {1000, 0, 0};
  w.environment.sun_direction = Vec3d(0, 1, 0);
  fill(w, {{-40, -1, -40}, {40, -1, 40}}, add_block(w, matte("floor", {0.5f, 0.5f, 0.5f})));
  const BlockId lamp = add_block(w, matte("lamp", {0.5f, 0.5f, 0.5f}, {0, 1, 0}));
  for (int x = -20; x < 20; x += 2)
    for (int z = -20; z < 20; z += 2) fill(w, {{x, 5, z}, {x, 5, z}}, lamp);
  RenderKnobs knobs = sampled(1024);
  knobs.max_depth = 1;
  const Vec3d at(1.5, 0, 1.5);
  const Image image = trace(w, looking({1.5, 2, 4.5}, at, 0.05), knobs, 6, 6).image;
  // The same by the definition: faces cut into patches, each seen or hidden by a flat walk.
  double irradiance = 0;
  constexpr int kPatches = 10;
  StoreReader reader(w.store);
  for (int x = -20; x < 20; x += 2)
    for (int z = -20; z < 20; z += 2)
      for (int face = 0; face < kFaces; ++face) {
        const int axis = face_axis(face);
        Vec3d n(0);
        n[axis] = face_sign(face);
        for (int i = 0; i < kPatches * kPatches; ++i) {
          Vec3d p(x, 5, z);
          p[axis] += face_sign(face) > 0 ? 1 : 0;
          p[(axis + 1) % 3] += (i / kPatches + 0.5) / kPatches, p[(axis + 2) % 3] += (i % kPatches + 0.5) / kPatches;
          const Vec3d to = p - at;
          const double d = glm::length(to), cosine = -dot(n, to) / d;
          if (!(cosine > 0)) continue;
          const GridRay ray(WorldPoint::from(at.x, at.y, at.z), to, 1.001);
          const GridHit hit = first_hit_flat(ray, [&](VoxelPos v) { return reader.get(v) != kAir; });
          if (hit.hit() && hit.voxel == VoxelPos{x, 5, z})
            irradiance += cosine * (to.y / d) / (d * d) / (kPatches * kPatches);
        }
      }
  const PictureMean m = mean_of(image);
  EXPECT_NEAR(m.mean[1], irradiance * 0.5 / kTestPi, 0.005 * irradiance * 0.5 / kTestPi + 4 * m.error[1]);
  EXPECT_LT(m.error[1] / m.mean[1], 0.05);
}

// --- shapes of blocks ------------------------------------------------------------------------------------------------

TEST(Shapes, InALightFromAllSidesFencesAndReedsVanish) {
  for (const char* proxy : {"fence", "cross", "torch", "lantern"}) {
    World w = dark_world();
    set_sky(w, 1);
    Block b = matte("shaped", {0.999f, 0.999f, 0.999f});
    b.opaque = false;
    b.proxy = proxy;
    fill(w, {{0, 0, 0}, {3, 1, 2}}, add_block(w, b));
    const Image image = trace(w, looking({5, 4.3, 6}, {2, 1, 1.5}, 40), sampled(32), 24, 24).image;
    expect_mean(image, {1, 1, 1}, proxy, 0.01);  // the albedo, some times over
  }
}

TEST(Shapes, RaysPassBetweenTheBarsOfAFence) {
  World w = dark_world();
  fill(w, {{-20, -20, -11}, {20, 20, -11}}, add_block(w, matte("glowing", {0.1f, 0.1f, 0.1f}, {1, 1, 1})));
  Block b = matte("fence", {0.001f, 0.001f, 0.001f});
  b.opaque = false;
  b.proxy = "fence";
  fill(w, {{-3, 0, -3}, {3, 0, -3}}, add_block(w, b));
  RenderKnobs knobs = sampled(4);
  knobs.max_depth = 1;
  const Image image = trace(w, looking({0.5, 0.5, 2}, {0.5, 0.5, -3}, 20), knobs, 32, 32).image;
  int bars = 0, gaps = 0;
  for (const Rgb& p : image.pixels) bars += p.g<0.1f, gaps += p.g> 0.9f;
  EXPECT_GT(bars, 100);
  EXPECT_GT(gaps, 100);
}

TEST(Shapes, ATorchSendsItsPowerFromItsSurface) {
  World w = dark_world();
  Block torch = matte("torch_like", {0.001f, 0.001f, 0.001f});
  torch.opaque = false;
  torch.proxy = "torch";
  torch.emission = {100, 200, 300};
  fill(w, {{0, 0, 0}, {0, 0, 0}}, add_block(w, torch));
  fill(w, {{20, -30, -30}, {20, 30, 30}}, add_block(w, matte("screen", {0.5f, 0.5f, 0.5f})));
  RenderKnobs knobs = sampled(512);
  knobs.max_depth = 1;
  const Frame f = trace(w, looking({15, 0.4, 3}, {20, 0.4, 0.5}, 0.05), knobs, 8, 8);
  // A stick of 0.125 x 0.5 x 0.125 m under a head of 0.1875 m: what they show, and what of it faces the screen.
  const double side = 0.125 * 0.5 + 0.1875 * 0.1875, all = 4 * side + 2 * 0.125 * 0.125 + 2 * 0.1875 * 0.1875;
  const double l = 100 / (kTestPi * all), d = 20 - 0.5, e = l * side / (d * d) * 0.5 / kTestPi;
  const PictureMean m = mean_of(f.image);
  for (int b = 0; b < 3; ++b) EXPECT_NEAR(m.mean[b] / (e * (b + 1)), 1, 0.02 + 4 * m.error[b] / m.mean[b]) << b;
  EXPECT_LT(m.error[0] / m.mean[0], 0.02);
  EXPECT_GT(work(f.report, "block_light"), 0u);
}

// --- media ----------------------------------------------------------------------------------------------------------

TEST(Media, WhatOnlyAbsorbsLeavesTheExponentialOfItsDepth) {
  World w = dark_world();
  fill(w, {{-20, -20, -11}, {20, 20, -11}}, add_block(w, matte("wall", {0.001f, 0.001f, 0.001f}, {1, 1, 1})));
  w.media.push_back(homogeneous({0.05f, 0.1f, 0.3f}, {}));
  const Image image = trace(w, looking({0.5, 0.5, 0}, {0.5, 0.5, -1}, 0.01), sampled(4), 4, 4).image;
  expect_mean(image, {std::exp(-0.5), std::exp(-1.0), std::exp(-3.0)}, "absorber", 2e-3);
}

TEST(Media, WhatOnlyScattersVanishesInALightFromAllSides) {
  for (const float anisotropy : {0.0f, 0.8f, -0.5f}) {
    World w = dark_world();
    set_sky(w, 1);
    w.media.push_back(box_fog({0, 0, 0}, {1, 2, 1}, {}, {0.2f, 1, 5}));
    w.media.back().anisotropy = anisotropy;
    const Frame f = trace(w, looking({4, 3, 5}, {0, 0, 0}, 40), sampled(64), 24, 24);
    expect_mean(f.image, {1, 1, 1}, "cloud");
    EXPECT_GT(work(f.report, "media"), 0u);
  }
}

TEST(Media, LightScatteredOnceIsTheIntegralAlongTheRay) {
  // An omni light beside a ray of 8 m through fog; one scattering. L = sum of sigma_s / (4 pi) E(t) T(t).
  World w = dark_world();
  const Absorption3 absorption{0.05f, 0.1f, 0}, scattering{0.1f, 0.3f, 0.05f};
  w.media.push_back(box_fog({0, 0, 0}, {4, 4, 4}, absorption, scattering));
  w.luminaires.push_back(luminaire("omni", {0, 1.5, 0.5}, {100, 100, 100}));
  RenderKnobs knobs = sampled(1024);
  knobs.max_depth = 1;
  const Image image = trace(w, looking({-10, 0, 0}, {0, 0, 0}, 0.01), knobs, 8, 8).image;
  Vec3d expected(0);
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    const double t = (i + 0.5) * 8 / kSteps;
    const double r = glm::length(Vec3d(t - 4, 0, 0) - Vec3d(0, 1.5, 0.5));
    for (int b = 0; b < 3; ++b) {
      const double s = Vec3d(0.1, 0.3, 0.05)[b], e = s + Vec3d(0.05, 0.1, 0)[b];
      expected[b] += s / (4 * kTestPi) * 100 / (4 * kTestPi * r * r) * std::exp(-e * (t + r)) * 8 / kSteps;
    }
  }
  expect_mean(image, expected, "single scattering", 1e-4);
}

TEST(Media, EachBandIsUnbiasedWhateverTheOthersExtinctionsAre) {
  // One band scatters a thousand times as strongly as another; each alone, in a grey medium, says what it should be.
  const float strengths[3] = {0.01f, 0.5f, 10};
  const auto picture = [](Absorption3 scattering, int spp) {
    World w = dark_world();
    set_sky(w, 1);
    const Absorption3 absorption = scattering * 0.2f;
    w.media.push_back(box_fog({0, 0, 0}, {1, 1, 1}, absorption, scattering));
    return mean_of(trace(w, looking({3, 2, 4}, {0, 0, 0}, 25), sampled(spp), 16, 16).image);
  };
  const PictureMean all = picture({strengths[0], strengths[1], strengths[2]}, 256);
  for (int b = 0; b < 3; ++b) {
    const PictureMean alone = picture({strengths[b], strengths[b], strengths[b]}, 256);
    // The pictures' pixels differ, so their spread isn't the error; that is bounded by one sample's range, 0..1.
    EXPECT_NEAR(all.mean[b], alone.mean[b], 4 * std::sqrt(2.0 / (256 * 256)) * 0.5) << b;
  }
}

TEST(Media, OverlappingMediaActAsTheirSum) {
  const auto picture = [](bool apart) {
    World w = dark_world();
    set_sky(w, 1);
    const Absorption3 half{0.1f, 0.2f, 0.4f}, whole{0.2f, 0.4f, 0.8f};
    if (apart) {
      w.media.push_back(box_fog({0, 0, 0}, {1, 1, 1}, half, half));
      w.media.push_back(box_fog({0, 0, 0}, {1, 1, 1}, half, half));
    } else {
      w.media.push_back(box_fog({0, 0, 0}, {1, 1, 1}, whole, whole));
    }
    return mean_of(trace(w, looking({3, 2, 4}, {0, 0, 0}, 25), sampled(256), 16, 16).image);
  };
  const PictureMean one = picture(false), two = picture(true);
  for (int b = 0; b < 3; ++b) EXPECT_NEAR(one.mean[b], two.mean[b], 4 * std::sqrt(2.0 / (256 * 256)) * 0.5) << b;
}

TEST(Media, EmissionFillsAnInfinitelyDeepMediumWithItself) {
  World w = dark_world();
  w.media.push_back(homogeneous({1, 2, 3}, {}));
  w.media.back().emission = {4, 5, 6};
  for (const LightTransport transport : {LightTransport::direct, LightTransport::path}) {
    const Image image = trace(w, looking({0, 0, 0}, {1, 2, 3}, 40), knobs_of(transport, 16), 4, 4).image;
    expect_mean(image, {4, 5, 6}, "glow");
  }
}

// --- effects that aren't there ---------------------------------------------------------------------------------------

World plain() {
  World w = dark_world();
  w.environment.sun_irradiance = {3, 2, 1};
  set_sky(w, 0.5f);
  fill(w, {{-10, -1, -10}, {10, -1, 10}}, add_block(w, matte("floor", {0.5f, 0.3f, 0.2f})));
  fill(w, {{0, 0, 0}, {2, 3, 1}}, add_block(w, matte("box", {0.2f, 0.5f, 0.8f})));
  return w;
}
const Camera kPlainCamera = looking({6, 5, 7}, {0, 0, 0}, 50);

TEST(HardCaseX1, AnEffectOfZeroStrengthIsTheSameBitsAsNone) {
  const World without = plain();
  World with = plain();
  with.luminaires.push_back(luminaire("omni", {0, 5, 0}, {0, 0, 0}));
  with.luminaires.push_back(luminaire("rectangle", {0, 6, 0}, {0, 0, 0}));
  with.luminaires.push_back(luminaire("sphere", {3, 2, 0}, {100, 100, 100}));
  with.luminaires.back().enabled = false;
  with.media.push_back(homogeneous({}, {}));
  with.media.push_back(box_fog({0, 0, 0}, {3, 3, 3}, {}, {}));
  for (const LightTransport transport : {LightTransport::direct, LightTransport::ambient_occlusion,
                                         LightTransport::whitted, LightTransport::path, LightTransport::photons}) {
    RenderKnobs knobs = knobs_of(transport, 4);
    knobs.photons = 2000;
    const Frame a = trace(without, kPlainCamera, knobs, 32, 24), b = trace(with, kPlainCamera, knobs, 32, 24);
    EXPECT_TRUE(same_bits(a.image, b.image)) << static_cast<int>(transport);
    for (const EffectWork& e : a.report.work) EXPECT_EQ(e.work, work(b.report, e.name)) << e.name;
  }
}

TEST(HardCaseX2, AnEffectThatIsNotInTheSceneCostsNothing) {
  const Frame f = trace(plain(), kPlainCamera, knobs_of(LightTransport::path, 4), 32, 24);
  for (const char* absent : {"photon_rays", "meshes", "media", "luminaires", "block_light", "transmission"})
    EXPECT_EQ(work(f.report, absent), 0u) << absent;
  EXPECT_GT(work(f.report, "shadow_rays"), 0u);
  EXPECT_EQ(f.report.passes[0].bytes, 0u);
  World dark = dark_world();
  fill(dark, {{0, 0, 0}, {2, 3, 1}}, add_block(dark, matte("box", {0.2f, 0.5f, 0.8f})));
  EXPECT_EQ(work(trace(dark, kPlainCamera, knobs_of(LightTransport::path, 4), 32, 24).report, "shadow_rays"), 0u);
}

TEST(Raycast, KeepsItsPictureWhereNothingCallsForAnIntegrator) {
  // What the fast path draws, the integrator of direct light draws within float rounding.
  const World w = plain();
  const WorldView view(w);
  RenderKnobs knobs;
  const auto backend = make_raycast_backend();
  const auto fast = (*backend)->render(view, kPlainCamera, knobs, 48, 36);
  ASSERT_TRUE(fast.ok());
  EXPECT_TRUE(fast->report.work.empty());
  const Image traced = trace(w, kPlainCamera, knobs, 48, 36).image;
  for (size_t i = 0; i < traced.pixels.size(); ++i) {
    EXPECT_NEAR(traced.pixels[i].r, fast->image.pixels[i].r, 1e-5f * (1 + fast->image.pixels[i].r)) << i;
    EXPECT_NEAR(traced.pixels[i].b, fast->image.pixels[i].b, 1e-5f * (1 + fast->image.pixels[i].b)) << i;
  }
}

// --- luminaires' switches
// ---------------------------------------------------------------------------------------------

TEST(Switches, EachTakesItsKindOfLightAway) {
  const auto brightness = [](auto change, LightTransport transport, int depth) {
    World w = dark_world();
    fill(w, {{-10, -1, -10}, {10, -1, 10}}, add_block(w, matte("floor", {0.5f, 0.5f, 0.5f})));
    fill(w, {{-10, 4, -10}, {10, 4, 10}}, w.palette->find("floor").value());
    fill(w, {{0, 2, 0}, {0, 2, 0}}, w.palette->find("floor").value());
    w.luminaires.push_back(luminaire("omni", {0.5, 3.5, 0.5}, {100, 100, 100}));
    change(w.luminaires[0]);
    RenderKnobs knobs = knobs_of(transport, 64);
    knobs.max_depth = depth;
    return mean_of(trace(w, looking({0.5, 0.5, 3.5}, {0.5, 0, 0.5}, 10), knobs, 8, 8).image).mean[0];
  };
  const auto as_it_is = [](Luminaire&) {};
  const double shadowed = brightness(as_it_is, LightTransport::path, 1),
               bounced = brightness(as_it_is, LightTransport::path, 4);
  EXPECT_EQ(shadowed, 0);
  EXPECT_GT(bounced, 0);
  EXPECT_GT(brightness([](Luminaire& l) { l.shadows = false; }, LightTransport::path, 1), 0);
  EXPECT_EQ(brightness([](Luminaire& l) { l.global_illumination = false; }, LightTransport::path, 4), 0);
  EXPECT_EQ(brightness([](Luminaire& l) { l.lambertian = false; }, LightTransport::path, 4), 0);
  EXPECT_EQ(brightness([](Luminaire& l) { l.enabled = false; }, LightTransport::path, 4), 0);
  EXPECT_NEAR(brightness([](Luminaire& l) { l.glossy = false; }, LightTransport::path, 4), bounced, 0.1 * bounced);
}

}  // namespace
}  // namespace render
