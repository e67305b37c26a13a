// What a [[medium]] of a scene may say, and one sentence for what is wrong with it.
#include "world/media/medium.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "world/media/brick_field.h"

namespace world {
namespace {

struct ReadMedium {
  TemporaryFolder folder;
  Status status;
  Medium medium;

  explicit ReadMedium(const std::string& keys, const std::string& vol_bytes = "") {
    if (!vol_bytes.empty()) std::ofstream(folder / "a.vol", std::ios::binary) << vol_bytes;
    auto document = TomlDocument::parse("[[medium]]\n" + keys, "s.toml");
    if (!document.ok()) {
      status = document.error();
      return;
    }
    TomlTable root = document->root();
    for (TomlTable table : root.array_of_tables("medium")) medium = read_medium(table, {128, 0, -128}, folder / "");
    status = document->finish();
  }
  std::string error() const { return status.ok() ? "" : status.error().message; }
};

TEST(MediumOfAScene, EachKindReadsItsOwnKeys) {
  const ReadMedium box(
      "name = \"b\"\nkind = \"box_fog\"\nposition = [1, 2, 3.5]\nhalf_extent = [4, 5, 6]\nabsorption_per_m = 0.5\n"
      "scattering_per_m = [1, 2, 3]\nanisotropy = -0.25\nemission = [0.1, 0.2, 0.3]\n");
  ASSERT_EQ(box.error(), "");
  EXPECT_EQ(box.medium.kind, "box_fog");
  EXPECT_EQ(medium_kinds()[static_cast<size_t>(box.medium.kind_number)], "box_fog");
  EXPECT_EQ(box.medium.position - (WorldPoint{{129, 2, -125}, {0, 0, 0.5}}), Vec3d(0));
  EXPECT_EQ(box.medium.half_extent, Vec3f(4, 5, 6));
  EXPECT_EQ(box.medium.absorption, (Absorption3{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(box.medium.scattering, (Absorption3{1, 2, 3}));
  EXPECT_EQ(box.medium.anisotropy, -0.25f);
  EXPECT_EQ(box.medium.emission, (Radiance3{0.1f, 0.2f, 0.3f}));
  EXPECT_EQ(box.medium.where, "s.toml:1:1");
  const ReadMedium half("name = \"h\"\nkind = \"halfspace_fog\"\nnormal = [0, 3, 4]\n");
  ASSERT_EQ(half.error(), "");
  EXPECT_EQ(half.medium.normal, Vec3f(0, 0.6f, 0.8f));
  const ReadMedium height("name = \"y\"\nkind = \"height_fog\"\nscale_height_m = 20\n");
  ASSERT_EQ(height.error(), "");
  EXPECT_EQ(height.medium.scale_height, 20);
  const ReadMedium grid(
      "name = \"g\"\nkind = \"density_grid\"\nlayer = \"density\"\nvoxel_size_m = 0.25\nsampling = \"nearest\"\n");
  ASSERT_EQ(grid.error(), "");
  EXPECT_EQ(grid.medium.sampling, FieldSampling::nearest);
  EXPECT_EQ(grid.medium.voxel_size, 0.25f);
  EXPECT_EQ(grid.medium.field, nullptr);  // the world's, once it is built
}

TEST(MediumOfAScene, WhatIsWrongIsOneSentenceWithFileLineAndColumn) {
  const std::string fog = "name = \"f\"\nkind = \"homogeneous\"\n", box = "name = \"f\"\nkind = \"box_fog\"\n",
                    grid = "name = \"f\"\nkind = \"density_grid\"\n";
  const std::pair<std::string, std::string> wrong[] = {
      {"kind = \"homogeneous\"\n", "s.toml:1:1: the key 'name' is missing"},
      {"name = \"f\"\n", "s.toml:1:1: the key 'kind' is missing"},
      {"name = \"f\"\nkind = \"box_frog\"\n",
       "s.toml:3:8: 'kind' is 'box_frog', but must be one of box_fog, density_grid, ellipsoid_fog, halfspace_fog, "
       "height_fog, homogeneous (did you mean 'box_fog'?)"},
      {fog + "absorption_per_m = -1\n", "s.toml:4:20: 'absorption_per_m' is -1, but must be in [0, 1e+09]"},
      {fog + "absorption_per_m = [1, nan, 1]\n",
       "s.toml:4:24: 'absorption_per_m[1]' is nan, but must be in [0, 1e+09]"},
      {fog + "scattering_per_m = inf\n", "s.toml:4:20: 'scattering_per_m' is inf, but must be in [0, 1e+09]"},
      {fog + "scattering_per_m = [1, 2]\n", "s.toml:4:20: 'scattering_per_m' must be an array of 3 numbers, not of 2"},
      {fog + "emission = [0, 0, -1]\n", "s.toml:4:19: 'emission[2]' is -1, but must be in [0, 1e+09]"},
      {fog + "anisotropy = 1\n", "s.toml:4:14: 'anisotropy' is 1, but must be in (-1, 1)"},
      {fog + "position = [1, 2, 3]\n", "s.toml:4:1: unknown key 'position'"},
      {box, "s.toml:1:1: the key 'half_extent' is missing"},
      {box + "half_extent = [1, 0, 1]\n", "s.toml:4:19: 'half_extent[1]' is 0, but must be in [1e-06, 1e+09]"},
      {box + "half_extent = [1, 1, 1]\nscale_height_m = 3\n", "s.toml:5:1: unknown key 'scale_height_m'"},
      {"name = \"f\"\nkind = \"halfspace_fog\"\nnormal = [0, 0, 0]\n", "s.toml:4:10: 'normal' must not be 0"},
      {"name = \"f\"\nkind = \"height_fog\"\nscale_height_m = 0\n",
       "s.toml:4:18: 'scale_height_m' is 0, but must be in [0.001, 1e+09]"},
      {grid, "s.toml:1:1: a density_grid needs either file = \"...\" or layer = \"density\""},
      {grid + "layer = \"heat\"\n", "s.toml:4:9: 'layer' is 'heat', but must be 'density'"},
      {grid + "layer = \"density\"\nsampling = \"cubic\"\n",
       "s.toml:5:12: 'sampling' is 'cubic', but must be one of nearest, trilinear"},
  };
  for (const auto& [keys, expected] : wrong) EXPECT_EQ(ReadMedium(keys).error(), expected) << keys;
}

/// A .vol file of 2 x 3 x 4 voxels whose values count up.
std::string small_vol() {
  std::string bytes = "VOL\x03";
  const auto put = [&](auto v) { bytes.append(reinterpret_cast<const char*>(&v), sizeof v); };
  for (const int32_t v : {1, 2, 3, 4, 1}) put(v);
  for (int i = 0; i < 6; ++i) put(0.0f);
  for (int i = 0; i < 24; ++i) put(static_cast<float>(i));
  return bytes;
}

TEST(VolFile, ValuesLieXFastest) {
  const ReadMedium read("name = \"f\"\nkind = \"density_grid\"\nfile = \"a.vol\"\nsampling = \"nearest\"\n",
                        small_vol());
  ASSERT_EQ(read.error(), "");
  const DensityField& field = *read.medium.field;
  EXPECT_EQ(field.max(), 23);
  for (int z = 0; z < 4; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 2; ++x) EXPECT_EQ(field.density({x + 0.5, y + 0.5, z + 0.5}), (z * 3 + y) * 2 + x);
  EXPECT_EQ(field.density({-0.5, 0.5, 3.5}), 0);
  EXPECT_EQ(field.density({2.5, 0.5, 3.5}), 0);
}

TEST(VolFile, ExtendingRepeatsTheOutermostVoxels) {
  const ReadMedium read(
      "name = \"f\"\nkind = \"density_grid\"\nfile = \"a.vol\"\nsampling = \"nearest\"\nextend_voxels = 9\n",
      small_vol());
  ASSERT_EQ(read.error(), "");
  const DensityField& field = *read.medium.field;
  for (int z = -9; z < 13; ++z)
    for (int y = -9; y < 12; ++y)
      for (int x = -9; x < 11; ++x) {
        const int inside[3] = {std::clamp(x, 0, 1), std::clamp(y, 0, 2), std::clamp(z, 0, 3)};
        ASSERT_EQ(field.density({x + 0.5, y + 0.5, z + 0.5}), (inside[2] * 3 + inside[1]) * 2 + inside[0]);
      }
  EXPECT_EQ(field.density({11.5, 0.5, 0.5}), 0);
}

TEST(VolFile, TheSharedTextureHasTheMeanAndMaximumThatFactsSay) {
  const auto path = shared_data("gt/mitsuba/participating_media/textures/sigmat.vol");
  if (!path) return;
  const auto field = read_vol_file(*path, FieldSampling::trilinear, 0);
  ASSERT_TRUE(field.ok()) << field.error().message;
  EXPECT_EQ((*field)->max(), 5);
  double sum = 0;
  for (int x = 0; x < 16; ++x)
    for (int y = 0; y < 16; ++y)
      for (int z = 0; z < 16; ++z) sum += (*field)->density({x + 0.5, y + 0.5, z + 0.5});  // at a centre: its own value
  EXPECT_NEAR(sum / 4096, 0.609156635866384, 1e-7);
}

TEST(VolFile, DamageIsOneSentence) {
  const std::string keys = "name = \"f\"\nkind = \"density_grid\"\nfile = \"a.vol\"\n", whole = small_vol();
  for (size_t length = 1; length < whole.size(); ++length) {
    const std::string error = ReadMedium(keys, whole.substr(0, length)).error();
    ASSERT_NE(error.find("a.vol: byte "), std::string::npos) << error;
    ASSERT_EQ(error.find("s.toml:4:8: "), 0u) << error;
  }
  const auto with = [&](size_t at, auto value) {
    std::string damaged = whole;
    std::memcpy(&damaged[at], &value, sizeof value);
    const std::string error = ReadMedium(keys, damaged).error();
    return error.substr(std::min(error.find("a.vol: "), error.size()));
  };
  EXPECT_EQ(with(0, 'W'), "a.vol: byte 0: is no .vol file of version 3");
  EXPECT_EQ(with(4, 2), "a.vol: byte 4: the encoding is 2, but must be 1 (32 bit floats)");
  EXPECT_EQ(with(12, 0), "a.vol: byte 12: a size is 0, but must be in 1..4096");
  EXPECT_EQ(with(12, 5000), "a.vol: byte 12: a size is 5000, but must be in 1..4096");
  EXPECT_EQ(with(20, 3), "a.vol: byte 20: it has 3 channels, but a density has 1");
  EXPECT_EQ(with(16, 5), "a.vol: byte 144: the file should end at byte 168; it is damaged or cut off");
  EXPECT_EQ(with(48 + 4 * 7, -0.5f),
            "a.vol: the density at voxel (1, 0, 1) is -0.5, but must be finite and at least 0");
  EXPECT_EQ(with(48 + 4 * 7, std::nanf("")),
            "a.vol: the density at voxel (1, 0, 1) is nan, but must be finite and at least 0");
}

}  // namespace
}  // namespace world
