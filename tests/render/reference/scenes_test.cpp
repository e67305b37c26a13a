// Scenes of light: what they claim of themselves.
#include <algorithm>

#include "tests/render/trace/trace_worlds.h"
#include "world/scenes/scene.h"

namespace render {
namespace {

using namespace world;

struct Shown {
  Scene scene;
  World world;
};
std::optional<Shown> shown(const std::string& name) {
  auto scene = load_scene(name);
  EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().message);
  if (!scene.ok()) return std::nullopt;
  ImportReport report;
  auto world = build_world(*scene, report);
  EXPECT_TRUE(world.ok()) << (world.ok() ? "" : world.error().message);
  if (!world.ok()) return std::nullopt;
  return Shown{std::move(*scene), std::move(*world)};
}

/// A narrow look from the scene's camera at one point.
double seen_at(const Shown& s, Vec3d point, int band) {
  Camera camera = Camera::from(s.scene.cameras[0]);
  camera.forward = glm::normalize(WorldPoint::from(point.x, point.y, point.z) - camera.position);
  camera.vertical_fov = 0.004;
  return mean_of(trace(s.world, camera, sampled(256), 4, 4).image).mean[band];
}

// Exercise 14.7: a green bottle on a white table in a night club that is lit in red only.
TEST(Nightclub, TheBottleIsBlackTheTableRedAndItsShadowBlack) {
  const auto club = shown("nightclub");
  ASSERT_TRUE(club);
  const double table = seen_at(*club, {25, 0, 22}, 0);
  EXPECT_GT(table, 10);
  for (const Vec3d point : {Vec3d(25, 0, 22), Vec3d(-2, 10, 6.5), Vec3d(-20, 0, -18)})
    EXPECT_EQ(seen_at(*club, point, 1) + seen_at(*club, point, 2), 0);  // nothing sends green or blue
  // The body's side, and the table behind it on the line from the lamp. What is left is light that comes over the wall,
  // and 4 % that the glass mirrors.
  EXPECT_LT(seen_at(*club, {-2, 10, 6.5}, 0), 0.1 * table);
  EXPECT_LT(seen_at(*club, {-14, 0, -17}, 0), 0.1 * table);
}

TEST(Furnace, EveryPointShinesWithTwo) {
  const auto furnace = shown("furnace");
  ASSERT_TRUE(furnace);
  const Image image = trace(furnace->world, Camera::from(furnace->scene.cameras[0]), sampled(64), 24, 16).image;
  expect_mean(image, {2, 2, 2}, "furnace");
}

TEST(Cornell, WallsColourWhatIsBesideThem) {
  const auto cornell = shown("cornell");
  ASSERT_TRUE(cornell);
  // The white back wall near the red and the green wall.
  const auto green_share = [&](double x) {
    return seen_at(*cornell, {x, 30, 112}, 1) / seen_at(*cornell, {x, 30, 112}, 0);
  };
  EXPECT_GT(green_share(4), 1.15 * green_share(106));
}

TEST(EveryScene, OfLightHasNoSampleThatIsNotFinite) {
  for (const char* name : {"cornell", "nightclub", "furnace", "caustics", "fog_volumes", "gobo"}) {
    const auto s = shown(name);
    ASSERT_TRUE(s) << name;
    for (const LightTransport transport : {LightTransport::path, LightTransport::photons, LightTransport::whitted,
                                           LightTransport::ambient_occlusion, LightTransport::direct}) {
      RenderKnobs knobs = sampled(2, SampleSequence::sobol);
      knobs.light_transport = transport;
      knobs.photons = 2000;
      const Frame f = trace(s->world, Camera::from(s->scene.cameras[0]), knobs, 48, 32);
      EXPECT_EQ(f.report.nan_samples, 0u) << name;
      for (const Rgb& p : f.image.pixels) ASSERT_TRUE(p.r >= 0 && p.g >= 0 && p.b >= 0 && p.max() < 1e9f) << name;
    }
  }
}

}  // namespace
}  // namespace render
