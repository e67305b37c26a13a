// Boxes, prisms and cones that a scene fills in.
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "world/scenes/scene.h"

namespace world {
namespace {

constexpr const char* kEmpty = "[world]\ngenerator = \"empty\"\nsize = [8, 8, 8]\n";

Result<Scene> scene_of(const std::string& text) {
  TemporaryFolder folder;
  std::ofstream(folder / "a.toml") << text;
  return load_scene((folder / "a.toml").string());
}

World world_of(const std::string& text) {
  const auto scene = scene_of(kEmpty + text);
  EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().message);
  ImportReport report;
  auto world = build_world(*scene, report);
  EXPECT_TRUE(world.ok()) << (world.ok() ? "" : world.error().message);
  return std::move(*world);
}

TEST(Fills, AnEmptyWorldHoldsNothing) { EXPECT_EQ(world_of("").store.voxel_count(), 0u); }

TEST(Fills, APrismHoldsTheVoxelsWhoseCentresLieInItsOutline) {
  // A square of side 10 turned by 30 degrees, in either order of its corners.
  const double c = std::cos(0.5235988), s = std::sin(0.5235988);
  const auto inside = [&](double x, double z) {
    const double u = c * (x - 20) + s * (z - 20), v = -s * (x - 20) + c * (z - 20);
    return std::abs(u) < 5 && std::abs(v) < 5;
  };
  for (const bool reversed : {false, true}) {
    std::string corners;
    for (int i = 0; i < 4; ++i) {
      const int k = reversed ? 3 - i : i;
      const double u = k == 0 || k == 3 ? -5 : 5, v = k < 2 ? -5 : 5;
      corners += std::to_string(20 + c * u - s * v) + ", " + std::to_string(20 + s * u + c * v) + (i < 3 ? ", " : "");
    }
    const World world = world_of("[[prism]]\ncorners = [" + corners + "]\ny = [2, 4]\nblock = \"stone\"\n");
    uint64_t voxels = 0;
    for (int x = 10; x < 30; ++x)
      for (int z = 10; z < 30; ++z)
        for (int y = 0; y < 7; ++y) {
          const bool expected = y >= 2 && y <= 4 && inside(x + 0.5, z + 0.5);
          voxels += expected;
          EXPECT_EQ(world.store.get({x, y, z}) != kAir, expected) << x << ' ' << y << ' ' << z;
        }
    EXPECT_EQ(world.store.voxel_count(), voxels);
  }
}

TEST(Fills, AConeHoldsTheVoxelsWhoseCentresLieInItsCircles) {
  const World world = world_of("[[cone]]\ncentre = [0.25, -0.5]\ny = [-2, 6]\nradius = [7.3, 2]\nblock = \"stone\"\n");
  uint64_t voxels = 0;
  for (int x = -10; x < 10; ++x)
    for (int z = -10; z < 10; ++z)
      for (int y = -4; y < 8; ++y) {
        const double r = 7.3 + (2 - 7.3) * (y + 0.5 + 2) / 8;
        const bool expected = y >= -2 && y < 6 && std::hypot(x + 0.25, z + 1.0) < r;
        voxels += expected;
        EXPECT_EQ(world.store.get({x, y, z}) != kAir, expected) << x << ' ' << y << ' ' << z;
      }
  EXPECT_EQ(world.store.voxel_count(), voxels);
}

TEST(Fills, WhatIsWrongIsNamed) {
  const auto error_of = [](const std::string& text) {
    const auto scene = scene_of(kEmpty + text);
    return scene.ok() ? "" : scene.error().message;
  };
  EXPECT_NE(error_of("[[prism]]\ny = [2, 4]\nblock = \"stone\"\n").find("corners"), std::string::npos);
  EXPECT_NE(error_of("[[cone]]\ncentre = [0, 0]\ny = [3, 1]\nradius = [1, 1]\nblock = \"stone\"\n").find("must rise"),
            std::string::npos);
  EXPECT_NE(error_of("[[cone]]\ncentre = [0, 0]\ny = [1, 3]\nradius = [1, -1]\nblock = \"stone\"\n").find("radius"),
            std::string::npos);
  // Fifty bytes that stand for 3e8 rows, and two prisms that are one row too many together.
  EXPECT_NE(error_of("[[cone]]\ncentre = [0, 0]\ny = [0, 9999]\nradius = [1e4, 1e4]\nblock = \"stone\"\n").find("2^20"),
            std::string::npos);
  const std::string prism = "[[prism]]\ncorners = [0, 0, 9, 0, 9, 524288, 0, 524288]\ny = [0, 0]\nblock = \"stone\"\n";
  EXPECT_TRUE(scene_of(kEmpty + prism + prism).ok());
  EXPECT_NE(error_of(prism + prism + "[[prism]]\ncorners = [0, 0, 9, 0, 9, 1, 0, 1]\ny = [0, 0]\nblock = \"stone\"\n")
                .find("2^20"),
            std::string::npos);
}

TEST(Cameras, ALensHasARadiusAndADistanceOfFocus) {
  const auto scene = scene_of(std::string(kEmpty) +
                              "[[camera]]\nname = \"a\"\nposition = [0, 0, 0]\nlens_radius_m = 0.25\n"
                              "focus_distance_m = 12\n[[camera]]\nname = \"b\"\nposition = [0, 0, 0]\n");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(scene->cameras[0].lens_radius_m, 0.25);
  EXPECT_EQ(scene->cameras[0].focus_distance_m, 12);
  EXPECT_EQ(scene->cameras[1].lens_radius_m, 0);
  const auto wrong =
      scene_of(std::string(kEmpty) + "[[camera]]\nname = \"a\"\nposition = [0, 0, 0]\nlens_radius_m = -1\n");
  EXPECT_FALSE(wrong.ok());
}

}  // namespace
}  // namespace world
