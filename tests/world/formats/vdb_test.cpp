#include "world/formats/vdb.h"

#include <cmath>
#include <cstdio>
#include <limits>

#include <gtest/gtest.h>

#include "tests/world/formats/formats_support.h"
#include "world/base/random.h"

namespace world {
namespace {

using Bytes = std::vector<uint8_t>;
using nlohmann::json;

json box_json(const VoxelBox& box) { return {{box.min.x, box.min.y, box.min.z}, {box.max.x, box.max.y, box.max.z}}; }

/// "Tree_float_5_4_3_HalfFloat" is a float tree that was stored as half.
std::string stored_type(const VdbGridFacts& grid) { return grid.type + (grid.half ? "_HalfFloat" : ""); }

void expect_vec(const Vec3d& v, const json& expected, double tolerance) {
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(v[axis], expected[static_cast<size_t>(axis)].get<double>(), tolerance);
}

TEST(Vdb, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  int files = 0;
  for (const auto& [name, facts] : shared_facts().items()) {
    if (!name.starts_with("vdb/")) continue;
    SCOPED_TRACE(name);
    ++files;
    const auto found = inspect_vdb(*shared_data(name));
    ASSERT_TRUE(found) << found.error().message;
    const json& header = facts["header"];
    EXPECT_EQ(found->file_version, header["file_version"]);
    EXPECT_EQ(std::to_string(found->library_major) + "." + std::to_string(found->library_minor), header["lib"]);
    EXPECT_EQ(found->uuid, header["uuid"]);
    ASSERT_EQ(found->grids.size(), header["grids"].size());
    ASSERT_EQ(found->grids.size(), 1u);
    const VdbGridFacts& grid = found->grids[0];
    const json &stored = header["grids"][0], &meta = stored["meta"];
    EXPECT_EQ(grid.name, stored["unique_name"]);
    EXPECT_EQ(stored_type(grid), stored["type"]);
    EXPECT_EQ(grid.map, stored["map"]);
    EXPECT_EQ(grid.grid_class, meta["class"]);
    EXPECT_EQ(grid.active_voxels, meta["file_voxel_count"]);
    EXPECT_EQ(box_json(grid.bounds), json({meta["file_bbox_min"], meta["file_bbox_max"]}));
    if (facts["stats"].is_string()) continue;  // the point grid
    const json& stats = facts["stats"][0];
    EXPECT_EQ(grid.active_voxels, stats["active"]);
    EXPECT_EQ(grid.leaf_nodes, stats["leafs"]);
    EXPECT_EQ(grid.active_tiles, stats["active_tiles"]);
    expect_vec(grid.voxel_size, stats["voxel_size"], 1e-12);
    expect_vec(grid.origin, stats["idx0_world"], 1e-9);
    ASSERT_TRUE(grid.values);
    EXPECT_DOUBLE_EQ(grid.values->background, stats["background"].get<double>());
    EXPECT_DOUBLE_EQ(grid.values->min, stats["min"].get<double>());
    EXPECT_DOUBLE_EQ(grid.values->max, stats["max"].get<double>());
    const double sum = stats["sum"].get<double>();
    EXPECT_NEAR(grid.values->sum, sum, 1e-9 * std::abs(sum));  // both in double; the order differs
    EXPECT_NEAR(grid.values->sum / static_cast<double>(grid.active_voxels), stats["mean"].get<double>(),
                1e-9 * std::abs(sum));
  }
  EXPECT_EQ(files, 6);
}

TEST(Vdb, APointGridHasItsPointsAndLeaves) {
  const auto path = shared_data("vdb/sphere_points.vdb");
  if (!path) GTEST_SKIP();
  const VdbGridFacts grid = inspect_vdb(*path)->grids[0];
  EXPECT_EQ(grid.points, 9802u);
  EXPECT_EQ(grid.leaf_nodes, 20u);
  EXPECT_EQ(grid.active_voxels, 1178u);
  EXPECT_NEAR(grid.voxel_size.x, 0.1177, 1e-6);
}

TEST(Vdb, FogAndPointsBecomeOneBlockWhereActive) {
  for (const auto& [name, voxels] : std::map<std::string, uint64_t>{
           {"vdb/dragon.vdb", 19660}, {"vdb/sphere_points.vdb", 1178}, {"vdb/wdas_cloud_sixteenth.vdb", 415642}}) {
    const auto path = shared_data(name);
    if (!path) GTEST_SKIP();
    ImportReport report;
    const auto world = read_world(*path, {}, report);
    ASSERT_TRUE(world) << world.error().message;
    EXPECT_EQ(world->store.voxel_count(), voxels) << name;
    EXPECT_EQ(world->palette->size(), 2u);
    EXPECT_EQ(fact(report, "active voxels"), std::to_string(voxels));
  }
}

TEST(Vdb, ALevelSetBecomesSolidInside) {
  const auto path = shared_data("vdb/sphere.vdb");
  if (!path) GTEST_SKIP();
  ImportReport report;
  const World world = read_world(*path, {}, report).value();
  EXPECT_NE(world.store.get({0, 0, 0}), kAir);
  EXPECT_EQ(world.store.get({62, 62, 62}), kAir);
  const VoxelBox bounds = world.store.bounds();
  EXPECT_EQ(bounds.min.x, -bounds.max.x);
  // A ball: pi/6 of its cube, within the layer of one voxel that rounding can add or take.
  const double radius = bounds.max.x + 0.5, volume = 4.0 / 3 * 3.14159265 * radius * radius * radius;
  EXPECT_NEAR(static_cast<double>(world.store.voxel_count()), volume, 4 * 3.14159265 * radius * radius);
}

/// Random voxels, solid boxes, a whole region, and places far from the origin.
World sample_world() {
  World world(standard_blocks());
  EditBatch batch;
  const auto blocks = static_cast<uint64_t>(world.palette->size() - 1);
  for (int i = 0; i < 3000; ++i) {
    const uint64_t r = random_bits(7, i, 0, 0);
    batch.set({static_cast<int>(r & 255) - 128, static_cast<int>(r >> 8 & 63), static_cast<int>(r >> 16 & 127)},
              static_cast<BlockId>(1 + (r >> 32) % blocks));
  }
  batch.fill({{300, -20, 5}, {340, 30, 77}}, 3);
  batch.fill({{1024, 0, 0}, {1024 + 255, 127, 127}}, 2);
  batch.set({-kWorldBorder, kWorldBorder - 1, 1000000}, 4);
  EXPECT_TRUE(world.store.apply(batch));
  world.metadata["seed"] = "42";
  world.metadata["voxel_size_m"] = "0.25";
  return world;
}

TEST(Vdb, AWorldComesBackBlockForBlock) {
  const TemporaryFolder folder;
  const World world = sample_world();
  ASSERT_TRUE(write_world(world, folder / "a.vdb"));
  ImportReport report;
  const auto back = read_world(folder / "a.vdb", {}, report);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->store.content_hash(), world.store.content_hash());
  EXPECT_EQ(back->store.voxel_count(), world.store.voxel_count());
  EXPECT_EQ(back->store.bounds(), world.store.bounds());
  EXPECT_EQ(back->store.census(), world.store.census());
  EXPECT_EQ(back->metadata.at("seed"), "42");
  ASSERT_EQ(back->palette->size(), world.palette->size());
  for (size_t id = 0; id < world.palette->size(); ++id) {
    const auto block = static_cast<BlockId>(id);
    EXPECT_EQ(toml_from_block((*back->palette)[block]), toml_from_block((*world.palette)[block]));
  }
  // The same world gives the same bytes, also after a round trip.
  ASSERT_TRUE(write_world(*back, folder / "b.vdb"));
  EXPECT_EQ(bytes_of(folder / "a.vdb"), bytes_of(folder / "b.vdb"));
}

TEST(Vdb, AnEmptyWorldComesBack) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_world(World(), folder / "a.vdb"));
  ImportReport report;
  const auto back = read_world(folder / "a.vdb", {}, report);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->store.voxel_count(), 0u);
}

TEST(Vdb, OpenVdbsOwnToolReadsWhatWeWrite) {
  if (std::system("command -v vdb_print > /dev/null") != 0)
    GTEST_SKIP() << "skipped: vdb_print (libopenvdb-tools) is not here";
  const TemporaryFolder folder;
  World world = sample_world();
  for (int i = 0; i < 1234; ++i) world.store.make_int_layer(Layer::liquid).set({i, -i, 3}, i - 600);
  ASSERT_TRUE(write_world(world, folder / "a.vdb"));
  const std::string command = "vdb_print -l -m " + (folder / "a.vdb").string() + " 2>&1";
  std::FILE* pipe = ::popen(command.c_str(), "r");
  ASSERT_TRUE(pipe);
  std::string text;
  for (char line[4096]; std::fgets(line, sizeof line, pipe);) text += line;
  EXPECT_EQ(::pclose(pipe), 0) << text;
  for (const char* expected :
       {"block_id", "int32", "loam_block_1: [\"", "creator: Loam", "voxel size: 0.25", "liquid", "1,234", "-600"}) {
    EXPECT_NE(text.find(expected), std::string::npos) << "no " << expected << " in:\n" << text.substr(0, 4000);
  }
  EXPECT_NE(text.find(std::to_string(world.store.voxel_count())), std::string::npos);
}

TEST(Vdb, BlockIdsOutsideOfThePaletteAreRejected) {
  // A file whose palette lost its entries: the names of its metadata are the last thing that says how many there are.
  const TemporaryFolder folder;
  ASSERT_TRUE(write_world(sample_world(), folder / "a.vdb"));
  Bytes bytes = bytes_of(folder / "a.vdb");
  const std::string key = "loam_block_2";
  const auto at = std::search(bytes.begin(), bytes.end(), key.begin(), key.end());
  ASSERT_NE(at, bytes.end());
  // "loam_block_2" is followed by other digits in other entries; metadata are sorted, so the first is the entry "2".
  *at = 'L';
  ImportReport report;
  const auto world = world_from_vdb(bytes, "some.vdb", report);
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().message.find("some.vdb: the block id "), std::string::npos) << world.error().message;
}

TEST(Vdb, AnotherKindOfFileIsRejectedInOneSentence) {
  for (const Bytes& bytes : {Bytes{}, Bytes{' ', 'B', 'D', 'V'}, Bytes(1000, 'x')}) {
    const auto facts = inspect_vdb(bytes, "some.vdb");
    ASSERT_FALSE(facts);
    EXPECT_EQ(facts.error().message, "some.vdb: byte 0: expected the magic number of OpenVDB; this is no .vdb file");
  }
}

TEST(HardCaseIO10, ACutVdbIsAnErrorThatNamesFileAndByte) {
  const auto path = shared_data("vdb/torus01.vdb");
  if (!path) GTEST_SKIP();
  // Each cut costs a child process: every 97th byte of the first 2 kB (header, metadata, topology), then every 1997th.
  const Bytes bytes = bytes_of(*path);
  for (size_t length = 0; length < bytes.size(); length += length < 2000 ? 97 : 1997) {
    const auto facts = inspect_vdb(std::span(bytes).first(length), "cut.vdb");
    ASSERT_FALSE(facts) << length;
    EXPECT_EQ(facts.error().message.rfind("cut.vdb: ", 0), 0u) << facts.error().message;
    EXPECT_NE(facts.error().message.find("byte "), std::string::npos) << facts.error().message;
  }
}

TEST(HardCaseIO10, ANumberThatIsNotFiniteIsRejected) {
  const auto path = shared_data("vdb/wdas_cloud_sixteenth.vdb");
  if (!path) GTEST_SKIP();
  // Its values lie uncompressed in the second half; one of them is 1.
  const Bytes whole = bytes_of(*path);
  const uint8_t one[] = {0x00, 0x00, 0x80, 0x3f};
  for (const std::array<uint8_t, 4>& bad : {std::array<uint8_t, 4>{0, 0, 0xc0, 0x7f}, {0, 0, 0x80, 0xff}}) {
    Bytes bytes = whole;
    const auto at =
        std::search(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2), bytes.end(), one, one + 4);
    ASSERT_NE(at, bytes.end());
    std::copy(bad.begin(), bad.end(), at);
    const auto facts = inspect_vdb(bytes, "some.vdb");
    ASSERT_FALSE(facts);
    EXPECT_NE(facts.error().message.find("some.vdb: grid 'density'"), std::string::npos) << facts.error().message;
    EXPECT_NE(facts.error().message.find("not a finite number"), std::string::npos) << facts.error().message;
  }
}

TEST(HardCaseIO10, DamagedVdbsNeverCrashAndGiveNoNumberThatIsNotFinite) {
  const auto path = shared_data("vdb/torus01.vdb");
  if (!path) GTEST_SKIP();
  int read = 0, failed = 0;
  for_each_mutation(bytes_of(*path), 1500, 120, 23, [&](std::span<const uint8_t> damaged) {
    ImportReport report;
    const auto world = world_from_vdb(damaged, "damaged.vdb", report);
    ++(world ? read : failed);
    if (!world) {
      EXPECT_EQ(world.error().message.rfind("damaged.vdb: ", 0), 0u) << world.error().message;
      return;
    }
    EXPECT_LE(world->store.voxel_count(), uint64_t{1} << 36);
  });
  EXPECT_GT(read, 0);
  EXPECT_GT(failed, 0);
}

}  // namespace
}  // namespace world
