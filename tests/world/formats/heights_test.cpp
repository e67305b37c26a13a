/// Elevation from USGS files and pictures: the facts worked out elsewhere, and the land that comes of them.
#include <cmath>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/world/formats/formats_support.h"
#include "world/formats/heights/dem.h"
#include "world/formats/heights/land.h"
#include "world/formats/heights/picture.h"
#include "world/formats/png_height.h"

namespace world {
namespace {

using nlohmann::json;

/// y of the highest voxel of a column that is not air; nothing where it is empty.
std::optional<int> top_of(const World& world, int x, int z) {
  const VoxelBox box = world.store.bounds();
  for (int y = box.max.y; y >= box.min.y; --y)
    if (world.store.get({x, y, z}) != kAir) return y;
  return std::nullopt;
}

TEST(Dem, FactsOfTheRealFileHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  const json& facts = shared_facts()["dem/SainteHelens.dem"];
  const auto dem = parse_dem(bytes_of(*shared_data("dem/SainteHelens.dem")), "SainteHelens.dem");
  ASSERT_TRUE(dem) << dem.error().message;
  EXPECT_TRUE(dem->name.starts_with(facts["name"].get<std::string>())) << dem->name;
  for (size_t i = 0; i < 8; ++i) EXPECT_DOUBLE_EQ(dem->corners[i], facts["corners_xy"][i / 2][i % 2].get<double>());
  EXPECT_EQ(dem->least, facts["elev_minmax_header"][0]);
  EXPECT_EQ(dem->greatest, facts["elev_minmax_header"][1]);
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(dem->resolution[i], facts["res"][i]);
  EXPECT_EQ(dem->columns, facts["columns"]);
  EXPECT_EQ(dem->leftover, facts["leftover"]);
  int least = INT32_MAX, greatest = INT32_MIN;
  size_t samples = 0, shortest = SIZE_MAX, longest = 0;
  double sum = 0;
  for (const DemFile::Profile& p : dem->profiles) {
    samples += p.raw.size(), shortest = std::min(shortest, p.raw.size()), longest = std::max(longest, p.raw.size());
    for (const int h : p.raw) least = std::min(least, h), greatest = std::max(greatest, h), sum += h;
  }
  EXPECT_EQ(samples, facts["samples"]);
  EXPECT_EQ(json({shortest, longest}), facts["profile_len_minmax"]);
  EXPECT_EQ(least, facts["min"]);
  EXPECT_EQ(greatest, facts["max"]);
  EXPECT_NEAR(sum / static_cast<double>(samples), facts["mean"].get<double>(), 1e-9);
}

TEST(Dem, NorthIsUpThePictureAndTheCraterOpensNorth) {
  const auto path = shared_data("dem/SainteHelens.dem");
  if (!path) GTEST_SKIP();
  ImportReport report;
  const World world = read_world(*path, {}, report).value();
  const DemFile dem = parse_dem(bytes_of(*path), "SainteHelens.dem").value();
  double west = 1e9, north = 0;
  for (const auto& p : dem.profiles)
    west = std::min(west, p.x), north = std::max(north, p.y + 30.0 * static_cast<double>(p.raw.size() - 1));
  // Posts of some profiles, found again at their places.
  for (const size_t column : {0u, 50u, 163u, 300u, 326u}) {
    const DemFile::Profile& p = dem.profiles[column];
    for (size_t i = 0; i < p.raw.size(); i += 7) {
      const int x = static_cast<int>(std::lround((p.x - west) / 30)),
                z = static_cast<int>(std::lround((north - p.y) / 30)) - static_cast<int>(i);
      ASSERT_EQ(top_of(world, x, z), static_cast<int>(std::ceil(p.heights[i] / 30 - 1e-7)) - 1) << column << ' ' << i;
    }
  }
  EXPECT_EQ(top_of(world, 0, 0), std::nullopt) << "outside the skewed quadrangle";
  // The blast of 1980 went north: from the crater's floor the land falls to the north and rises to the south.
  const VoxelBox box = world.store.bounds();
  EXPECT_EQ(box.max.y, static_cast<int>(std::ceil(2543.0 / 30)) - 1);
}

TEST(Dem, DamageIsAnErrorThatNamesFileAndByte) {
  const auto path = shared_data("dem/SainteHelens.dem");
  if (!path) GTEST_SKIP();
  auto bytes = bytes_of(*path);
  for_each_truncation(bytes, 30011, [&](std::span<const uint8_t> cut) {
    const auto dem = parse_dem(cut, "cut.dem");
    ASSERT_FALSE(dem);
    EXPECT_EQ(dem.error().message.rfind("cut.dem: byte ", 0), 0u) << dem.error().message;
  });
  bytes.resize(20000);
  for_each_mutation(bytes, 3000, 3000, 3,
                    [&](std::span<const uint8_t> damaged) { (void)parse_dem(damaged, "bad.dem"); });
  ImportReport report;
  for_each_mutation(bytes_of(*path), 3000, 20, 4, [&](std::span<const uint8_t> damaged) {
    if (const auto dem = parse_dem(damaged, "bad.dem")) (void)world_from_dem(*dem, "bad.dem", {}, report);
  });
}

TEST(PngHeight, FactsOfTheRealFileHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  const json& facts = shared_facts()["dem/alps-montblanc.png"];
  const auto picture = read_height_png(bytes_of(*shared_data("dem/alps-montblanc.png")), "alps-montblanc.png");
  ASSERT_TRUE(picture) << picture.error().message;
  EXPECT_EQ(picture->width, facts["w"]);
  EXPECT_EQ(picture->height, facts["h"]);
  EXPECT_EQ(picture->bits, facts["bitdepth"]);
  EXPECT_EQ(picture->channels, 1);
  uint64_t sum = 0;
  size_t highest = 0;
  for (size_t i = 0; i < picture->samples.size(); ++i) {
    sum += picture->samples[i];
    if (picture->samples[i] > picture->samples[highest]) highest = i;
  }
  const auto [least, greatest] = std::minmax_element(picture->samples.begin(), picture->samples.end());
  EXPECT_EQ(*least, facts["raw_min"]);
  EXPECT_EQ(*greatest, facts["raw_max"]);
  EXPECT_EQ(sum, facts["raw_sum"]);
  EXPECT_EQ(json({highest / picture->width, highest % picture->width}), facts["max_row_col"]);
  const uint32_t last = picture->width - 1;
  EXPECT_EQ(json({picture->at(0, 0), picture->at(0, last), picture->at(last, 0), picture->at(last, last)}),
            facts["corners"]);
}

TEST(PngHeight, AnAlpineMapStandsTheRightWayUp) {
  const auto path = shared_data("dem/alps-montblanc.png");
  if (!path) GTEST_SKIP();
  ImportReport report;
  // 60 km and 454 to 4810 m, as its project says.
  const World world =
      read_world(*path, {.metres_per_voxel = 100, .post_spacing_m = 60000.0 / 646, .height_range_m = {{454, 4810}}},
                 report)
          .value();
  EXPECT_TRUE(report.warnings.empty());
  const VoxelBox box = world.store.bounds();
  EXPECT_EQ(box.max.y, 48);
  // Mont Blanc lies at row 322, column 324 of 647.
  const auto summit =
      top_of(world, static_cast<int>(324 * 60000.0 / 646 / 100), static_cast<int>(322 * 60000.0 / 646 / 100));
  EXPECT_GE(summit.value_or(0), 46);
  // The north-western corner is low, the south-eastern one high.
  EXPECT_LT(*top_of(world, 0, 0), *top_of(world, box.max.x, box.max.z));
}

TEST(GeoTiff, HeightsLieWhereTheFileSays) {
  // Three by two posts of 16 bits, one strip, 100 m apart: a TIFF by hand.
  std::string tiff("II*\0\x08\0\0\0", 8);
  const auto put = [&](auto value) { tiff.append(reinterpret_cast<const char*>(&value), sizeof value); };
  const int entries = 12;
  const uint32_t after = 8 + 2 + 12 * entries + 4;
  const double scale[3] = {100, 100, 0}, tie[6] = {0, 0, 0, 500000, 4649000, 0};
  const uint16_t keys[12] = {1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32633};
  const auto entry = [&](uint16_t tag, uint16_t type, uint32_t count, uint32_t value) {
    put(tag), put(type), put(count), put(value);
  };
  put(static_cast<uint16_t>(entries));
  entry(256, 4, 1, 3), entry(257, 4, 1, 2), entry(258, 3, 1, 16), entry(259, 3, 1, 1), entry(262, 3, 1, 1);
  entry(273, 4, 1, after + 24 + 48 + 24), entry(277, 3, 1, 1), entry(278, 4, 1, 2), entry(279, 4, 1, 12);
  entry(33550, 12, 3, after), entry(33922, 12, 6, after + 24), entry(34735, 3, 12, after + 72);
  put(uint32_t{0});
  for (const double d : scale) put(d);
  for (const double d : tie) put(d);
  for (const uint16_t k : keys) put(k);
  for (const uint16_t h : {100, 250, 400, 700, 1000, 300}) put(h);
  const TemporaryFolder folder;
  std::ofstream(folder / "a.tif", std::ios::binary) << tiff;
  ImportReport report;
  const auto world = read_world(folder / "a.tif", {}, report);
  if (!world.ok() && world.error().message.find("GDAL was missing") != std::string::npos)
    GTEST_SKIP() << "skipped: this build has no GDAL";
  ASSERT_TRUE(world.ok()) << world.error().message;
  EXPECT_EQ(world->metadata.at("voxel_size_m"), "100");
  const int tops[2][3] = {{0, 2, 3}, {6, 9, 2}};
  for (int z = 0; z < 2; ++z)
    for (int x = 0; x < 3; ++x) EXPECT_EQ(top_of(*world, x, z), tops[z][x]) << x << ' ' << z;
  const std::vector<uint8_t> bytes(tiff.begin(), tiff.end());
  for_each_truncation(bytes, 40, [&](std::span<const uint8_t> cut) {
    std::ofstream(folder / "cut.tif", std::ios::binary)
        .write(reinterpret_cast<const char*>(cut.data()), static_cast<std::streamsize>(cut.size()));
    const auto read = read_world(folder / "cut.tif", {}, report);
    ASSERT_FALSE(read.ok());
    EXPECT_NE(read.error().message.find("cut.tif"), std::string::npos);
  });
}

std::string png_of(HeightPicture picture) { return write_height_png(picture, "test.png").value(); }

TEST(PngHeight, ColumnsComeBackAsTheyWere) {
  const TemporaryFolder folder;
  World world(standard_blocks());
  EditBatch batch;
  for (int x = 0; x < 40; ++x)
    for (int z = 0; z < 30; ++z)
      if ((x * 7 + z) % 11 != 0) batch.fill({{x + 5, -9, z - 70}, {x + 5, (x * x + 3 * z) % 60 - 8, z - 70}}, 1);
  ASSERT_TRUE(world.store.apply(batch));
  for (const char* size : {"1", "0.1", "92.6625", "0.30000000000000004"}) {
    SCOPED_TRACE(size);
    world.metadata["voxel_size_m"] = size;
    const Status written = write_world(world, folder / "a.png");
    ASSERT_TRUE(written) << written.error().message;
    ImportReport report;
    const World back = read_world(folder / "a.png", {}, report).value();
    EXPECT_TRUE(report.warnings.empty());
    for (int x = 0; x < 40; ++x)
      for (int z = 0; z < 30; ++z) ASSERT_EQ(top_of(back, x, z), top_of(world, x + 5, z - 70)) << x << ' ' << z;
  }
}

TEST(PngHeight, DamagedPicturesAreErrors) {
  HeightPicture picture;
  picture.width = 40, picture.height = 30;
  for (int i = 0; i < 1200; ++i) picture.samples.push_back(static_cast<uint16_t>(i * 37));
  const std::string text = png_of(picture);
  const std::vector<uint8_t> bytes(text.begin(), text.end());
  ASSERT_EQ(read_height_png(bytes, "whole.png")->samples, picture.samples);
  for_each_truncation(bytes, 7, [&](std::span<const uint8_t> cut) {
    const auto read = read_height_png(cut, "cut.png");
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().message.rfind("cut.png: byte ", 0), 0u);
  });
  for_each_mutation(bytes, 40, 2000, 9,
                    [&](std::span<const uint8_t> damaged) { (void)read_height_png(damaged, "bad.png"); });
  // A head that claims 2^20 posts on each side, its checksum right, asks for no memory.
  std::vector<uint8_t> bomb = bytes;
  const uint8_t head[] = {0, 0x10, 0, 0, 0, 0x10, 0, 0};
  std::copy(std::begin(head), std::end(head), bomb.begin() + 16);
  const auto read = read_height_png(bomb, "bomb.png");
  ASSERT_FALSE(read);
}

TEST(Heights, AStripHasItsHeightsUnlessItWouldBeMostlyEmptyRegions) {
  const auto land = [](int columns, int rows) {
    HeightGrid grid;
    grid.columns = columns, grid.rows = rows;
    for (int i = 0; i < columns * rows; ++i) grid.heights.push_back(i % 7);
    ImportReport report;
    return land_from_heights(grid, {0, 0, columns, rows}, "test", "strip", {}, report);
  };
  for (const auto& [columns, rows] : {std::pair(3, 300), std::pair(130, 2)}) {
    const auto world = land(columns, rows);
    ASSERT_TRUE(world) << world.error().message;
    for (int x = 0; x < columns; ++x)
      for (int z = 0; z < rows; ++z) {
        const int height = (z * columns + x) % 7;
        ASSERT_EQ(top_of(*world, x, z), height == 0 ? -1 : height - 1) << x << ' ' << z;
      }
    EXPECT_EQ(top_of(*world, columns, 0), std::nullopt);
    EXPECT_EQ(top_of(*world, 0, rows), std::nullopt);
  }
  const auto thin = land(1, 100'000);  // 782 regions, of 34 kB each, for one column in 128
  ASSERT_FALSE(thin);
  EXPECT_EQ(thin.error().message,
            "strip: a strip of 1 x 100000 columns of voxels is too long for its width; choose a smaller window");
}

}  // namespace
}  // namespace world
