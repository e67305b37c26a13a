#include "render/light_files.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "render/image/display.h"
#include "render/image/png_exr.h"
#include "tests/support.h"
#include "world/base/random.h"

namespace render {
namespace {

using world::Luminaire;

world::World with(const Luminaire& luminaire) {
  world::World world;
  world.luminaires = {luminaire};
  return world;
}

Luminaire sky(const std::string& image) {
  Luminaire l;
  l.name = l.kind = "hemisphere";
  l.axis = {0, 1, 0}, l.radiance = {1, 1, 1}, l.whole_sphere = true;
  l.image = image, l.where = "scene.toml:7:1";
  return l;
}

TEST(LightFiles, APngIsMadeLinearAndAnExrIsTakenAsItIs) {
  const world::TemporaryFolder folder;
  Image8 image8{2, 1, {0, 128, 255, 255, 0, 64}};
  ASSERT_TRUE(write_png(folder / "a.png", image8).ok());
  Image image(2, 1);
  image.pixels = {{0.25f, 7, 0}, {1, 2, 3}};
  ASSERT_TRUE(write_exr(folder / "a.EXR", image).ok());
  for (const char* name : {"a.png", "a.EXR"}) {
    world::World world = with(sky(folder / name));
    const world::Status status = load_light_files(world);
    ASSERT_TRUE(status.ok()) << status.error().message;
    const world::LightImage& loaded = *world.luminaires[0].light_image;
    ASSERT_EQ(loaded.pixels.size(), 2u);
    if (std::string(name) == "a.png") {
      EXPECT_EQ(loaded.pixels[0], (Rgb{0, linear_from_srgb(128 / 255.0f), 1}));
      EXPECT_EQ(loaded.pixels[1], (Rgb{1, 0, linear_from_srgb(64 / 255.0f)}));
    } else {
      EXPECT_TRUE(std::ranges::equal(loaded.pixels, image.pixels));
    }
  }
}

TEST(LightFiles, AnImageThatTwoNameIsReadOnce) {
  const world::TemporaryFolder folder;
  ASSERT_TRUE(write_exr(folder / "a.exr", Image(2, 2)).ok());
  world::World world;
  world.luminaires = {sky(folder / "a.exr"), sky(folder / "a.exr")};
  ASSERT_TRUE(load_light_files(world).ok());
  EXPECT_EQ(world.luminaires[0].light_image, world.luminaires[1].light_image);
}

TEST(LightFiles, WhatIsWrongIsToldWithTheLuminairesPlace) {
  const world::TemporaryFolder folder;
  std::ofstream(folder / "short.hdr") << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 4\nabc";
  std::ofstream(folder / "no.png") << "no picture";
  std::ofstream(folder / "a.bmp") << "BM";
  Image negative(2, 2);
  negative.at(1, 0).g = -1;
  ASSERT_TRUE(write_exr(folder / "negative.exr", negative).ok());
  ASSERT_TRUE(write_exr(folder / "cut.exr", Image(64, 64)).ok());
  Image8 image8{64, 64, {}};
  image8.pixels.assign(64 * 64 * 3, 77);
  ASSERT_TRUE(write_png(folder / "cut.png", image8).ok());
  for (const char* name : {"cut.exr", "cut.png"})
    std::filesystem::resize_file(folder / name, std::filesystem::file_size(folder / name) / 2);
  for (const auto& [name, part] : {std::pair{"none.exr", "No such file"},
                                   {"short.hdr", "ends too early"},
                                   {"no.png", "is not a PNG"},
                                   {"cut.exr", ""},
                                   {"cut.png", ""},
                                   {"a.bmp", "is no .png, .exr or .hdr"},
                                   {"negative.exr", "pixel (1, 0) has a value of -1"}}) {
    world::World world = with(sky(folder / name));
    const world::Status status = load_light_files(world);
    ASSERT_FALSE(status.ok()) << name;
    EXPECT_EQ(status.error().message.rfind("scene.toml:7:1: 'image' ", 0), 0u) << status.error().message;
    EXPECT_NE(status.error().message.find(part), std::string::npos) << status.error().message;
    EXPECT_NE(status.error().message.find(name), std::string::npos) << status.error().message;
  }
}

TEST(LightFiles, AMeshEmitterGetsTheTrianglesOfItsFile) {
  const world::TemporaryFolder folder;
  std::ofstream(folder / "lamp.obj") << "v 0 0 0\nv 2 0 0\nv 2 0 1\nv 0 0 1\nf 1 2 3 4\n";
  std::ofstream(folder / "flat.obj") << "v 0 0 0\nv 2 0 0\nv 4 0 0\nf 1 2 3\n";
  Luminaire l;
  l.name = l.kind = "mesh", l.radiance = {1, 1, 1}, l.where = "scene.toml:7:1";
  l.mesh_file = folder / "lamp.obj";
  world::World world = with(l);
  const world::Status status = load_light_files(world);
  ASSERT_TRUE(status.ok()) << status.error().message;
  const auto sampler = world::LuminaireSampler::make(world.luminaires[0]);
  ASSERT_TRUE(sampler.ok());
  EXPECT_FLOAT_EQ(sampler->surface_area(), 2);
  EXPECT_FLOAT_EQ(sampler->total_power().g, 2 * 3.14159265f);
  // Its corners run counter-clockwise seen from below.
  EXPECT_TRUE(sampler->meet({1, -1, 0.5}, {0, 1, 0}));
  EXPECT_FALSE(sampler->meet({1, 1, 0.5}, {0, -1, 0}));
  for (const char* name : {"flat.obj", "none.obj"}) {
    l.mesh_file = folder / name;
    world::World wrong = with(l);
    const world::Status refused = load_light_files(wrong);
    ASSERT_FALSE(refused.ok()) << name;
    EXPECT_EQ(refused.error().message.rfind("scene.toml:7:1: ", 0), 0u) << refused.error().message;
  }
}

/// The irradiance of a sky on six faces, by importance sampling, is that of a plain sum over the pixels. 4 sigma, and
/// 1e-3 for values between pixels.
TEST(LightFiles, ARealSkyLightsAPlaneAsTheSumOfItsPixelsDoes) {
  const auto path = world::shared_data("hdri/museum.exr");
  if (!path) return;
  world::World world = with(sky(*path));
  ASSERT_TRUE(load_light_files(world).ok());
  const world::LightImage& image = *world.luminaires[0].light_image;
  const auto sampler = world::LuminaireSampler::make(world.luminaires[0]);
  ASSERT_TRUE(sampler.ok());
  constexpr double kPi = 3.14159265358979;
  for (const world::Vec3d& normal : {world::Vec3d(0, 1, 0), world::Vec3d(0, -1, 0), world::Vec3d(1, 0, 0),
                                     world::Vec3d(-1, 0, 0), world::Vec3d(0, 0, 1), world::Vec3d(0, 0, -1)}) {
    double exact = 0, sum = 0, squares = 0;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const double theta = kPi * (y + 0.5) / image.height, phi = 2 * kPi * (x + 0.5) / image.width;
        const world::Vec3d direction(std::sin(theta) * std::sin(phi), std::cos(theta),
                                     -std::sin(theta) * std::cos(phi));
        exact += image.pixels[static_cast<size_t>(y * image.width + x)].g * std::max(glm::dot(direction, normal), 0.0) *
                 std::sin(theta) * 2 * kPi / image.width * kPi / image.height;
      }
    constexpr int kSamples = 40000;
    for (int i = 0; i < kSamples; ++i) {
      const auto u = [&](int salt) { return world::uniform01(world::random_bits(9, i, salt, 0)); };
      const world::LuminaireSample s = sampler->sample({}, {u(0), u(1)});
      const double e = s.biradiance.g * std::max(glm::dot(world::Vec3d(s.direction), normal), 0.0);
      sum += e, squares += e * e;
    }
    const double mean = sum / kSamples, sigma = std::sqrt((squares / kSamples - mean * mean) / kSamples);
    EXPECT_NEAR(mean, exact, 4 * sigma + 1e-3 * exact);
    EXPECT_LT(sigma, 0.02 * exact);
  }
}

}  // namespace
}  // namespace render
