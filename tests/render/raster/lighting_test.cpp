// Luminaires, media, skies and textures of the rasterizer, against the ray caster at direct light.
#include <cmath>

#include <gtest/gtest.h>

#include "render/image/display.h"
#include "render/image/flip.h"
#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

using world::Luminaire;
using world::Medium;
using world::World;
using world::WorldPoint;

constexpr int kWidth = 160, kHeight = 90;
constexpr double kPi = 3.14159265358979323846;

RasterBackend& raster() {
  static const std::unique_ptr<RasterBackend> backend = [] {
    gpu::DeviceOptions options;
    options.validation = true;
    auto made = make_raster(options);
    CHECK(made.ok());
    return std::move(*made);
  }();
  return *backend;
}

Image drawn(Backend& backend, const World& w, const Camera& camera, const RenderKnobs& knobs) {
  auto frame = backend.render(world::WorldView(w), camera, knobs, kWidth, kHeight);
  if (!frame.ok()) ADD_FAILURE() << frame.error().message;
  return frame.ok() ? std::move(frame->image) : Image(kWidth, kHeight);
}
Image cast(const World& w, const Camera& camera, const RenderKnobs& knobs) {
  auto backend = make_raycast_backend();
  return drawn(**backend, w, camera, knobs);
}

/// The bar of the backends: 99.9 % of pixels within 2/255, FLIP's mean below 0.01.
void expect_agreement(const World& w, const Camera& camera, RenderKnobs knobs, const std::string& what,
                      double share = 0.999) {
  // Layers and coarser levels are other tests'.
  knobs.transparency = Transparency::opaque, knobs.lod_error_px = 0;
  const Image a = drawn(raster(), w, camera, knobs), b = cast(w, camera, knobs);
  const Image8 x = display_image(a, knobs.exposure), y = display_image(b, knobs.exposure);
  size_t within = 0, lit = 0;
  for (size_t i = 0; i < x.pixels.size(); i += 3) {
    int worst = 0;
    for (size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(x.pixels[i + c] - y.pixels[i + c]));
    within += worst <= 2;
    lit += y.pixels[i] + y.pixels[i + 1] + y.pixels[i + 2] > 30;
  }
  const double pixels = static_cast<double>(x.pixels.size()) / 3;
  EXPECT_GE(static_cast<double>(within), share * pixels) << what;
  EXPECT_LT(flip_map(x, y).mean, 0.01) << what;
  EXPECT_GT(static_cast<double>(lit), 0.05 * pixels) << what << ": too dark to say anything";
  EXPECT_EQ(raster().messages(), std::vector<std::string>{}) << what;
}

/// A closed room without light of its own: nothing but luminaires lights it.
World dark_room() {
  World w = room();
  world::EditBatch batch;
  batch.set({8, 5, 8}, world::kAir);
  batch.fill(box_at({}, {2, 0, 8}, {2, 2, 9}), block(w, "brick_red"));
  apply(w, batch);
  w.environment.sun_irradiance = {};
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};
  return w;
}
Camera in_the_room() { return camera_at({}, {1.3, 3.7, 1.2}, {1, -0.35, 0.9}, 75); }

Luminaire luminaire(const char* kind) {
  Luminaire l;
  l.name = l.kind = kind;
  l.position = WorldPoint::from(6.4, 5.2, 7.3);
  l.power = {900, 700, 500};
  l.extent = {1.5f, 0.8f};
  l.radius = 0.6f;
  return l;
}

std::shared_ptr<world::LightImage> picture_of_light() {
  auto image = std::make_shared<world::LightImage>();
  image->width = 8, image->height = 4;
  for (int i = 0; i < 32; ++i) {
    const float v = static_cast<float>(i % 5);
    image->pixels.push_back({0.1f + v, 0.3f + 0.5f * v, i % 3 ? 1.0f : 0.2f});
  }
  return image;
}

std::vector<Luminaire> one_of_each_kind() {
  Luminaire spot = luminaire("spot"), gobo = luminaire("gobo"), unified = luminaire("unified_point");
  spot.half_angle = 0.9f, spot.inner_half_angle = 0.5f;
  spot.axis = glm::normalize(world::Vec3f(-0.3f, -1, -0.2f)), spot.up = world::Vec3f(0, 0.19611613f, -0.98058069f);
  spot.power = {9000, 9000, 7000};
  gobo.half_angle = 0.8f, gobo.inner_half_angle = 0.8f, gobo.power = {2500, 2500, 2500}, gobo.image = "slide";
  gobo.light_image = picture_of_light();
  unified.attenuation = {0.2f, 0.1f, 0.5f}, unified.half_angle = 2;
  Luminaire far_point = luminaire("unified_point");
  far_point.at_infinity = true, far_point.attenuation = {1, 0, 0}, far_point.axis = {0, -1, 0};
  Luminaire directional = luminaire("directional");
  directional.power = {}, directional.irradiance = {60, 50, 40};
  directional.axis = glm::normalize(world::Vec3f(0.4f, -1, 0.2f));
  Luminaire mesh = luminaire("mesh");
  mesh.triangles = {{-1, 0, -1}, {1, 0, -1}, {0, 0.3f, 1}, {0.5f, -0.5f, 0}, {0.7f, -0.5f, 0.4f}, {0.2f, -0.5f, 0.4f}};
  Luminaire panel = luminaire("rectangle"), by_area = panel;
  by_area.uniform_area = true;
  Luminaire switched = luminaire("sphere");
  switched.shadows = false, switched.glossy = false;
  return {luminaire("omni"),   spot,    gobo, unified, far_point, directional, mesh, panel, by_area, luminaire("disk"),
          luminaire("sphere"), switched};
}

TEST(RasterLuminaires, EveryKindLightsARoomAsTheRayCasterHasIt) {
  for (const Luminaire& l : one_of_each_kind()) {
    World w = dark_room();
    // What lies at no place shines through the roof.
    if (l.kind == "directional" || l.at_infinity) {
      world::EditBatch open;
      open.fill(box_at({}, {3, 6, 3}, {9, 6, 9}), world::kAir);
      apply(w, open);
    }
    w.luminaires = {l};
    RenderKnobs knobs;
    knobs.exposure = 5;
    expect_agreement(w, in_the_room(), knobs, l.kind + (l.uniform_area ? " by area" : ""));
  }
}

TEST(RasterLuminaires, SkiesOfImagesAreSeenAndLight) {
  World w = hills();
  w.environment = dark_room().environment;
  Luminaire sky = luminaire("hemisphere");
  sky.power = {}, sky.radiance = {20, 30, 50}, sky.axis = {0, 1, 0}, sky.up = {0, 0, 1};
  RenderKnobs knobs;
  for (const bool image : {false, true}) {
    sky.whole_sphere = image;
    if (image) sky.image = "sky", sky.light_image = picture_of_light(), sky.radiance = {15, 15, 15};
    w.luminaires = {sky};
    // Glass hides the sky from the ray caster's shadow rays, not from the rasterizer's grid of opaque voxels.
    expect_agreement(w, hill_cameras()[2].camera, knobs, image ? "image" : "even", 0.99);
  }
}

TEST(RasterLuminaires, GlossyBlocksShineAsTheRayCasterHasIt) {
  World w = dark_room();
  world::EditBatch batch;
  batch.fill(box_at({}, {0, -1, 0}, {11, -1, 11}), block(w, "gold_block"));
  batch.fill(box_at({}, {7, 0, 3}, {8, 2, 4}), block(w, "obsidian"));
  apply(w, batch);
  w.luminaires = {luminaire("omni"), luminaire("rectangle")};
  w.luminaires[0].position = WorldPoint::from(4.4, 3.2, 9.3);  // the ray caster's panels hide what lies on them
  RenderKnobs knobs;
  knobs.exposure = 3;
  expect_agreement(w, in_the_room(), knobs, "gloss");
}

/// What a mirror is matte as is all that it mirrors, whether or not anything calls for BSDFs.
TEST(RasterLuminaires, ALampTooFaintToSeeLeavesMirrorsAsTheyAre) {
  World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-40, -1, -40}, {40, -1, 40}}, block(w, "stone"));
  batch.fill({{-6, 0, -6}, {6, 4, 6}}, block(w, "mercury"));
  apply(w, batch);
  const Camera camera = camera_at({}, {14.3, 9.2, 17.4}, {-0.6, -0.4, -0.7});
  RenderKnobs opaque;
  opaque.transparency = Transparency::opaque;
  const Image by_raster = drawn(raster(), w, camera, opaque), by_rays = cast(w, camera, opaque);
  Luminaire faint = luminaire("omni");
  faint.power = {1e-12f, 1e-12f, 1e-12f}, faint.position = WorldPoint::from(0, 60, 0);
  w.luminaires = {faint};
  EXPECT_EQ(share_within(drawn(raster(), w, camera, opaque), by_raster, 1), 1);
  EXPECT_EQ(share_within(cast(w, camera, opaque), by_rays, 1), 1);
}

/// White furnace, of gloss: what takes nothing can't be seen in an even sky, whether or not anything calls for BSDFs.
TEST(RasterLuminaires, ALampTooFaintToSeeLeavesGlossAsBrightAsTheSkyAroundIt) {
  World w(world::standard_blocks());
  w.environment.sun_irradiance = {};
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {50, 60, 70};
  world::Block polished;
  polished.name = "polished", polished.bsdf = "blinn_phong";
  polished.albedo = {0.3f, 0.2f, 0.6f}, polished.glossy = {0.7f, 0.8f, 0.4f};
  const auto id = w.palette->add(polished);
  ASSERT_TRUE(id.ok());
  world::EditBatch batch;
  batch.fill({{-6, 0, -6}, {6, 4, 6}}, *id);
  apply(w, batch);
  Luminaire faint = luminaire("omni");
  faint.power = {1e-12f, 1e-12f, 1e-12f}, faint.position = WorldPoint::from(0, 60, 0);
  RenderKnobs lobe;
  lobe.direct_gloss = DirectGloss::lobe;
  const Camera camera = camera_at({}, {14.3, 9.2, 17.4}, {-0.6, -0.4, -0.7});
  for (const bool lamp : {false, true}) {
    if (lamp) w.luminaires = {faint};
    for (const RenderKnobs& knobs : {RenderKnobs{}, lobe})
      for (const Image& image : {drawn(raster(), w, camera, knobs), cast(w, camera, knobs)})
        for (const Rgb& p : image.pixels) {
          ASSERT_NEAR(p.r, 50, 50 * 2e-5) << lamp;
          ASSERT_NEAR(p.g, 60, 60 * 2e-5) << lamp;
          ASSERT_NEAR(p.b, 70, 70 * 2e-5) << lamp;
        }
  }
}

TEST(RasterSun, HasTheLobesOfTheRayCasterWhereTheyAreAskedFor) {
  World w = hills();
  world::EditBatch batch;
  batch.fill(box_at({}, {-64, 1, -64}, {63, 12, 63}), block(w, "gold_block"));
  apply(w, batch);
  const Camera camera = hill_cameras()[0].camera;
  RenderKnobs lobes;
  lobes.direct_gloss = DirectGloss::lobe;
  expect_agreement(w, camera, lobes, "lobes of the sun");
  EXPECT_LT(share_within(cast(w, camera, lobes), cast(w, camera, {}), 2), 0.9);
}

TEST(RasterLuminaires, AHundredThousandAreDrawnFromListsOfBoundedLength) {
  World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-640, 0, -640}, {639, 0, 639}}, block(w, "stone"));
  apply(w, batch);
  w.environment = dark_room().environment;
  for (int i = 0; i < 100000; ++i) {
    Luminaire l = luminaire("omni");
    const uint64_t h = world::mix64(static_cast<uint64_t>(i) + 5);
    l.position = WorldPoint::from(static_cast<double>(h % 12800) / 10 - 640, 1.5 + static_cast<double>(h >> 60) * 0.2,
                                  static_cast<double>((h >> 20) % 12800) / 10 - 640);
    l.power = {40, 30, 20};
    w.luminaires.push_back(l);
  }
  RenderKnobs knobs;
  knobs.exposure = 3;
  const Camera camera = camera_at({}, {0.5, 12.5, 0.5}, {1, -0.4, 0.3});
  const Image seen = drawn(raster(), w, camera, knobs);
  const raster::Lighting& lighting = raster().rasterizer().lighting();
  EXPECT_EQ(lighting.luminaires(), 100000u);
  EXPECT_LE(lighting.cells().numbers().size(), raster::LightCells::kMostEntries);
  EXPECT_LE(lighting.cells().most_in_a_cell(), 2000u);
  EXPECT_LE(lighting.bytes(), uint64_t{64} << 20);
  // A ground of 0.061 lamps/m^2 of 40 W in red is lit everywhere.
  const Image8 shown = display_image(seen, knobs.exposure);
  EXPECT_GT(shown.pixels[3 * (kWidth * (kHeight - 5) + kWidth / 2)], 8);
}

TEST(LightCells, LeaveOutNoLightAboveTheCutoff) {
  std::vector<raster::LightCells::Light> lights;
  for (uint64_t i = 0; i < 500; ++i) {
    raster::LightCells::Light l;
    const auto at = [&](uint64_t k) { return world::uniform01_double(world::hash_combine(i, k)) * 200 - 100; };
    l.position = WorldPoint::from(at(1), at(2), at(3));
    l.intensity = 1 + std::abs(at(4));
    l.one_sided = i % 2 == 0;
    l.axis = glm::normalize(world::Vec3d(at(5), at(6), at(7)));
    l.half_angle = 0.2 + 0.01 * static_cast<double>(i % 150);
    lights.push_back(l);
  }
  const double cutoff = 0.05;
  const raster::LightCells cells = raster::LightCells::make(lights, cutoff);
  ASSERT_EQ(cells.cutoff(), cutoff);
  for (uint64_t i = 0; i < 2000; ++i) {
    const auto at = [&](uint64_t k) { return world::uniform01_double(world::hash_combine(i + 9000, k)) * 220 - 110; };
    const WorldPoint p = WorldPoint::from(at(1), at(2), at(3));
    const world::VoxelPos place{p.voxel.x >> cells.shift(), p.voxel.y >> cells.shift(), p.voxel.z >> cells.shift()};
    std::vector<bool> listed(lights.size());
    for (const uint32_t n : cells.everywhere()) listed[n] = true;
    for (const raster::LightCells::Cell& c : cells.cells())
      if (c.place == place)
        for (uint32_t k = 0; k < c.count; ++k) listed[cells.numbers()[c.first + k]] = true;
    for (size_t n = 0; n < lights.size(); ++n) {
      const world::Vec3d to = p - lights[n].position;
      const double r = glm::length(to);
      const bool inside = !lights[n].one_sided || glm::dot(to, lights[n].axis) > r * std::cos(lights[n].half_angle);
      if (inside && lights[n].intensity / (r * r) > cutoff) {
        EXPECT_TRUE(listed[n]) << n;
      }
    }
  }
}

TEST(LightCells, BoundTheirSizeForAnyLuminaires) {
  std::vector<raster::LightCells::Light> lights(20000);
  for (size_t i = 0; i < lights.size(); ++i) {
    lights[i].position = WorldPoint::from(static_cast<double>(i), 0, 0);
    lights[i].intensity = 1e9;
  }
  const raster::LightCells cells = raster::LightCells::make(lights, 1e-6);
  EXPECT_LE(cells.numbers().size(), raster::LightCells::kMostEntries);
  EXPECT_LE(cells.everywhere().size(), raster::LightCells::kMostEverywhere);
  EXPECT_GT(cells.cutoff(), 1e-6);
}

// --- media --------------------------------------------------------------------------------------------------------

Medium medium(const char* kind) {
  Medium m;
  m.name = m.kind = kind;
  m.position = WorldPoint::from(0, 14, 0);
  m.scattering = {0.02f, 0.025f, 0.03f}, m.absorption = {0.01f, 0.005f, 0.002f};
  m.emission = {30, 35, 45};
  m.half_extent = {22, 9, 30};
  m.normal = glm::normalize(world::Vec3f(0.2f, 1, 0.1f));
  m.scale_height = 6;
  return m;
}

TEST(RasterMedia, EveryKindHidesAndGlowsAsTheRayCasterHasIt) {
  const char* const kinds[] = {"homogeneous", "height_fog", "box_fog", "ellipsoid_fog", "halfspace_fog"};
  std::vector<std::vector<Medium>> cases;
  for (const char* kind : kinds) cases.push_back({medium(kind)});
  cases.push_back({medium("box_fog"), medium("ellipsoid_fog"), medium("height_fog")});  // overlapping
  World w = hills();
  world::EditBatch no_glass;
  no_glass.fill(box_at({}, {-30, 10, 10}, {-30, 25, 40}), world::kAir);
  apply(w, no_glass);
  for (const auto& media : cases) {
    w.media = media;
    expect_agreement(w, hill_cameras()[0].camera, {}, media[0].kind + (media.size() > 1 ? " and others" : ""));
  }
  // Hard cases A6 and A7: along the ground, and deep under the height at which the density is 1.
  Medium deep = medium("height_fog");
  deep.position = WorldPoint::from(0, 10000, 0), deep.scale_height = 20;
  w.media = {deep};
  const Image black = drawn(raster(), w, hill_cameras()[2].camera, {});
  for (const Rgb& p : black.pixels) ASSERT_TRUE(std::isfinite(p.r) && std::isfinite(p.g) && std::isfinite(p.b));
  w.media = {medium("height_fog")};
  expect_agreement(w, camera_at({}, {-60.2, 24.5, -3.4}, {1, 0, 0}), {}, "a level line of sight");
}

/// fog_light=unhidden is exact where the light is even and nothing is absorbed: what fog takes from the sky behind it
/// it gives of the sky around it, whatever its shape (hard cases' white furnace, of a medium).
TEST(RasterMedia, CantBeSeenInAnEvenSky) {
  World w(world::standard_blocks());
  w.environment = {};
  w.environment.sun_irradiance = {};
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {50, 60, 70};
  const Camera camera = camera_at({}, {-30.2, 14.5, -3.4}, {1, 0.1, 0.2});
  for (const char* kind : {"homogeneous", "height_fog", "box_fog", "ellipsoid_fog", "halfspace_fog"}) {
    Medium fog = medium(kind);
    fog.emission = {}, fog.absorption = {}, fog.anisotropy = 0.6f;
    w.media = {fog};
    for (const Image& image : {drawn(raster(), w, camera, {}), cast(w, camera, {})})
      for (const Rgb& p : image.pixels) {
        ASSERT_NEAR(p.r, 50, 50 * 2e-5) << kind;
        ASSERT_NEAR(p.g, 60, 60 * 2e-5) << kind;
        ASSERT_NEAR(p.b, 70, 70 * 2e-5) << kind;
      }
    RenderKnobs none;
    none.fog_light = FogLight::none;
    EXPECT_LT(drawn(raster(), w, camera, none).at(kWidth / 2, kHeight / 2).r, 49) << kind;
  }
}

/// Endless fog under the sun alone shows albedo * E p(cos), by the phase function of Henyey and Greenstein (Diffuse
/// Radiation in the Galaxy, 1941): more of it towards the sun than away from it.
TEST(RasterMedia, EndlessFogShowsThePhaseOfTheSun) {
  World w(world::standard_blocks());
  w.environment = {};
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};
  w.environment.sun_irradiance = {400, 300, 200};
  w.environment.sun_direction = glm::normalize(world::Vec3d(0.4, 0.5, -0.3));
  Medium fog = medium("homogeneous");
  fog.emission = {}, fog.anisotropy = 0.4f;
  w.media = {fog};
  for (const world::Vec3d forward : {world::Vec3d(0.4, 0.5, -0.3), world::Vec3d(-0.7, 0.1, 0.2)}) {
    const Camera camera = camera_at({}, {0.2, 14.5, 0.4}, forward);
    const PixelRays rays(camera, kWidth, kHeight);
    const int x = kWidth / 3, y = kHeight / 2;
    const double cosine = glm::dot(glm::normalize(rays.direction(x + 0.5, y + 0.5)), w.environment.sun_direction);
    const double g = fog.anisotropy, phase = (1 - g * g) / (4 * kPi * std::pow(1 + g * g - 2 * g * cosine, 1.5));
    const double expected = 0.02 / 0.03 * 400 * phase;
    EXPECT_NEAR(drawn(raster(), w, camera, {}).at(x, y).r, expected, 1e-4 * expected);
    EXPECT_NEAR(cast(w, camera, {}).at(x, y).r, expected, 1e-4 * expected);
  }
}

/// Fog of a box below a roof with a slit, under a sun in the zenith, beside a wall that hides nothing.
World beam() {
  World w(world::standard_blocks());
  world::EditBatch roof;
  roof.fill(box_at({}, {-20, 30, -20}, {19, 30, 19}), block(w, "stone"));
  roof.fill(box_at({}, {4, 30, -20}, {8, 30, 19}), world::kAir);
  apply(w, roof);
  w.environment = {};
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};
  w.environment.sun_irradiance = {400, 300, 200};
  w.environment.sun_direction = {0, 1, 0};
  Medium fog = medium("box_fog");
  fog.emission = {}, fog.anisotropy = 0.3f;
  fog.position = WorldPoint::from(0, 10, 0), fog.half_extent = {15, 10, 15};
  w.media = {fog};
  return w;
}

/// A beam through a slit 5 m wide, looked through level from outside: albedo * E p(90 degrees) exp(-sigma (20 - y))
/// (exp(-sigma a) - exp(-sigma b)), with [a, b] of the ray in the beam. Of n pieces of the 30 m at most two are wrong,
/// at the beam's edges: 2 / n of what all the fog would show.
TEST(RasterMedia, ASlitInARoofMakesABeam) {
  const World w = beam();
  const Camera camera = camera_at({}, {-25.5, 12.5, 0.5}, {1, 0, 0});
  const PixelRays rays(camera, kWidth, kHeight);
  const int x = kWidth / 2, y = kHeight / 2;
  const world::Vec3d d = glm::normalize(rays.direction(x + 0.5, y + 0.5));
  const double sigma = 0.03, g = 0.3, phase = (1 - g * g) / (4 * kPi * std::pow(1 + g * g - 2 * g * d.y, 1.5));
  // The ray is level but for half a pixel.
  const double y_beam = 12.5 + d.y * 32;
  const double lit = 0.02 / sigma * 400 * phase * std::exp(-sigma * (20 - y_beam));
  const double expected = lit * (std::exp(-sigma * (19 / d.x)) - std::exp(-sigma * (24 / d.x)));
  const double all = 0.02 / sigma * 400 * phase * -std::expm1(-sigma * 30);
  for (const int pieces : {4, 32, 256}) {
    RenderKnobs knobs;
    knobs.fog_sun_rays = pieces;
    knobs.sun_shadow = SunShadow::none;  // which surfaces alone have
    const double bound = 2 * all / pieces + 2e-3 * expected;
    EXPECT_NEAR(drawn(raster(), w, camera, knobs).at(x, y).r, expected, bound) << pieces;
    EXPECT_NEAR(cast(w, camera, knobs).at(x, y).r, expected, bound) << pieces;
  }
  EXPECT_GT(drawn(raster(), w, camera, {}).at(x, y).r, 0.99 * all);
}

TEST(RasterMedia, ShaftsOfLightAreTheRayCasters) {
  World w = hills();
  for (const char* const kind : {"homogeneous", "height_fog", "box_fog", "ellipsoid_fog", "halfspace_fog"}) {
    Medium fog = medium(kind);
    fog.emission = {}, fog.anisotropy = 0.4f;
    w.media = {fog};
    for (const int pieces : {1, 8}) {
      RenderKnobs knobs;
      knobs.fog_sun_rays = pieces;
      expect_agreement(w, hill_cameras()[0].camera, knobs, fmt::format("{}, {} pieces", kind, pieces));
    }
  }
}

/// Where nothing hides the sun and the fog is thin, any number of pieces is the closed form.
TEST(RasterMedia, WhatHidesNothingMakesNoShafts) {
  World w = beam();
  world::EditBatch none;
  none.fill(box_at({}, {-20, 30, -20}, {19, 30, 19}), world::kAir);
  apply(w, none);
  w.media[0].scattering = {2e-5f, 3e-5f, 4e-5f}, w.media[0].absorption = {};
  const Camera camera = camera_at({}, {-25.5, 12.5, 0.5}, {1, 0.1, 0.2});
  const Image whole = drawn(raster(), w, camera, {});
  for (const int pieces : {1, 7}) {
    RenderKnobs knobs;
    knobs.fog_sun_rays = pieces;
    for (const Image& image : {drawn(raster(), w, camera, knobs), cast(w, camera, knobs)})
      for (size_t i = 0; i < image.pixels.size(); ++i)
        ASSERT_NEAR(image.pixels[i].g, whole.pixels[i].g, 2e-3 * whole.pixels[i].g + 1e-9) << pieces;
  }
}

TEST(RasterMedia, RaysOfAbsentFogCostNothing) {
  RenderKnobs none, rays;
  rays.fog_sun_rays = 16;
  none.sun_shadow = rays.sun_shadow = SunShadow::none;
  const auto report = [&](const World& w, const RenderKnobs& knobs) {
    auto frame = raster().render(world::WorldView(w), hill_cameras()[0].camera, knobs, kWidth, kHeight);
    CHECK(frame.ok());
    uint64_t sent = 0;
    for (const PassReport& pass : frame->report.passes)
      if (pass.name == "upload") sent = pass.bytes;
    return std::make_pair(std::move(frame->image.pixels), sent);
  };
  World w = hills();
  report(w, none);  // sends what there is
  EXPECT_TRUE(report(w, rays) == report(w, none));
  w.media = {medium("box_fog")};  // which scatters
  report(w, none);
  EXPECT_EQ(report(w, none).second, 0u);
  EXPECT_GT(report(w, rays).second, 0u);  // the grid
  w.media[0].scattering = {};             // which only absorbs
  EXPECT_TRUE(report(w, rays).first == report(w, none).first);
}

// --- what a world doesn't call for --------------------------------------------------------------------------------

TEST(RasterLighting, AnAbsentOrPowerlessEffectCostsNothingAndChangesNothing) {
  World w = hills();
  const Camera camera = hill_cameras()[0].camera;
  const Image without = drawn(raster(), w, camera, {});
  EXPECT_EQ(raster().rasterizer().lighting().bytes(), 0u);
  // Hard case X1: no strength is none.
  Luminaire dark = luminaire("omni");
  dark.power = {};
  Medium clear = medium("box_fog");
  clear.absorption = {}, clear.scattering = {};
  w.luminaires = {dark}, w.media = {clear};
  EXPECT_EQ(drawn(raster(), w, camera, {}).pixels, without.pixels);
  EXPECT_EQ(raster().rasterizer().lighting().bytes(), 0u);
  // X3, X4: it comes and goes while the backend lives.
  dark.power = {5e4f, 5e4f, 5e4f}, dark.position = WorldPoint::from(10.5, 40, 20.5);
  w.luminaires = {dark};
  const Image with = drawn(raster(), w, camera, {});
  EXPECT_NE(with.pixels, without.pixels);
  EXPECT_GT(raster().rasterizer().lighting().bytes(), 0u);
  w.luminaires.clear();
  EXPECT_EQ(drawn(raster(), w, camera, {}).pixels, without.pixels);
  EXPECT_EQ(raster().rasterizer().lighting().bytes(), 0u);
}

TEST(RasterLuminaires, OnAPlaneOfAFaceGivesItNothingAndInASolidNothingAtAll) {  // hard cases S4 and S5
  World w = dark_room();
  w.luminaires = {luminaire("omni")};
  w.luminaires[0].power = {1e4f, 1e4f, 1e4f};
  w.luminaires[0].position = WorldPoint::from(6.5, 0, 6.5);  // the floor's own plane
  RenderKnobs knobs;
  knobs.textures = TextureFilter::off;
  const Camera down = camera_at({}, {6.1, 4.5, 6.2}, {0.01, -1, 0.02}, 30);
  for (const Rgb& p : drawn(raster(), w, down, knobs).pixels) ASSERT_EQ(p, Rgb{});
  w.luminaires[0].position = WorldPoint::from(6.5, -0.5, 6.5);  // in the floor
  for (const Rgb& p : drawn(raster(), w, in_the_room(), knobs).pixels) ASSERT_EQ(p, Rgb{});
  for (const Rgb& p : cast(w, in_the_room(), knobs).pixels) ASSERT_EQ(p, Rgb{});
}

// --- sky ----------------------------------------------------------------------------------------------------------

TEST(RasterSky, OfATimeOfDayIsTheRayCasters) {
  const World w = hills();
  for (const float hours : {5.0f, 8.0f, 12.5f, 20.2f, 23.5f}) {
    RenderKnobs knobs;
    knobs.time_of_day = hours;
    knobs.day_of_year = 100;
    knobs.exposure = hours < 6 || hours > 19 ? (hours > 20 ? 17.0f : 7.0f) : 0;
    expect_agreement(w, hill_cameras()[2].camera, knobs, std::to_string(hours) + " h");
  }
}

// --- textures -----------------------------------------------------------------------------------------------------

TEST(RasterTextures, AreTheRayCastersForEveryFilter) {
  const World w = hills();
  for (const TextureFilter filter :
       {TextureFilter::off, TextureFilter::point, TextureFilter::mip, TextureFilter::exact})
    for (const size_t camera : {size_t{0}, size_t{2}}) {
      RenderKnobs knobs;
      knobs.textures = filter;
      expect_agreement(w, hill_cameras()[camera].camera, knobs,
                       "filter " + std::to_string(static_cast<int>(filter)) + " camera " + std::to_string(camera),
                       filter == TextureFilter::point ? 0.99 : 0.999);
    }
}

TEST(RasterTextures, TiltNormalsAsTheRayCastersDo) {
  const World w = hills();
  RenderKnobs knobs;
  knobs.normal_detail = 0.5f;
  for (const size_t camera : {size_t{0}, size_t{2}}) {
    expect_agreement(w, hill_cameras()[camera].camera, knobs, "camera " + std::to_string(camera));
    const Camera& from = hill_cameras()[camera].camera;
    EXPECT_LT(share_within(drawn(raster(), w, from, knobs), drawn(raster(), w, from, {}), 2), 0.95);
  }
}

// --- occlusion ----------------------------------------------------------------------------------------------------

TEST(RasterSkyRays, OccludeAsTheRayCastersAmbientOcclusion) {
  World w = hills();
  world::EditBatch opaque_only;
  opaque_only.fill(box_at({}, {-64, 1, -64}, {63, 8, 63}), block(w, "stone"));
  opaque_only.fill(box_at({}, {-30, 10, 10}, {-30, 25, 40}), world::kAir);
  apply(w, opaque_only);
  RenderKnobs knobs;
  knobs.sky_rays = knobs.light_samples = 8;
  knobs.light_transport = LightTransport::ambient_occlusion;
  expect_agreement(w, hill_cameras()[0].camera, knobs, "sky rays");
}

}  // namespace
}  // namespace render
