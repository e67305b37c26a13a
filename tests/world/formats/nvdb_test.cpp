/// NanoVDB files, and what .vdb files with several grids and turned maps become.
#include "world/formats/vdb/nvdb.h"

#include <cstring>
#include <fstream>

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include "tests/world/formats/formats_support.h"
#include "tests/world/formats/nvdb_support.h"

namespace world {
namespace {

using Bytes = std::vector<uint8_t>;
using nlohmann::json;

World world_of(const std::filesystem::path& path, ImportReport& report, const ImportOptions& options = {}) {
  Result<World> world = read_world(path, options, report);
  EXPECT_TRUE(world.ok()) << world.error().message;
  return world.ok() ? std::move(*world) : World();
}

TEST(Nvdb, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  int files = 0;
  for (const auto& [name, facts] : shared_facts().items()) {
    if (!name.starts_with("nvdb/")) continue;
    SCOPED_TRACE(name);
    ++files;
    const auto found = inspect_nvdb(bytes_of(*shared_data(name)), name);
    ASSERT_TRUE(found) << found.error().message;
    const json &segment = facts["segments"][0], &grid = segment["grids"][0];
    EXPECT_EQ(found->version, segment["version"]);
    EXPECT_EQ(found->codec, segment["codec"]);
    ASSERT_EQ(found->grids.size(), segment["grids"].size());
    const NvdbGridFacts& g = found->grids[0];
    EXPECT_EQ(g.name, grid["name"]);
    EXPECT_EQ(g.type, grid["gridType"]);
    EXPECT_EQ(g.grid_class, grid["gridClass"]);
    EXPECT_EQ(g.active_voxels, grid["voxels"]);
    EXPECT_EQ(g.bytes, grid["grid_bytes"]);
    EXPECT_EQ(json({g.bounds.min.x, g.bounds.min.y, g.bounds.min.z, g.bounds.max.x, g.bounds.max.y, g.bounds.max.z}),
              grid["index_bbox"]);
    EXPECT_EQ(json({g.leaf_nodes, g.lower_nodes, g.upper_nodes, g.root_nodes}),
              grid["node_counts_leaf_lower_upper_root"]);
    EXPECT_EQ(json({g.active_tiles[0], g.active_tiles[1], g.active_tiles[2]}), grid["active_tile_counts"]);
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<size_t>(a);
      EXPECT_DOUBLE_EQ(g.voxel_size[a], grid["voxel_size"][i].get<double>());
      EXPECT_NEAR(g.world_min[a], grid["world_bbox"][i].get<double>(), 6e-7);  // the facts have six decimals
      EXPECT_NEAR(g.world_max[a], grid["world_bbox"][i + 3].get<double>(), 6e-7);
    }
  }
  EXPECT_EQ(files, 2);
}

TEST(Nvdb, TheSameVolumeAsTheVdbFile) {
  for (const auto& [nano, open] : std::map<std::string, std::string>{
           {"nvdb/smoke-blosc.nvdb", "vdb/smoke.vdb"}, {"nvdb/derived_torus01_zip.nvdb", "vdb/torus01.vdb"}}) {
    if (!shared_data(nano)) GTEST_SKIP();
    ImportReport a_report, b_report;
    const World a = world_of(*shared_data(nano), a_report), b = world_of(*shared_data(open), b_report);
    EXPECT_EQ(a.store.voxel_count(), b.store.voxel_count());
    EXPECT_EQ(a.store.bounds(), b.store.bounds());
    const FloatLayer *x = a.store.find_layer(Layer::density), *y = b.store.find_layer(Layer::density);
    ASSERT_TRUE(x && y);
    ASSERT_EQ(x->regions(), y->regions());
    for (const RegionPos r : x->regions())
      EXPECT_EQ(*x->encode_region(r, StreamCompression::none), *y->encode_region(r, StreamCompression::none));
  }
}

/// Blocks, layers of floats and one of integers.
World layered_world() {
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{-20, -3, 7}, {30, 40, 50}}, 3);
  batch.fill({{128, 128, 128}, {255, 255, 255}}, 2);
  for (int i = 0; i < 200; ++i) batch.set({i * 7 % 90, -i, i * 3}, static_cast<BlockId>(1 + i % 40));
  EXPECT_TRUE(world.store.apply(batch));
  for (int i = 0; i < 300; ++i) {
    world.store.make_layer(Layer::density).set({i, i % 17, -i}, 0.25f * static_cast<float>(i));
    world.store.make_layer(Layer::distance).set({-i, i % 5, i}, 0.5f - static_cast<float>(i % 3));
    world.store.make_int_layer(Layer::heat).set({-i, i % 5, i}, (i - 150) * 14'000'000);
  }
  world.metadata["voxel_size_m"] = "0.25";
  world.metadata["seed"] = "7";
  return world;
}

TEST(Nvdb, AWorldWithItsLayersComesBack) {
  const TemporaryFolder folder;
  const World world = layered_world();
  for (const char* file : {"a.nvdb", "a.vdb"}) {
    SCOPED_TRACE(file);
    const Status written = write_world(world, folder / file);
    ASSERT_TRUE(written) << written.error().message;
    ImportReport report;
    const World back = world_of(folder / file, report);
    EXPECT_TRUE(report.warnings.empty()) << report.warnings.front();
    EXPECT_EQ(back.store.content_hash(), world.store.content_hash());
    EXPECT_EQ(back.store.census(), world.store.census());
    EXPECT_EQ(back.metadata.at("seed"), "7");
    ASSERT_EQ(back.palette->size(), world.palette->size());
    for (size_t id = 0; id < world.palette->size(); ++id)
      EXPECT_EQ(toml_from_block((*back.palette)[static_cast<BlockId>(id)]),
                toml_from_block((*world.palette)[static_cast<BlockId>(id)]));
    for (const Layer layer : {Layer::density, Layer::distance}) {
      const FloatLayer *x = world.store.find_layer(layer), *y = back.store.find_layer(layer);
      ASSERT_TRUE(x && y);
      ASSERT_EQ(x->regions(), y->regions());
      for (const RegionPos r : x->regions())
        EXPECT_EQ(*x->encode_region(r, StreamCompression::none), *y->encode_region(r, StreamCompression::none));
    }
    const IntLayer *x = world.store.find_int_layer(Layer::heat), *y = back.store.find_int_layer(Layer::heat);
    ASSERT_TRUE(x && y);
    ASSERT_EQ(x->regions(), y->regions());
    for (const RegionPos r : x->regions())
      EXPECT_EQ(*x->encode_region(r, StreamCompression::none), *y->encode_region(r, StreamCompression::none));
    // The same world gives the same bytes.
    ASSERT_TRUE(write_world(back, folder / (std::string("b") + file)));
    EXPECT_EQ(bytes_of(folder / file), bytes_of(folder / (std::string("b") + file)));
  }
}

void write_grids(const std::filesystem::path& path, const openvdb::GridPtrVec& grids) {
  std::ofstream out(path, std::ios::binary);
  openvdb::io::Stream(out).write(grids);
}

TEST(Vdb, SeveralLevelSetsLieWhereTheirMapsSay) {
  openvdb::initialize();
  const TemporaryFolder folder;
  // A ball of radius 10 at (0, 0, 0); another of radius 6 whose own space begins 30 voxels to the east; a third at half
  // the voxel size, a hundred of ours up; and a turned one.
  auto a = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(5, {0, 0, 0}, 0.5);
  auto b = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(3, {0, 0, 0}, 0.5);
  auto c = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(4, {0, 0, 0}, 0.25);
  a->setName("surface"), b->setName("east"), c->setName("up");
  b->transform().postTranslate({15, 0, 0});
  c->transform().postTranslate({0, 50, 0});
  write_grids(folder / "balls.vdb", {a, b, c});
  ImportReport report;
  const World world = world_of(folder / "balls.vdb", report);
  EXPECT_TRUE(report.warnings.empty()) << report.warnings.front();
  const auto name = [&](VoxelPos v) { return (*world.palette)[world.store.get(v)].name; };
  EXPECT_EQ(name({0, 0, 0}), "vdb:surface");
  EXPECT_EQ(name({9, 0, 0}), "vdb:surface");
  EXPECT_EQ(name({30, 0, 0}), "vdb:east");
  EXPECT_EQ(name({0, 100, 0}), "vdb:up");
  EXPECT_EQ(name({0, 107, 0}), "vdb:up");
  EXPECT_EQ(name({15, 0, 0}), "air");
  EXPECT_EQ(name({0, 110, 0}), "air");
  const double ball = 4.0 / 3 * 3.14159265;
  const Census census = world.store.census();
  EXPECT_NEAR(static_cast<double>(census.at(*world.palette->find("vdb:up"))), ball * 8 * 8 * 8, 60);
  EXPECT_NEAR(static_cast<double>(census.at(*world.palette->find("vdb:east"))), ball * 6 * 6 * 6, 60);
  // --grid takes one alone, and no other name.
  ImportReport one;
  const World up = world_of(folder / "balls.vdb", one, {.grid = "up"});
  EXPECT_EQ(up.palette->size(), 2u);
  EXPECT_EQ(one.warnings.size(), 2u);
  EXPECT_NEAR(static_cast<double>(up.store.voxel_count()), ball * 16 * 16 * 16, 200);
  const auto none = read_world(folder / "balls.vdb", {.grid = "down"}, one);
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("surface, east, up"), std::string::npos);
}

TEST(Vdb, TurnedAndStretchedGridsStandAsInTheirWorld) {
  openvdb::initialize();
  const TemporaryFolder folder;
  // A rod of fog along index x, of voxels 1 x 1 x 2, turned to stand upright.
  const auto rod = openvdb::FloatGrid::create(0);
  rod->setName("density");
  rod->fill({{0, 0, 0}, {39, 3, 1}}, 2.0f, true);
  openvdb::Mat4d matrix(openvdb::Mat4d::identity());
  matrix.preScale(openvdb::Vec3d(0.5, 0.5, 1));
  matrix.postRotate(openvdb::math::Z_AXIS, 3.14159265358979 / 2);  // x becomes y
  rod->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  write_grids(folder / "rod.vdb", {rod});
  ImportReport report;
  const World world = world_of(folder / "rod.vdb", report);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("resampled"), std::string::npos);
  const VoxelBox box = world.store.bounds();
  EXPECT_EQ(box.max.y - box.min.y + 1, 40);
  EXPECT_EQ(box.max.x - box.min.x + 1, 4);
  EXPECT_NEAR(box.max.z - box.min.z + 1, 4, 1) << "two voxels of double depth";
  EXPECT_EQ(world.metadata.at("voxel_size_m"), "0.5");
  const FloatLayer* density = world.store.find_layer(Layer::density);
  ASSERT_TRUE(density);
  EXPECT_FLOAT_EQ(density->get({box.min.x + 2, 20, box.min.z + 1}), 2.0f);
}

TEST(Vdb, TheWorldPlaceOfAFogVolumeComesBack) {
  const auto path = shared_data("vdb/smoke.vdb");
  if (!path) GTEST_SKIP();
  const TemporaryFolder folder;
  ImportReport report;
  const World world = world_of(*path, report);
  ASSERT_TRUE(write_world(world, folder / "a.vdb"));
  const VdbFacts before = inspect_vdb(*path).value(), after = inspect_vdb(folder / "a.vdb").value();
  ASSERT_EQ(after.grids.size(), 2u);
  const VdbGridFacts& density = after.grids[1];
  EXPECT_EQ(density.name, "density");
  EXPECT_EQ(density.active_voxels, before.grids[0].active_voxels);
  EXPECT_DOUBLE_EQ(density.values->sum, before.grids[0].values->sum);
  EXPECT_EQ(density.bounds, before.grids[0].bounds);
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(density.origin[a], before.grids[0].origin[a], 1e-9);
    EXPECT_NEAR(density.voxel_size[a], before.grids[0].voxel_size[a], 1e-9);
  }
}

TEST(Nvdb, DamageIsAnErrorNeverACrash) {
  const auto path = shared_data("nvdb/derived_torus01_zip.nvdb");
  if (!path) GTEST_SKIP();
  const Bytes zipped = bytes_of(*path), plain = plain_torus(zipped);
  ImportReport report;
  const auto whole = world_from_nvdb(plain, "plain.nvdb", report);
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  EXPECT_EQ(whole->store.voxel_count(), 2450u);
  for_each_truncation(zipped, 37, [&](std::span<const uint8_t> cut) {
    const auto world = world_from_nvdb(cut, "cut.nvdb", report);
    ASSERT_FALSE(world.ok());
    EXPECT_EQ(world.error().message.rfind("cut.nvdb: ", 0), 0u) << world.error().message;
  });
  int read = 0, failed = 0;
  for (const Bytes& bytes : {zipped, plain}) {
    // The root and its table lie in the first kilobyte after the head of the grid.
    for_each_mutation(bytes, 2500, 300, 29, [&](std::span<const uint8_t> damaged) {
      const auto world = world_from_nvdb(damaged, "damaged.nvdb", report);
      ++(world.ok() ? read : failed);
      if (world.ok()) return;
      EXPECT_EQ(world.error().message.rfind("damaged.nvdb: ", 0), 0u) << world.error().message;
    });
  }
  EXPECT_GT(read, 0);
  EXPECT_GT(failed, 0);
}

TEST(Nvdb, ClaimsOfSizeAreNotBelieved) {
  const auto path = shared_data("nvdb/derived_torus01_zip.nvdb");
  if (!path) GTEST_SKIP();
  Bytes bytes = bytes_of(*path);
  const uint64_t huge = uint64_t{1} << 40;
  std::memcpy(&bytes[16], &huge, 8);
  ImportReport report;
  const auto world = world_from_nvdb(bytes, "bomb.nvdb", report);
  ASSERT_FALSE(world.ok());
  EXPECT_NE(world.error().message.find("claim to unpack"), std::string::npos) << world.error().message;
}

}  // namespace
}  // namespace world
