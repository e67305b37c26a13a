#include "world/luminaires/luminaire.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace world {
namespace {

constexpr float kPi = 3.14159265f;

struct Read {
  Luminaire luminaire;
  std::string error;
};

/// Of a table that begins in line 2 of a.toml.
Read read(const std::string& keys, VoxelPos offset = {}) {
  auto document = TomlDocument::parse("\n[[luminaire]]\n" + keys, "a.toml");
  if (!document.ok()) return {{}, document.error().message};
  Read result;
  for (TomlTable table : document->root().array_of_tables("luminaire"))
    result.luminaire = read_luminaire(table, offset, "/scenes");
  const Status status = document->finish();
  if (!status.ok()) result.error = status.error().message;
  return result;
}

void expect_error(const std::string& keys, const std::string& where, const std::string& part) {
  const std::string error = read(keys).error;
  EXPECT_EQ(error.substr(0, where.size()), where) << keys << "\n" << error;
  EXPECT_NE(error.find(part), std::string::npos) << keys << "\n" << error;
}

TEST(ReadLuminaire, AKindTakesItsKeys) {
  const Read r = read(
      "kind = \"gobo\"\nname = \"window\"\nposition = [1.5, 2, -3]\nlook_at = [1.5, 0, -3]\nup = [1, 5, 0]\n"
      "power_w = [1, 2, 3]\nradius_m = 0.25\nhalf_angle_deg = 60\ninner_half_angle_deg = 45\nimage = \"a/b.png\"\n"
      "shadows = false\n",
      {128, 0, 0});
  ASSERT_EQ(r.error, "");
  const Luminaire& l = r.luminaire;
  EXPECT_EQ(l.kind, "gobo");
  EXPECT_EQ(l.name, "window");
  EXPECT_EQ(l.position.voxel, (VoxelPos{129, 2, -3}));
  EXPECT_EQ(l.position.fraction.x, 0.5);
  EXPECT_EQ(l.axis, Vec3f(0, -1, 0));
  EXPECT_EQ(l.up, Vec3f(1, 0, 0));
  EXPECT_EQ(l.power, (Power3{1, 2, 3}));
  EXPECT_EQ(l.radius, 0.25f);
  EXPECT_FLOAT_EQ(l.half_angle, kPi / 3);
  EXPECT_FLOAT_EQ(l.inner_half_angle, kPi / 4);
  EXPECT_EQ(l.image, "/scenes/a/b.png");
  EXPECT_EQ(l.where, "a.toml:2:1");
  EXPECT_TRUE(l.lambertian && l.glossy && l.global_illumination && l.enabled && l.visible && !l.shadows);
}

TEST(ReadLuminaire, WhatIsMissingHasTheDocumentedDefault) {
  const Luminaire omni = read("kind = \"omni\"\nposition = [0, 0, 0]\npower_w = [1, 1, 1]\n").luminaire;
  EXPECT_EQ(omni.name, "omni");
  EXPECT_EQ(omni.radius, 0.01f);
  EXPECT_TRUE(omni.shadows && omni.enabled);
  const Luminaire spot =
      read("kind = \"spot\"\nposition = [0, 0, 0]\npower_w = [1, 1, 1]\nhalf_angle_deg = 30\n").luminaire;
  EXPECT_EQ(spot.axis, Vec3f(0, -1, 0));
  EXPECT_EQ(spot.inner_half_angle, spot.half_angle);
  const Read sky = read("kind = \"hemisphere\"\nimage = \"/sky.hdr\"\n");
  EXPECT_EQ(sky.error, "");
  EXPECT_EQ(sky.luminaire.axis, Vec3f(0, 1, 0));
  EXPECT_EQ(sky.luminaire.up, Vec3f(0, 0, 1));
  EXPECT_EQ(sky.luminaire.radiance, (Radiance3{1, 1, 1}));
  EXPECT_EQ(sky.luminaire.image, "/sky.hdr");
  EXPECT_FALSE(sky.luminaire.whole_sphere);
}

/// A rectangle's power and radiance say the same: Phi = pi A L.
TEST(ReadLuminaire, RadianceStandsForAPower) {
  const std::string place = "kind = \"rectangle\"\nposition = [0, 0, 0]\nsize = [2, 3]\n";
  const Read by_radiance = read(place + "radiance = [1, 2, 4]\n"), by_power = read(place + "power_w = [9, 9, 9]\n");
  ASSERT_EQ(by_radiance.error + by_power.error, "");
  const auto a = LuminaireSampler::make(by_radiance.luminaire), b = LuminaireSampler::make(by_power.luminaire);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_FLOAT_EQ(a->total_power().g, kPi * 6 * 2);
  EXPECT_EQ(b->total_power(), (Power3{9, 9, 9}));
  EXPECT_FLOAT_EQ(a->meet({0, -1, 0}, {0, 1, 0})->radiance.b, 4);
  EXPECT_FLOAT_EQ(b->meet({0, -1, 0}, {0, 1, 0})->radiance.b, 9 / (kPi * 6));
}

TEST(ReadLuminaire, ASlideMayBeDrawnInTheScene) {
  const std::string gobo = "kind = \"gobo\"\nposition = [0, 0, 0]\npower_w = [1, 1, 1]\nhalf_angle_deg = 30\n";
  const Read r = read(gobo + "pattern = \"\"\"\n.#5\n0#.\n\"\"\"\n");
  ASSERT_EQ(r.error, "");
  ASSERT_TRUE(r.luminaire.light_image);
  const LightImage& image = *r.luminaire.light_image;
  EXPECT_EQ(image.width, 3);
  EXPECT_EQ(image.height, 2);
  const float expected[6] = {0, 1, 0.5f, 0, 1, 0};
  for (size_t i = 0; i < 6; ++i) EXPECT_EQ(image.pixels[i], (Radiance3{expected[i], expected[i], expected[i]})) << i;
  expect_error(gobo + "pattern = \".#\\n.\"\n", "a.toml:7:", "rows of one length");
  expect_error(gobo + "pattern = \".x\"\n", "a.toml:7:", "rows of one length");
  expect_error(gobo + "pattern = \"\"\n", "a.toml:7:", "must have a row");
}

TEST(ReadLuminaire, BadInputIsNamedWithItsPlace) {
  const std::string omni = "kind = \"omni\"\nposition = [0, 0, 0]\n";
  expect_error(omni + "power_w = [1, -2, 3]\n", "a.toml:5:15: ", "'power_w[1]' is -2, but must be in [0, ");
  expect_error(omni + "power_w = [1, nan, 3]\n", "a.toml:5:15: ", "'power_w[1]' is nan");
  expect_error(omni + "power_w = [1, 2, inf]\n", "a.toml:5:18: ", "'power_w[2]' is inf");
  expect_error(omni + "power_w = [1, 2]\n", "a.toml:5:11: ", "3 numbers");
  expect_error(omni, "a.toml:2:1: ", "'power_w' is missing");
  expect_error(omni + "power_w = [1, 2, 3]\nradius_m = 0\n", "a.toml:6:12: ", "must be in [1e-06, ");
  expect_error(omni + "power_w = [1, 2, 3]\nhalf_angle_deg = 3\n", "a.toml:6:18: ",
               "a luminaire of kind 'omni' has no 'half_angle_deg'; of such keys it has position, power_w, radius_m");
  expect_error(omni + "power_w = [1, 2, 3]\npwoer = 3\n", "a.toml:6:1: ", "unknown key 'pwoer'");
  expect_error("kind = \"omny\"\nposition = [0, 0, 0]\npower_w = [1, 1, 1]\n", "a.toml:3:8: ", "did you mean 'omni'?");
  expect_error("position = [0, 0, 0]\npower_w = [1, 1, 1]\n", "a.toml:2:1: ", "'kind' is missing");
  expect_error("kind = \"omni\"\npower_w = [1, 1, 1]\n", "a.toml:2:1: ", "'position' is missing");
  const std::string rectangle = "kind = \"rectangle\"\nposition = [0, 0, 0]\n";
  expect_error(rectangle + "power_w = [1, 2, 3]\nsize = [0, 1]\n", "a.toml:6:9: ", "'size[0]' is 0");
  expect_error(rectangle + "power_w = [1, 2, 3]\nsize = [1, -1]\n", "a.toml:6:12: ", "'size[1]' is -1");
  expect_error(rectangle + "power_w = [1, 2, 3]\n", "a.toml:2:1: ", "'size' is missing");
  expect_error(rectangle + "size = [1, 1]\n", "a.toml:2:1: ", "needs 'power_w' or 'radiance'");
  expect_error(rectangle + "size = [1, 1]\npower_w = [1, 2, 3]\nradiance = [1, 2, 3]\n", "a.toml:7:12: ", "exclude");
  expect_error(rectangle + "size = [1, 1]\npower_w = [1, 2, 3]\nup = [0, 2, 0]\n", "a.toml:7:6: ", "parallel");
  expect_error(rectangle + "size = [1, 1]\npower_w = [1, 2, 3]\nsampling = \"points\"\n",
               "a.toml:7:12: ", "solid_angle, area");
  const std::string spot = "kind = \"spot\"\nposition = [0, 0, 0]\npower_w = [1, 1, 1]\n";
  for (const char* angle : {"-1", "180.5", "nan", "inf"})
    expect_error(spot + "half_angle_deg = " + angle + "\n", "a.toml:6:18: ", "must be in [0, 180]");
  expect_error(spot + "half_angle_deg = 3\ndirection = [0, 0, 0]\n", "a.toml:7:13: ", "must not be zero");
  expect_error(spot + "half_angle_deg = 3\nlook_at = [0, 0, 0]\n", "a.toml:7:11: ", "must differ from 'position'");
  expect_error(spot + "half_angle_deg = 3\nlook_at = [0, 1, 0]\ndirection = [1, 0, 0]\n", "a.toml:7:11: ", "exclude");
  for (const char* angle : {"0", "90"})
    expect_error("kind = \"gobo\"\nposition = [0, 0, 0]\npower_w = [1, 1, 1]\nimage = \"a.png\"\nhalf_angle_deg = " +
                     std::string(angle) + "\n",
                 "a.toml:7:18: ", "must be in (0, 90)");
  expect_error("kind = \"directional\"\ndirection = [0, 0, 0]\nirradiance = [1, 1, 1]\n", "a.toml:4:13: ", "zero");
  expect_error("kind = \"directional\"\nirradiance = [1, 1, 1]\n", "a.toml:2:1: ", "'direction' is missing");
  expect_error("kind = \"directional\"\nlook_at = [1, 1, 1]\nirradiance = [1, 1, 1]\n", "a.toml:4:11: ", "direction");
  expect_error("kind = \"hemisphere\"\n", "a.toml:2:1: ", "'radiance' is missing");
  expect_error("kind = \"hemisphere\"\nradiance = [-1, 1, 1]\n", "a.toml:4:13: ", "'radiance[0]' is -1");
  const std::string point = "kind = \"unified_point\"\npower_w = [1, 1, 1]\n";
  expect_error(point + "position = [0, 0, 0]\nattenuation = [0, 0, 0]\n", "a.toml:6:15: ", "above 0");
  expect_error(point + "at_infinity = true\n", "a.toml:2:1: ", "must begin with a number above 0");
  EXPECT_EQ(read(point + "at_infinity = true\nattenuation = [1, 0, 0]\n").error, "");
}

}  // namespace
}  // namespace world
