// Meshes of the rasterizer, against the ray caster at direct light.
#include <cmath>

#include <gtest/gtest.h>

#include "render/image/display.h"
#include "render/image/flip.h"
#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "render/raster/triangles.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/small_meshes.h"
#include "tests/render/raster/small_worlds.h"
#include "tests/support.h"

namespace render {
namespace {

using world::MeshInstance;
using world::Vec3d;
using world::World;
using world::WorldPoint;

constexpr int kWidth = 320, kHeight = 180;

RasterBackend& raster() {
  static const std::unique_ptr<RasterBackend> backend = [] {
    auto made = make_raster({.validation = true});
    CHECK(made.ok());
    return std::move(*made);
  }();
  return *backend;
}

Frame drawn(Backend& backend, const World& w, const Camera& camera, const RenderKnobs& knobs) {
  auto frame = backend.render(world::WorldView(w), camera, knobs, kWidth, kHeight);
  if (!frame.ok()) ADD_FAILURE() << frame.error().message;
  return frame.ok() ? std::move(*frame) : Frame{Image(kWidth, kHeight), {}};
}

uint64_t draws_of(const FrameReport& report, std::string_view pass) {
  for (const PassReport& p : report.passes)
    if (p.name == pass) return p.draws;
  return 0;
}

/// 99.95 % of pixels within 2/255, FLIP's mean below 0.002. What is left lies on edges of
/// triangles, which the device rounds to 1/256 of a pixel, and on edges of their shadows.
void expect_meshes_agree(const World& w, const Camera& camera, RenderKnobs knobs, const std::string& what) {
  // Layers and coarser levels are other tests'.
  knobs.transparency = Transparency::opaque, knobs.lod_error_px = 0;
  const Frame a = drawn(raster(), w, camera, knobs);
  auto caster = make_raycast_backend();
  const Frame b = drawn(**caster, w, camera, knobs);
  const Image8 x = display_image(a.image, knobs.exposure), y = display_image(b.image, knobs.exposure);
  size_t within = 0;
  for (size_t i = 0; i < x.pixels.size(); i += 3) {
    int worst = 0;
    for (size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(x.pixels[i + c] - y.pixels[i + c]));
    within += worst <= 2;
  }
  const double share = 3.0 * static_cast<double>(within) / static_cast<double>(x.pixels.size());
  std::printf("%-40s %.4f %% within 2/255, FLIP %.5f\n", what.c_str(), 100 * share, flip_map(x, y).mean);
  EXPECT_GE(share, 0.9995) << what;
  EXPECT_LT(flip_map(x, y).mean, 0.002) << what;
  EXPECT_GT(draws_of(a.report, "meshes"), 0u) << what << ": no mesh is in the picture";
  EXPECT_EQ(raster().messages(), std::vector<std::string>{}) << what;
}

/// The hills without glass and water, which hold light back from the ray caster's shadow rays alone.
World dry_hills(world::VoxelPos offset = {}) {
  World w = hills(offset);
  const world::BlockId water = block(w, "water"), glass = block(w, "glass");
  world::EditBatch batch;
  for (int x = -64; x < 64; ++x)
    for (int y = 0; y < 32; ++y)
      for (int z = -64; z < 64; ++z) {
        const world::VoxelPos at = offset + world::VoxelPos{x, y, z};
        const world::BlockId id = w.store.get(at);
        if (id == water || id == glass) batch.set(at, block(w, "sand"));
      }
  apply(w, batch);
  return w;
}

/// One of each kind over the hills: round and faceted, mirrored, checkered, seen from behind, glowing, and one that
/// only bounds a medium.
std::vector<MeshInstance> meshes_of_each_kind(const World& w, world::VoxelPos offset = {}) {
  std::vector<MeshInstance> all;
  MeshInstance smooth = instance(w, ball(5, 48), "brick_red", offset, {2.3, 30.4, 20.7});
  smooth.smooth = true;
  all.push_back(smooth);
  all.push_back(instance(w, ball(4, 10), "marble", offset, {-9.6, 26.1, 12.2},
                         glm::dmat3({1, 0.3, 0}, {0, 1.4, 0.2}, {0.1, 0, 0.8})));
  MeshInstance mirrored = instance(w, ball(4, 32), "gold_block", offset, {14.1, 25.2, 14.4},
                                   glm::dmat3({-1.1, 0, 0.2}, {0, 0.8, 0}, {0.3, 0, 1}));
  mirrored.smooth = true;
  all.push_back(mirrored);
  MeshInstance checkered =
      instance(w, sheet(7), "marble", offset, {-2.2, 22.4, 24.1}, glm::dmat3(1, 0.1, 0, 0, 1, 0.2, 0, 0, 1));
  checkered.checker_block = "obsidian", checkered.checker_id = block(w, "obsidian");
  checkered.checkers = {6, 9};
  all.push_back(checkered);
  all.push_back(
      instance(w, sheet(5), "grass", offset, {20.2, 38.1, 5.3}, glm::dmat3({1, 0.4, 0}, {0, -1, 0}, {0, 0.3, 1})));
  MeshInstance glowing =
      instance(w, sheet(2), "air", offset, {-14.5, 31.2, 20.6}, glm::dmat3({1, 0, 0}, {0, 0, 1}, {0, -1, 0}));
  glowing.block = "", glowing.radiance = {60, 40, 20};
  all.push_back(glowing);
  MeshInstance null = instance(w, ball(3, 16), "air", offset, {3.1, 26.2, 34.4});
  null.block = "", null.null_surface = true;
  all.push_back(null);
  return all;
}

Camera over_the_hills(world::VoxelPos offset = {}) { return camera_at(offset, {4.3, 36.2, 52.4}, {-0.07, -0.3, -1}); }

TEST(RasterMeshes, AreWhatTheRayCasterShows) {
  World w = dry_hills();
  w.meshes = meshes_of_each_kind(w);
  expect_meshes_agree(w, over_the_hills(), {}, "each kind");
  expect_meshes_agree(w, camera_at({}, {30.2, 34.1, -14.6}, {-0.8, -0.25, 0.9}), {}, "each kind, from behind");
  RenderKnobs near;
  near.view_distance = 40;
  expect_meshes_agree(w, over_the_hills(), near, "each kind, within 40 m");
}

TEST(RasterMeshes, AreTheSameTenThousandKilometresFromTheOrigin) {
  constexpr world::VoxelPos kFar{10'000'000, 0, -10'000'000};
  World w = dry_hills(kFar), here = dry_hills();
  w.meshes = meshes_of_each_kind(w, kFar);
  here.meshes = meshes_of_each_kind(here);
  expect_meshes_agree(w, over_the_hills(kFar), {}, "far out");
  const Image a = drawn(raster(), w, over_the_hills(kFar), {}).image,
              b = drawn(raster(), here, over_the_hills(), {}).image;
  size_t same = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i) same += a.pixels[i] == b.pixels[i];
  EXPECT_EQ(same, a.pixels.size());
}

TEST(RasterMeshes, AreLitByTheSkyOfATimeOfDay) {
  World w = dry_hills();
  w.meshes = meshes_of_each_kind(w);
  RenderKnobs knobs;
  knobs.time_of_day = 8.5f;
  expect_meshes_agree(w, over_the_hills(), knobs, "half past eight");
}

TEST(RasterMeshes, ThrowShadowsOfLuminaires) {
  World w = room();
  world::EditBatch batch;
  batch.set({8, 5, 8}, world::kAir);
  apply(w, batch);
  w.environment.sun_irradiance = {};
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};
  MeshInstance round = instance(w, ball(1.2, 40), "gold_block", {}, {7.2, 1.2, 6.1});
  round.smooth = true;
  w.meshes = {round,
              instance(w, sheet(1), "brick_red", {}, {3.4, 3.1, 8.2}, glm::dmat3({1, 0.3, 0}, {0, 1, 0}, {0, 0.5, 1}))};
  const Camera camera = camera_at({}, {1.3, 3.7, 1.2}, {1, -0.35, 0.9}, 75);
  for (const char* kind : {"omni", "rectangle"}) {
    world::Luminaire l;
    l.name = l.kind = kind;
    l.position = WorldPoint::from(6.4, 5.2, 7.3);
    l.power = {900, 700, 500};
    l.extent = {1.5f, 0.8f};
    w.luminaires = {l};
    RenderKnobs knobs;
    knobs.exposure = 5;
    expect_meshes_agree(w, camera, knobs, kind);
    knobs.luminaire_shadow = LuminaireShadow::none;
    expect_meshes_agree(w, camera, knobs, std::string(kind) + " without shadows");
  }
}

TEST(RasterMeshes, OfFilesAreWhatTheRayCasterShows) {
  struct File {
    const char* name;
    double scale;
    Vec3d at;
  };
  for (const File& file :
       {File{"mesh/teapot.obj", 2, {0.4, 24.3, 20.2}}, File{"mesh/stanford-bunny.obj", 60, {0.4, 24.3, 20.2}},
        File{"mesh/spot.obj", 5, {0.4, 24.3, 20.2}},
        File{"gt/mitsuba/meshes/cbox/smallbox.obj", 0.05, {-8.4, 24.3, 12.2}}}) {
    const auto path = world::shared_data(file.name);
    if (!path) continue;
    world::MeshReport report;
    auto mesh = world::read_mesh_file(*path, report);
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    World w = dry_hills();
    MeshInstance m = instance(w, std::make_shared<const world::TriangleMesh>(std::move(*mesh)), "marble", {}, file.at,
                              glm::dmat3(file.scale));
    w.meshes = {m};
    expect_meshes_agree(w, camera_at({}, {3.3, 34.2, 38.4}, {-0.1, -0.4, -1}), {}, file.name);
  }
}

TEST(RasterMeshes, AreNotCutByTheNearPlane) {
  World w = dry_hills();
  for (const double gap : {0.3, 0.02, 0.003}) {
    w.meshes = {
        instance(w, sheet(4), "brick_red", {}, {2.5, 40.0, 20.5}, glm::dmat3({1, 0, 0}, {0, 0, 1}, {0, -1, 0}))};
    expect_meshes_agree(w, camera_at({}, {2.5, 40.2, 20.5 + gap}, {0.3, 0.1, -1}, 80), {},
                        "a sheet " + std::to_string(gap) + " m before the eye");
  }
}

/// In a pool of mercury, and through a pane of glass. Against the tracer, which mirrors and bends by code of its
/// own: 99.95 % of pixels within 2/255, through glass within 4/255, where the tracer has what the pane mirrors within
/// itself.
TEST(RasterMeshes, AreSeenInMirrorsAndThroughGlass) {
  for (const bool pool : {true, false}) {
    World w(world::standard_blocks());
    world::EditBatch batch;
    batch.fill({{-20, -1, -20}, {20, -1, 20}}, block(w, "plaster"));
    if (pool)
      batch.fill({{-8, -1, -8}, {8, -1, 8}}, block(w, "mercury"));
    else
      batch.fill({{-9, 0, 4}, {9, 8, 4}}, block(w, "glass"));
    apply(w, batch);
    MeshInstance round = instance(w, ball(2, 32), "brick_red", {}, {1.3, 3.4, -2.7});
    round.smooth = true;
    w.meshes = {round, instance(w, ball(1.5, 10), "marble", {}, {-3.2, 2.6, 0.4})};
    const Camera camera = camera_at({}, {-3.3, 4.2, 12.4}, {0.1, -0.15, -1});
    RenderKnobs knobs;
    knobs.textures = TextureFilter::off, knobs.lod_error_px = 0;
    knobs.reflection = Reflection::traced, knobs.refraction = Refraction::traced;
    knobs.tinted_shadows = true;
    const Image shown = drawn(raster(), w, camera, knobs).image;
    knobs.light_transport = LightTransport::whitted;
    auto caster = make_raycast_backend();
    const Image8 x = display_image(shown, 0), y = display_image(drawn(**caster, w, camera, knobs).image, 0);
    size_t within = 0;
    for (size_t i = 0; i < x.pixels.size(); i += 3) {
      int worst = 0;
      for (size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(x.pixels[i + c] - y.pixels[i + c]));
      within += worst <= (pool ? 2 : 4);
    }
    const double share = 3.0 * static_cast<double>(within) / static_cast<double>(x.pixels.size());
    std::printf("%s: %.4f %% of pixels within %d/255 of the tracer\n", pool ? "in a pool" : "through glass",
                100 * share, pool ? 2 : 4);
    EXPECT_GE(share, 0.9995);
  }
  EXPECT_EQ(raster().messages(), std::vector<std::string>{});
}

TEST(RasterMeshes, CallForAPassOnlyWhereTheWorldHasSome) {
  World w = dry_hills();
  const auto passes = [&] {
    std::vector<std::string> names;
    for (const PassReport& p : drawn(raster(), w, over_the_hills(), {}).report.passes) names.push_back(p.name);
    return names;
  };
  w.meshes = meshes_of_each_kind(w);
  const std::vector<std::string> with = passes();
  EXPECT_EQ(std::count(with.begin(), with.end(), "meshes"), 1);
  EXPECT_GT(raster().rasterizer().triangles().bytes(), 0u);
  // A null surface is drawn by nothing.
  w.meshes = {w.meshes.back()};
  const std::vector<std::string> null = passes();
  EXPECT_EQ(std::count(null.begin(), null.end(), "meshes"), 0);
  w.meshes.clear();
  const std::vector<std::string> without = passes();
  EXPECT_EQ(std::count(without.begin(), without.end(), "meshes"), 0);
  EXPECT_EQ(raster().rasterizer().triangles().bytes(), 0u);
}

TEST(RasterMeshes, ThatABufferCannotHoldAreLeftOutAndNamed) {
  World w = dry_hills();
  w.meshes = meshes_of_each_kind(w);
  auto small = make_raster({.validation = true});
  ASSERT_TRUE(small.ok());
  raster::TriangleList list;
  ASSERT_TRUE(raster::add_meshes(w, list).ok());
  raster::DrawnTriangles triangles;
  triangles.binding_limit = 4096;
  const auto sent = triangles.set((*small)->rasterizer().device(), list, "meshes");
  ASSERT_TRUE(sent.ok());
  EXPECT_EQ(*sent, 0u);
  EXPECT_TRUE(triangles.empty());
  ASSERT_EQ(triangles.dropped().size(), 1u);
  EXPECT_NE(triangles.dropped()[0].find("meshes"), std::string::npos);
}

TEST(RasterMeshes, AtTheWorldsBorderAreAnError) {
  World w = dry_hills();
  w.meshes = {instance(w, sheet(50), "marble", {}, {0, 0, 0})};
  w.meshes[0].position.voxel.x = static_cast<int32_t>(world::kWorldBorder) - 2;
  raster::TriangleList list;
  const world::Status status = raster::add_meshes(w, list);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("reaches outside the world"), std::string::npos);
}

}  // namespace
}  // namespace render
