/// Pictures of smooth surfaces: the sky on any normal, and a ball's level set against the ball itself.
#include <cmath>

#include <gtest/gtest.h>

#include "render/raycast/raycast.h"
#include "render/shading.h"
#include "world/world.h"

namespace render {
namespace {

using namespace world;

TEST(SkyIrradiance, OnAnyNormalEqualsTheFacesFormsAndTheIntegral) {
  const Environment e;
  for (int face = 0; face < kFaces; ++face) {
    const Irradiance3 on_face = sky_irradiance(e, face);
    const Irradiance3 on_normal = sky_irradiance(e, Vec3d(face_step(face).x, face_step(face).y, face_step(face).z));
    EXPECT_NEAR(on_normal.r, on_face.r, 1e-5 * on_face.r);
    EXPECT_NEAR(on_normal.b, on_face.b, 1e-5 * on_face.b);
  }
  // Midpoint rule, 800 x 1600 in (y, turn): its error falls with the cell's size where the hemisphere's border cuts it.
  for (const double cosine : {-0.9, -0.35, 0.2, 0.77}) {
    const Vec3d normal(std::sqrt(1 - cosine * cosine), cosine, 0);
    double sum = 0;
    constexpr int kRows = 800, kTurns = 1600;
    for (int i = 0; i < kRows; ++i)
      for (int j = 0; j < kTurns; ++j) {
        const double y = 2 * (i + 0.5) / kRows - 1, turn = 2 * M_PI * (j + 0.5) / kTurns, r = std::sqrt(1 - y * y);
        const Vec3d w(r * std::cos(turn), y, r * std::sin(turn));
        sum += sky_radiance(e, y).g * std::max(0.0, glm::dot(w, normal));
      }
    const double integral = sum * 4 * M_PI / (double(kRows) * kTurns);
    EXPECT_NEAR(sky_irradiance(e, normal).g, integral, 1e-4 * integral) << cosine;
  }
}

TEST(SkyIrradiance, OfTheHazeBelowTheHorizonIsRightToAMillionth) {
  for (int i = 0; i <= 180; ++i) {
    const double y = std::cos(M_PI * i / 180), s = std::sqrt(std::max(0.0, 1 - y * y));
    // Midpoint rule over heights, whose rings have a closed form.
    double sum = 0;
    constexpr int kRings = 20000;
    for (int k = 0; k < kRings; ++k) {
      const double height = -shared::kHazeDepth * (k + 0.5) / kRings, up = y * height;
      const double aside = s * std::sqrt(1 - height * height);
      const double half_turn = aside > 0 ? std::acos(std::clamp(-up / aside, -1.0, 1.0)) : up > 0 ? M_PI : 0;
      const double u = -height / shared::kHazeDepth;
      sum += (1 - u * u * (3 - 2 * u)) * 2 * (up * half_turn + aside * std::sin(half_turn));
    }
    EXPECT_NEAR(shared::haze_irradiance(static_cast<float>(y)), sum * shared::kHazeDepth / kRings, 1e-6) << y;
  }
}

TEST(LinearSky, GoesOverIntoTheGroundWithoutALine) {
  const Environment e;
  EXPECT_EQ(sky_radiance(e, -1), e.sky_ground);
  EXPECT_EQ(sky_radiance(e, -0.18), e.sky_ground);
  EXPECT_EQ(sky_radiance(e, -1e-9), e.sky_horizon);
  for (double y = -0.2; y < 0.2; y += 1e-3)  // 1.5 / kHazeDepth is how steep the blend is at most
    EXPECT_LE(std::abs(sky_radiance(e, y + 1e-3).b - sky_radiance(e, y).b),
              1.01e-3 * std::max(1.5 / 0.17 * std::abs(e.sky_horizon.b - e.sky_ground.b),
                                 1.0 * std::abs(e.sky_zenith.b - e.sky_horizon.b)) +
                  1e-5)
        << y;
}

/// A ball of 12 m at the origin, as a level set with its blocks.
constexpr double kRadius = 12;
World ball() {
  World world;
  Block white;
  white.name = "white";
  white.albedo = {0.8f, 0.8f, 0.8f};
  const BlockId id = world.palette->add(white).value();
  FloatLayer& distance = world.store.make_layer(Layer::distance);
  EditBatch batch;
  for (int x = -16; x < 16; ++x)
    for (int y = -16; y < 16; ++y)
      for (int z = -16; z < 16; ++z) {
        const double d = glm::length(Vec3d(x + 0.5, y + 0.5, z + 0.5)) - kRadius;
        if (std::abs(d) < 3) distance.set({x, y, z}, static_cast<float>(d));
        if (d <= 0) batch.set({x, y, z}, id);
      }
  EXPECT_TRUE(world.store.apply(batch).ok());
  return world;
}

TEST(RaycastContours, ShowABallAsTheBallItself) {
  const World world = ball();
  Camera camera;
  camera.position = WorldPoint::from(22, 17, 31);
  camera.forward = glm::normalize(Vec3d(-22, -17, -31));
  camera.vertical_fov = 0.8;
  constexpr int kSize = 160;
  const Shading shading(world.environment, *world.palette);
  const PixelRays rays(camera, kSize, kSize);
  double error[3] = {0, 0, 0};
  for (const ContourShape shape : {ContourShape::off, ContourShape::planes, ContourShape::field}) {
    RenderKnobs knobs;
    knobs.contours = shape;
    const WorldView view(world);
    auto backend = make_raycast_backend();
    ASSERT_TRUE(backend.ok());
    const auto frame = (*backend)->render(view, camera, knobs, kSize, kSize);
    ASSERT_TRUE(frame.ok());
    double worst = 0, sum = 0;
    int count = 0;
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const Vec3d d = glm::normalize(rays.direction(x + 0.5, y + 0.5)), from(22, 17, 31);
        const double b = glm::dot(from, d), under = b * b - glm::dot(from, from) + kRadius * kRadius;
        ASSERT_TRUE(std::isfinite(frame->image.at(x, y).g));
        if (under < kRadius * kRadius * 0.1) continue;  // not at the silhouette
        const Vec3d normal = (from + d * (-b - std::sqrt(under))) / kRadius;
        const double expected = normal_radiance(shading, world.environment, 1, normal, 1).g;
        const double difference = std::abs(frame->image.at(x, y).g - expected) / expected;
        worst = std::max(worst, difference), sum += difference, ++count;
      }
    ASSERT_GT(count, 5000);
    error[static_cast<int>(shape)] = sum / count;
    std::printf("%d: mean %.4f worst %.4f\n", static_cast<int>(shape), sum / count, worst);
  }
  EXPECT_GT(error[0], 0.1);
  // Normals are 60 / R + 0.3 degrees off at worst, 1 degree in the mean; an irradiance changes by its tangent.
  EXPECT_LT(error[1], 0.02);
  EXPECT_LT(error[2], 0.003);  // second order: measured 0.0010
}

TEST(RaycastContours, LeaveAWorldWithoutALevelSetAsItIs) {
  World world = ball();
  world.store.drop_layer(Layer::distance);
  Camera camera;
  camera.position = WorldPoint::from(22, 17, 31);
  camera.forward = glm::normalize(Vec3d(-22, -17, -31));
  Image images[2];
  for (const ContourShape shape : {ContourShape::off, ContourShape::field}) {
    RenderKnobs knobs;
    knobs.contours = shape;
    const WorldView view(world);
    auto frame = (*make_raycast_backend())->render(view, camera, knobs, 64, 64);
    ASSERT_TRUE(frame.ok());
    images[shape != ContourShape::off] = std::move(frame->image);
  }
  for (size_t i = 0; i < images[0].pixels.size(); ++i) ASSERT_EQ(images[0].pixels[i].g, images[1].pixels[i].g);
}

}  // namespace
}  // namespace render
