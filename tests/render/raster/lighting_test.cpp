// Luminaires and media of the rasterizer: how many there may be, what they cost, and limits that they must meet. That
// they look as the ray caster has them is claimed in tests/tools/agreement/rows.cpp.
#include <bit>
#include <cmath>

#include <gtest/gtest.h>

#include "render/image/display.h"
#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/lit_worlds.h"
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

/// By night over a ground of 1280 x 1280 m.
World lamps(int count) {
  World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-640, 0, -640}, {639, 0, 639}}, block(w, "stone"));
  apply(w, batch);
  w.environment = dark_room().environment;
  for (int i = 0; i < count; ++i) {
    Luminaire l = luminaire("omni");
    const uint64_t h = world::mix64(static_cast<uint64_t>(i) + 5);
    l.position = WorldPoint::from(static_cast<double>(h % 12800) / 10 - 640, 1.5 + static_cast<double>(h >> 60) * 0.2,
                                  static_cast<double>((h >> 20) % 12800) / 10 - 640);
    l.power = {40, 30, 20};
    w.luminaires.push_back(l);
  }
  return w;
}
const Camera kOverLamps = camera_at({}, {0.5, 12.5, 0.5}, {1, -0.4, 0.3});

TEST(RasterLuminaires, AHundredThousandAreDrawnFromListsOfBoundedLength) {
  const World w = lamps(100000);
  RenderKnobs knobs;
  knobs.exposure = 3;
  const Image seen = drawn(raster(), w, kOverLamps, knobs);
  const raster::Lighting& lighting = raster().rasterizer().lighting();
  EXPECT_EQ(lighting.luminaires(), 100000u);
  EXPECT_LE(lighting.cells().numbers().size(), LightCells::kMostEntries);
  EXPECT_LE(lighting.cells().most_in_a_cell(), 2000u);
  EXPECT_LE(lighting.bytes(), uint64_t{64} << 20);
  // A ground of 0.061 lamps/m^2 of 40 W in red is lit everywhere.
  const Image8 shown = display_image(seen, knobs.exposure);
  EXPECT_GT(shown.pixels[3 * (kWidth * (kHeight - 5) + kWidth / 2)], 8);
}

/// Of a small picture by rays, and how often it asked a luminaire.
uint64_t asked_by_rays(const World& w, float cutoff, Image& seen) {
  RenderKnobs knobs;
  knobs.exposure = 3, knobs.luminaire_cutoff = cutoff;
  auto frame = (*make_raycast_backend())->render(world::WorldView(w), kOverLamps, knobs, 24, 14);
  EXPECT_TRUE(frame.ok());
  seen = std::move(frame->image);
  for (const EffectWork& work : frame->report.work)
    if (work.name == "luminaires") return work.work;
  return 0;
}

/// What rays leave out gives less than the cut-off's share of white together, of any number of luminaires that the
/// lists can hold so.
TEST(RayLuminaires, AreAskedWhereTheyReachAndWhatIsLeftOutIsLessThanTheShareTogether) {
  const World w = lamps(2000);
  const float share = 1e-3f;
  Image near, all;
  const uint64_t asked = asked_by_rays(w, share, near), of_all = asked_by_rays(w, 0, all);
  EXPECT_GT(asked, 0u);
  EXPECT_LT(asked, of_all / 4);
  for (size_t i = 0; i < all.pixels.size(); ++i) {
    EXPECT_LE(near.pixels[i].r, all.pixels[i].r * (1 + 1e-6f));
    EXPECT_NEAR(near.pixels[i].r, all.pixels[i].r, share * kWhiteRadiance * std::exp2(-3) + 1e-6f * all.pixels[i].r);
  }
}

TEST(RayLuminaires, OfAHundredThousandAPointAsksNoMoreThanACellHolds) {
  const World w = lamps(100000);
  Image seen;
  const uint64_t asked = asked_by_rays(w, 1e-3f, seen);
  EXPECT_GT(asked, 0u);
  EXPECT_LE(asked, seen.pixels.size() * 2000);  // as the rasterizer's lists above
}

TEST(LightCells, LeaveOutNoLightAboveTheCutoff) {
  std::vector<LightCells::Light> lights;
  for (uint64_t i = 0; i < 500; ++i) {
    LightCells::Light l;
    const auto at = [&](uint64_t k) { return world::uniform01_double(world::hash_combine(i, k)) * 200 - 100; };
    l.position = WorldPoint::from(at(1), at(2), at(3));
    l.intensity = 1 + std::abs(at(4));
    l.one_sided = i % 2 == 0;
    l.axis = glm::normalize(world::Vec3d(at(5), at(6), at(7)));
    l.half_angle = 0.2 + 0.01 * static_cast<double>(i % 150);
    lights.push_back(l);
  }
  const double cutoff = 0.05;
  const LightCells cells = LightCells::make(lights, cutoff);
  ASSERT_EQ(cells.cutoff(), cutoff);
  for (uint64_t i = 0; i < 2000; ++i) {
    const auto at = [&](uint64_t k) { return world::uniform01_double(world::hash_combine(i + 9000, k)) * 220 - 110; };
    const WorldPoint p = WorldPoint::from(at(1), at(2), at(3));
    std::vector<bool> listed(lights.size());
    for (const uint32_t n : cells.everywhere()) listed[n] = true;
    for (const uint32_t n : cells.near(p.voxel)) listed[n] = true;
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
  std::vector<LightCells::Light> lights(20000);
  for (size_t i = 0; i < lights.size(); ++i) {
    lights[i].position = WorldPoint::from(static_cast<double>(i), 0, 0);
    lights[i].intensity = 1e9;
  }
  const LightCells cells = LightCells::make(lights, 1e-6);
  EXPECT_LE(cells.numbers().size(), LightCells::kMostEntries);
  EXPECT_LE(cells.everywhere().size(), LightCells::kMostEverywhere);
  EXPECT_GT(cells.cutoff(), 1e-6);
}

// --- media --------------------------------------------------------------------------------------------------------

TEST(RasterMedia, AreFiniteAlongTheGroundAndDeepUnderTheHeightAtWhichTheirDensityIsOne) {  // hard cases A6 and A7
  World w = hills();
  Medium deep = medium("height_fog");
  deep.position = WorldPoint::from(0, 10000, 0), deep.scale_height = 20;
  w.media = {deep};
  const Image black = drawn(raster(), w, hill_cameras()[2].camera, {});
  for (const Rgb& p : black.pixels) ASSERT_TRUE(std::isfinite(p.r) && std::isfinite(p.g) && std::isfinite(p.b));
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
  for (const int pieces : {4, 64}) {
    RenderKnobs knobs;
    knobs.fog_sun_rays = pieces;
    knobs.sun_shadow = SunShadow::none;  // which surfaces alone have
    const double bound = 2 * all / pieces + 2e-3 * expected;
    EXPECT_NEAR(drawn(raster(), w, camera, knobs).at(x, y).r, expected, bound) << pieces;
    EXPECT_NEAR(cast(w, camera, knobs).at(x, y).r, expected, bound) << pieces;
  }
  EXPECT_GT(drawn(raster(), w, camera, {}).at(x, y).r, 0.99 * all);
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
  raster().draw_bare(true);       // to be sent the grid no picture need be shaded, by what is 13 s in the making
  report(w, none);
  EXPECT_EQ(report(w, none).second, 0u);
  EXPECT_GT(report(w, rays).second, 0u);  // the grid
  raster().draw_bare(false);
  w.media[0].scattering = {};  // which only absorbs
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

/// Software runs the code of all kinds that a shader has for each luminaire. Of an omni nothing is seen itself: what a
/// shader would read of those is an empty buffer, of the numbers that it reads.
TEST(RasterLighting, ShadersHaveTheKindsOfLuminairesThatShineAndThoseChangeNoOther) {
  World w = hills();
  const Camera camera = hill_cameras()[0].camera;
  Luminaire bright = luminaire("omni"), faint = luminaire("rectangle"), off = luminaire("spot");
  bright.power = {5e4f, 5e4f, 5e4f}, bright.position = WorldPoint::from(10.5, 40, 20.5);
  faint.power = {1e-9f, 1e-9f, 1e-9f}, faint.position = WorldPoint::from(0, 60, 0);
  off.power = {};
  const auto kinds = [] { return raster().rasterizer().lighting().variant().luminaire_kinds; };
  w.luminaires = {bright, off};
  const Image alone = drawn(raster(), w, camera, {});
  const uint32_t of_omni = kinds();
  EXPECT_EQ(std::popcount(of_omni), 1);
  w.luminaires = {bright, faint, off};
  EXPECT_EQ(share_within(drawn(raster(), w, camera, {}), alone, 1), 1);
  EXPECT_EQ(std::popcount(kinds()), 2);
  EXPECT_EQ(kinds() & of_omni, of_omni);
  w.luminaires = {bright};
  EXPECT_EQ(drawn(raster(), w, camera, {}).pixels, alone.pixels);
  EXPECT_EQ(kinds(), of_omni);
  w.luminaires.clear();
  drawn(raster(), w, camera, {});
  EXPECT_EQ(kinds(), 0u);
  EXPECT_EQ(raster().messages(), std::vector<std::string>{});
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

}  // namespace
}  // namespace render
