#include "world/formats/hgt.h"

#include <cmath>

#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/world/formats/formats_support.h"
#include "world/base/jobs.h"
#include "world/formats/archive/zip.h"

namespace world {
namespace {

using Bytes = std::vector<uint8_t>;

Result<Elevation> read_tile(const std::filesystem::path& path) {
  const Bytes bytes = bytes_of(path);
  return path.extension() == ".zip" ? parse_hgt_zip(bytes, path.string()) : parse_hgt(bytes, path.string());
}

/// A 1201 x 1201 file with height(row, column) in it.
template <class Height>
Bytes tile_bytes(Height height) {
  Bytes bytes;
  bytes.reserve(2 * 1201 * 1201);
  for (int row = 0; row < 1201; ++row) {
    for (int column = 0; column < 1201; ++column) {
      const auto h = static_cast<uint16_t>(static_cast<int16_t>(height(row, column)));
      bytes.push_back(static_cast<uint8_t>(h >> 8));
      bytes.push_back(static_cast<uint8_t>(h));
    }
  }
  return bytes;
}

/// A zip archive with one entry; what it claims can differ from what it holds.
Bytes zip_of(const std::string& name, const Bytes& content, uint32_t claimed_size, uint16_t method = 8) {
  Bytes packed = content;
  if (method == 8) {
    packed.resize(content.size() + content.size() / 1000 + 100);
    z_stream stream{};
    deflateInit2(&stream, 9, Z_DEFLATED, -15, 9, Z_DEFAULT_STRATEGY);
    stream.next_in = const_cast<Bytef*>(content.data());
    stream.avail_in = static_cast<uInt>(content.size());
    stream.next_out = packed.data();
    stream.avail_out = static_cast<uInt>(packed.size());
    EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
  }
  Bytes out;
  const auto u16 = [&](uint32_t v) {
    out.push_back(static_cast<uint8_t>(v)), out.push_back(static_cast<uint8_t>(v >> 8));
  };
  const auto u32 = [&](uint32_t v) { u16(v & 0xffff), u16(v >> 16); };
  const uint32_t crc = static_cast<uint32_t>(crc32(0, content.data(), static_cast<uInt>(content.size())));
  const auto common = [&] {
    u16(0), u16(method), u32(0), u32(crc), u32(static_cast<uint32_t>(packed.size())), u32(claimed_size);
    u16(static_cast<uint32_t>(name.size())), u16(0);
  };
  u32(0x04034b50), u16(20), common();
  out.insert(out.end(), name.begin(), name.end());
  out.insert(out.end(), packed.begin(), packed.end());
  const uint32_t directory = static_cast<uint32_t>(out.size());
  u32(0x02014b50), u16(20), u16(20), common(), u16(0), u32(0), u32(0), u32(0);
  out.insert(out.end(), name.begin(), name.end());
  const uint32_t end = static_cast<uint32_t>(out.size());
  u32(0x06054b50), u16(0), u16(0), u16(1), u16(1), u32(end - directory), u32(directory), u16(0);
  return out;
}

TEST(Hgt, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  const std::map<std::string, std::string> tiles = {{"dem/N42E001.hgt", "dem/N42E001.hgt"},
                                                    {"dem/N49E011.hgt.zip", "dem/N49E011.hgt"},
                                                    {"dem/S29W072.hgt.zip", "dem/S29W072.hgt.zip"}};
  for (const auto& [name, key] : tiles) {
    SCOPED_TRACE(name);
    const nlohmann::json& expected = shared_facts()[key];
    const auto tile = read_tile(*shared_data(name));
    ASSERT_TRUE(tile) << tile.error().message;
    const ElevationFacts facts = facts_of(*tile);
    const int last = tile->posts - 1;
    EXPECT_EQ(tile->posts, expected["n"]);
    EXPECT_EQ(facts.min, expected["min"]);
    EXPECT_EQ(facts.max, expected["max"]);
    EXPECT_EQ(facts.sum, expected["sum"]);
    EXPECT_DOUBLE_EQ(facts.mean(), expected["mean"].get<double>());
    EXPECT_EQ(facts.voids, expected["voids"]);
    EXPECT_EQ(facts.zeros, expected["zeros"]);
    EXPECT_EQ(facts.negative, expected["negative"]);
    EXPECT_EQ(nlohmann::json({tile->at(0, 0), tile->at(0, last), tile->at(last, 0), tile->at(last, last)}),
              expected["corners_NW_NE_SW_SE"]);
    EXPECT_EQ(tile->at(last / 2, last / 2), expected["centre"]);
    EXPECT_EQ(tile->at(expected["max_at_row_col"][0], expected["max_at_row_col"][1]), expected["max"]);
  }
}

TEST(Hgt, PlacesHaveTheHeightsThatOthersFound) {
  struct Row {
    const char* tile;
    double latitude, longitude;
    int cell, nearest;
    double bilinear;
  };
  const Row rows[] = {
      {"N49E011", 49.968651, 11.574869, 466, 456, 458.57}, {"N49E011", 49.958233, 11.558647, 330, 330, 329.83},
      {"N49E011", 49.949784, 11.575170, 337, 337, 337.77}, {"N49E011", 49.968668, 11.575127, 466, 456, 460.29},
      {"N49E011", 49.968682, 11.574842, 466, 456, 458.65}, {"S29W072", -28.883160, -71.070557, 1678, 1657, 1661.88},
      {"S29W072", -28.671311, -71.389160, 0, 0, 0.00},
  };
  for (const Row& row : rows) {
    const auto path = shared_data(std::string("dem/") + row.tile + ".hgt.zip");
    if (!path) GTEST_SKIP();
    const Elevation tile = read_tile(*path).value();
    EXPECT_EQ(tile.cell_post(row.latitude, row.longitude), row.cell) << row.latitude;
    EXPECT_EQ(tile.nearest_post(row.latitude, row.longitude), row.nearest) << row.latitude;
    EXPECT_NEAR(tile.bilinear(row.latitude, row.longitude).value(), row.bilinear, 0.005)
        << row.latitude;  // printed to 0.01
  }
}

TEST(Hgt, VoidsTakeHeightsBetweenTheirNeighboursAndOthersStay) {
  const Bytes bytes = tile_bytes([](int row, int column) {
    return row >= 500 && row < 520 && column >= 600 && column < 640 ? -32768 : 100 + 2 * column;
  });
  Elevation tile = parse_hgt(bytes, "N10E010.hgt").value();
  const Elevation before = tile;
  EXPECT_EQ(fill_voids(tile, "x").value(), 20u * 40u);
  int worst = 0;
  for (int row = 0; row < 1201; ++row) {
    for (int column = 0; column < 1201; ++column) {
      if (before.at(row, column) != Elevation::kVoid) {
        ASSERT_EQ(tile.at(row, column), before.at(row, column));
      }
      worst = std::max(worst, std::abs(tile.at(row, column) - (100 + 2 * column)));
    }
  }
  // A plane is the fixed point of the relaxation; 64 passes leave some of the rings' error in a hole of 20 x 40 posts.
  EXPECT_LE(worst, 12);
}

TEST(Hgt, ATileOfVoidsIsAnError) {
  Elevation tile = parse_hgt(tile_bytes([](int, int) { return -32768; }), "N10E010.hgt").value();
  const auto filled = fill_voids(tile, "some.hgt");
  ASSERT_FALSE(filled);
  EXPECT_NE(filled.error().message.find("some.hgt: all posts are void"), std::string::npos);
}

TEST(Hgt, ADegreeIsAsLongAsOnTheEllipsoid) {
  // source: NGA, Latitude/Longitude distance calculator tables (WGS 84), rounded to 1 m.
  EXPECT_NEAR(degree_length(0).north, 110574, 1);
  EXPECT_NEAR(degree_length(0).east, 111320, 1);
  EXPECT_NEAR(degree_length(45).north, 111132, 1);
  EXPECT_NEAR(degree_length(45).east, 78847, 1);
}

TEST(Hgt, ColumnsOfVoxelsAreAsHighAsTheLand) {
  // Rises 10 m a post to the south from 5 m; at its own spacing each row of voxels is a row of posts.
  const Elevation tile = parse_hgt(tile_bytes([](int row, int) { return 5 + 10 * row; }), "N45E010.hgt").value();
  ImportReport report;
  ImportOptions options;
  options.window = {0, 0, 40, 300};
  const World world = world_from_elevation(tile, "N45E010.hgt", options, report).value();
  const double metres = degree_length(46 - 299.0 / 2400).north / 1200;
  EXPECT_EQ(fact(report, "columns"), "28 x 300");  // 39 posts of 65 m are 27.4 voxels of 92.6 m
  for (int z = 0; z < 300; z += 13) {
    const int top = static_cast<int>(std::ceil((5 + 10 * z) / metres)) - 1;
    for (const int x : {0, 27}) {
      EXPECT_NE(world.store.get({x, top, z}), kAir) << z;
      EXPECT_EQ(world.store.get({x, top + 1, z}), kAir) << z;
    }
    EXPECT_EQ(world.store.get({28, top, z}), kAir);
  }
  const VoxelBox bounds = world.store.bounds();
  EXPECT_EQ(bounds.min.y, -8);  // 8 voxels below the lowest ground, at 0
  EXPECT_EQ(bounds.max.z, 299);
}

TEST(Hgt, TheGroundIsSolidWithoutHoles) {
  const auto path = shared_data("dem/N42E001.hgt");
  if (!path) GTEST_SKIP();
  ImportReport report;
  ImportOptions options;
  options.window = {300, 300, 200, 200};
  options.metres_per_voxel = 40;
  const World world = read_world(*path, options, report).value();
  const VoxelBox bounds = world.store.bounds();
  StoreReader reader(world.store);
  for (int x = bounds.min.x; x <= bounds.max.x; x += 3) {
    for (int z = bounds.min.z; z <= bounds.max.z; z += 3) {
      int y = bounds.min.y;
      while (y <= bounds.max.y && reader.get({x, y, z}) != kAir) ++y;
      EXPECT_GE(y - bounds.min.y, 8);
      while (y <= bounds.max.y) ASSERT_EQ(reader.get({x, y++, z}), kAir) << "a hole below at " << x << " " << z;
    }
  }
}

TEST(Hgt, HeightZeroIsSeaUpToZero) {
  const Elevation tile =
      parse_hgt(tile_bytes([](int, int column) { return column < 600 ? 0 : -3; }), "S01E010.hgt").value();
  ImportReport report;
  ImportOptions options;
  options.window = {590, 0, 20, 20};
  const World world = world_from_elevation(tile, "S01E010.hgt", options, report).value();
  for (const int x : {0, 5, 15}) {
    EXPECT_EQ((*world.palette)[world.store.get({x, 0, 5})].name, "air");
    EXPECT_EQ((*world.palette)[world.store.get({x, -1, 5})].name, "water");
    EXPECT_EQ((*world.palette)[world.store.get({x, -2, 5})].name, "sand");
  }
}

TEST(Hgt, TheReportCountsWhatTheFileHolds) {
  const auto path = shared_data("dem/N42E001.hgt");
  if (!path) GTEST_SKIP();
  ImportReport report;
  const auto world = read_world(*path, {}, report);
  ASSERT_TRUE(world) << world.error().message;
  EXPECT_EQ(fact(report, "voids"), "7652");
  EXPECT_EQ(fact(report, "voids filled"), "7652");
  EXPECT_EQ(fact(report, "max m"), "3100");
  EXPECT_EQ(world->store.bounds().max.y,
            static_cast<int>(std::ceil(3100 / std::stod(fact(report, "metres per voxel")))) - 1);
  ImportReport again;
  const ThreadLimit one(1);
  EXPECT_EQ(read_world(*path, {}, again)->store.content_hash(), world->store.content_hash()) << "on one thread";
}

TEST(Hgt, OptionsThatDontFitAreUsageErrors) {
  Elevation tile = parse_hgt(tile_bytes([](int, int) { return 10; }), "N10E010.hgt").value();
  const auto message = [&](const ImportOptions& options) {
    ImportReport report;
    const auto world = world_from_elevation(tile, "some.hgt", options, report);
    return world ? std::string()
                 : (world.error().kind == ErrorKind::usage ? "" : "not usage: ") + world.error().message;
  };
  ImportOptions options;
  options.window = {1200, 0, 2, 1};
  EXPECT_EQ(message(options).rfind("some.hgt: the window 1200 0 2 1", 0), 0u) << message(options);
  options.window = {INT32_MIN, 0, 0, 0};
  EXPECT_EQ(message(options).rfind("some.hgt: the window", 0), 0u);
  options = {};
  options.metres_per_voxel = 0.1;
  EXPECT_NE(message(options).find("too many"), std::string::npos);
  options = {};
  options.vertical_scale = std::nan("");
  EXPECT_NE(message(options).find("must be above 0"), std::string::npos);
  options.vertical_scale = 1e9;
  EXPECT_NE(message(options).find("voxels high"), std::string::npos);
  tile = parse_hgt(tile_bytes([](int, int) { return -400; }), "N10E010.hgt").value();
  EXPECT_NE(message(options).find("voxels high"), std::string::npos);
}

TEST(Hgt, WrongSizesAndNamesAreErrorsThatSayWhatWasExpected) {
  const Bytes bytes = tile_bytes([](int, int) { return 1; });
  for (size_t length = 0; length < bytes.size(); length += 97 * 1021) {
    const auto tile = parse_hgt(std::span(bytes).first(length), "dir/N10E010.hgt");
    ASSERT_FALSE(tile);
    EXPECT_EQ(tile.error().message.rfind("dir/N10E010.hgt: byte " + std::to_string(length) + ": ", 0), 0u)
        << tile.error().message;
  }
  for (const char* name : {"tile.hgt", "N91E000.hgt", "N10E181.hgt", "X10E010.hgt", "N1xE010.hgt", "", "N10E01"}) {
    const auto tile = parse_hgt(bytes, name);
    ASSERT_FALSE(tile) << name;
    EXPECT_NE(tile.error().message.find("expected one like N42E001.hgt"), std::string::npos);
  }
  EXPECT_EQ(parse_hgt(bytes, "a/s29w072.HGT")->south, -29);
  EXPECT_EQ(parse_hgt(bytes, "a/s29w072.HGT")->west, -72);
}

TEST(Zip, StoredAndDeflatedEntriesAreRead) {
  const Bytes bytes = tile_bytes([](int row, int column) { return row + column; });
  for (const uint16_t method : {0, 8}) {
    const Bytes archive = zip_of("x\\y/N10E010.hgt", bytes, static_cast<uint32_t>(bytes.size()), method);
    const auto tile = parse_hgt_zip(archive, "any.zip");
    ASSERT_TRUE(tile) << tile.error().message;
    EXPECT_EQ(tile->at(3, 4), 7);
    EXPECT_EQ(tile->south, 10);
  }
}

TEST(HardCaseIO9, AZipBombIsStoppedByTheSizeThatATileHas) {
  const auto message = [](const Bytes& archive) {
    const auto tile = parse_hgt_zip(archive, "bomb.zip");
    return tile ? "" : tile.error().message;
  };
  const Bytes zeros(16 << 20);
  // Claims its true 16 MiB; claims the size of a tile; claims nearly 4 GiB.
  EXPECT_NE(message(zip_of("N10E010.hgt", zeros, 16 << 20)).find("claims 16777216 bytes; expected 2884802"),
            std::string::npos);
  EXPECT_NE(message(zip_of("N10E010.hgt", zeros, 2884802)).find("damaged, or don't have the size"), std::string::npos);
  EXPECT_NE(message(zip_of("N10E010.hgt", zeros, 0xfffffffe)).find("claims 4294967294 bytes"), std::string::npos);
}

TEST(Zip, DamagedArchivesNeverCrash) {
  const auto path = shared_data("dem/S29W072.hgt.zip");
  if (!path) GTEST_SKIP();
  const Bytes whole = bytes_of(*path);
  // Every cut of the directory at the end, and some of the data.
  for (size_t cut = 1; cut < 2000; cut += 7) {
    const auto tile =
        parse_hgt_zip(std::span(whole).first(whole.size() - std::min(cut * cut, whole.size())), "cut.zip");
    ASSERT_FALSE(tile);
    EXPECT_EQ(tile.error().message.rfind("cut.zip: byte ", 0), 0u) << tile.error().message;
  }
  // A small archive, so that many copies are quick: the structure is the same.
  const Bytes content = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  const Bytes small = zip_of("a.txt", content, static_cast<uint32_t>(content.size()));
  int intact = 0, failed = 0;
  for_each_mutation(small, small.size(), 3000, 5, [&](std::span<const uint8_t> damaged) {
    const auto entries = list_zip(damaged, "a.zip");
    if (!entries) return void(++failed);
    for (const ZipEntry& entry : *entries) {
      const auto read = extract_zip(damaged, entry, 1000, "a.zip");
      ++(read ? intact : failed);
      if (read) {
        EXPECT_EQ(*read, content) << "damage went unseen";
      }
    }
  });
  EXPECT_GT(intact, 0);
  EXPECT_GT(failed, 0);
}

}  // namespace
}  // namespace world
