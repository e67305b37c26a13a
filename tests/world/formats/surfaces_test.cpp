/// Meshes and points from files: the facts worked out elsewhere, and what becomes of them.
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/world/formats/formats_support.h"
#include "world/meshes/builder.h"
#include "world/meshes/points.h"

namespace world {
namespace {

using nlohmann::json;

TEST(MeshFiles, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  int files = 0;
  for (const auto& [name, facts] : shared_facts().items()) {
    if (!name.ends_with(".obj")) continue;
    SCOPED_TRACE(name);
    ++files;
    const auto bytes = bytes_of(*shared_data(name));
    MeshReport report;
    MeshFileFacts found;
    const auto mesh = read_obj(bytes, name, report, &found);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(found.vertices, facts["verts"]);
    EXPECT_EQ(found.textures, facts["vt"]);
    EXPECT_EQ(found.normals, facts["vn"]);
    EXPECT_EQ(found.faces, facts["faces"]);
    EXPECT_EQ(found.groups, facts["groups"]);
    EXPECT_EQ(found.negative_indices, facts["negative_indices"]);
    EXPECT_EQ(found.max_index, facts["max_index"]);
    json sizes = json::object();
    for (const auto& [size, count] : found.face_sizes) sizes[std::to_string(size)] = count;
    EXPECT_EQ(sizes, facts["face_sizes"]);
    EXPECT_EQ(mesh->triangles.size() + report.degenerate, facts["tris"]);
    const auto polygons = read_obj_polygons(bytes, name);
    ASSERT_TRUE(polygons);
    Vec3f low = polygons->positions[0], high = low;
    for (const Vec3f& p : polygons->positions) low = glm::min(low, p), high = glm::max(high, p);
    for (int a = 0; a < 3; ++a) {
      // The file's decimals, read as floats.
      EXPECT_FLOAT_EQ(low[a], facts["bbox"][0][static_cast<size_t>(a)].get<float>());
      EXPECT_FLOAT_EQ(high[a], facts["bbox"][1][static_cast<size_t>(a)].get<float>());
    }
  }
  EXPECT_GE(files, 20);
}

TEST(PointFiles, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  for (const char* name : {"points/target.ply", "points/sac_plane_test.pcd"}) {
    SCOPED_TRACE(name);
    const json& facts = shared_facts()[name];
    const auto path = *shared_data(name);
    const auto points = read_point_file(path);
    ASSERT_TRUE(points) << points.error().message;
    EXPECT_EQ(points->positions.size(), facts["finite"]);
    if (facts.contains("points")) {
      EXPECT_EQ(points->positions.size() + points->not_finite, facts["points"]);
    } else {
      EXPECT_EQ(points->positions.size() + points->not_finite, facts["elements"][0][1]);
    }
    Vec3d low(1e9), high(-1e9), sum(0.0);
    for (const Vec3d& p : points->positions) low = glm::min(low, p), high = glm::max(high, p), sum += p;
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<size_t>(a);
      // The facts are rounded to six decimals.
      EXPECT_NEAR(low[a], facts["bbox"][0][i].get<double>(), 6e-7);
      EXPECT_NEAR(high[a], facts["bbox"][1][i].get<double>(), 6e-7);
      EXPECT_NEAR(sum[a] / static_cast<double>(points->positions.size()), facts["centroid"][i].get<double>(), 6e-7);
    }
    for (const auto& [size, voxels] : facts["occupied_voxels_floor(p/s)"].items()) {
      ImportReport report;
      const auto world = read_world(path, {.metres_per_voxel = std::stod(size)}, report);
      ASSERT_TRUE(world) << world.error().message;
      EXPECT_EQ(world->store.voxel_count(), voxels) << size;
    }
  }
}

TEST(PointFiles, ZUpOfTheFileIsUpInTheWorld) {
  TemporaryFolder folder;
  std::ofstream(folder / "axes.ply")
      << "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
         "property double z\nend_header\n0.5 0.5 0.5\n10.5 0.5 0.5\n0.5 0.5 7.5\n";
  ImportReport report;
  const World world = read_world(folder / "axes.ply", {.metres_per_voxel = 1}, report).value();
  EXPECT_EQ(world.store.bounds(), (VoxelBox{{0, 0, -1}, {10, 7, -1}}));
  const World y_up =
      read_world(folder / "axes.ply", {.metres_per_voxel = 1, .up = ImportOptions::Up::y}, report).value();
  EXPECT_EQ(y_up.store.bounds(), (VoxelBox{{0, 0, 0}, {10, 0, 7}}));
}

TEST(PointFiles, AllEncodingsOfPcdGiveTheSamePoints) {
  // Three points, once as text, once as bytes, once field by field as LZF literals and runs.
  const std::string head =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z i\nSIZE 4 4 4 2\nTYPE F F F U\nCOUNT 1 1 1 2\nWIDTH 3\n"
      "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA ";
  const float p[3][3] = {{1, 2, 3}, {1, 2.5f, -3}, {1, NAN, 0}};
  const auto bytes = [](const std::string& s) { return std::vector<uint8_t>(s.begin(), s.end()); };
  const auto raw = [](const void* data, size_t size) { return std::string(static_cast<const char*>(data), size); };
  std::string binary, fields;
  for (const auto& q : p) binary += raw(q, 12) + std::string("\1\0\2\0", 4);
  for (int a = 0; a < 3; ++a)
    for (const auto& q : p) fields += raw(&q[a], 4);
  for (int i = 0; i < 3; ++i) fields += std::string("\1\0\2\0", 4);
  // The first four bytes as literals, the next eight as a copy from four back, the rest as literals.
  std::string packed = std::string(1, 3) + fields.substr(0, 4) + std::string("\xc0\3", 2);
  for (size_t at = 12; at < fields.size(); at += 12) packed += std::string(1, 11) + fields.substr(at, 12);
  const uint32_t sizes[2] = {static_cast<uint32_t>(packed.size()), static_cast<uint32_t>(fields.size())};
  for (const std::string& file : {head + "ascii\n1 2 3 1 2\n1 2.5 -3 1 2\n1 nan 0 1 2\n", head + "binary\n" + binary,
                                  head + "binary_compressed\n" + raw(sizes, 8) + packed}) {
    const auto points = read_pcd(bytes(file), "a.pcd");
    ASSERT_TRUE(points) << points.error().message;
    ASSERT_EQ(points->positions.size(), 2u);
    EXPECT_EQ(points->not_finite, 1u);
    EXPECT_EQ(points->positions[0], Vec3d(1, 2, 3));
    EXPECT_EQ(points->positions[1], Vec3d(1, 2.5, -3));
  }
  // Cut anywhere, or with any byte changed, it is an error or other points, never a crash.
  const auto whole = bytes(head + "binary_compressed\n" + raw(sizes, 8) + packed);
  for_each_truncation(whole, 1, [&](std::span<const uint8_t> cut) { EXPECT_FALSE(read_pcd(cut, "cut.pcd")); });
  for_each_mutation(whole, whole.size(), 20000, 5, [&](std::span<const uint8_t> damaged) {
    const auto points = read_pcd(damaged, "damaged.pcd");
    EXPECT_LE(points ? points->positions.size() : 0, whole.size());
  });
}

TEST(MeshFiles, DamagedMeshesAreErrorsOrMeshes) {
  for (const char* name : {"gt/mitsuba/meshes/cbox/smallbox.obj", "points/target.ply"}) {
    const auto path = shared_data(name);
    if (!path) GTEST_SKIP();
    auto bytes = bytes_of(*path);
    bytes.resize(std::min<size_t>(bytes.size(), 4000));
    for_each_mutation(bytes, 300, 2000, 17, [&](std::span<const uint8_t> damaged) {
      MeshReport report;
      if (std::string(name).ends_with(".obj")) {
        (void)read_obj(damaged, "damaged.obj", report);
        (void)read_obj_polygons(damaged, "damaged.obj");
      } else {
        (void)read_ply(damaged, "damaged.ply", report);
        (void)read_ply_points(damaged, "damaged.ply");
      }
    });
  }
}

TEST(MeshFiles, RealMeshesBecomeSolids) {
  for (const auto& [name, holes] :
       std::map<std::string, bool>{{"mesh/spot.obj", false}, {"mesh/stanford-bunny.obj", true}}) {
    const auto path = shared_data(name);
    if (!path) GTEST_SKIP();
    ImportReport report;
    const auto world = read_world(*path, {}, report);
    ASSERT_TRUE(world) << world.error().message;
    EXPECT_EQ(!report.warnings.empty(), holes) << name;
    const VoxelBox box = world->store.bounds();
    const uint64_t volume = box.volume(), voxels = world->store.voxel_count();
    EXPECT_GT(voxels, volume / 8) << name << " is filled";
    EXPECT_LT(voxels, volume / 2);
    ImportReport shell_report;
    const World shell = read_world(*path, {.shell = true}, shell_report).value();
    EXPECT_LT(shell.store.voxel_count(), voxels);
    // The inside of a shell is air where the solid is filled.
    uint64_t inside = 0;
    for (const LeafPos l : shell.store.mixed_leaves())
      for (int i = 0; i < kLeafVoxels; ++i) inside += shell.store.leaf(l)[i] == kAir && world->store.leaf(l)[i] != kAir;
    EXPECT_GT(inside, 1000u);
  }
}

TEST(Formats, SurfacesAtScalesThatCannotBeAreErrors) {
  TemporaryFolder folder;
  std::ofstream(folder / "far.obj") << "v 0 0 0\nv 1e12 0 0\nv 0 1e12 0\nf 1 2 3\n";
  ImportReport report;
  const auto world = read_world(folder / "far.obj", {.metres_per_voxel = 1e-3}, report);
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().message.find("--metres-per-voxel"), std::string::npos);
}

}  // namespace
}  // namespace world
