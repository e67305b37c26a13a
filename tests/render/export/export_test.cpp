/// Surfaces for other programs: they are closed, and what is read back is what was there.
#include "render/export/export.h"

#include <cstring>
#include <map>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support.h"
#include "world/base/file.h"
#include "world/formats/format.h"
#include "world/meshes/mesh.h"

namespace render {
namespace {

using world::VoxelPos;
using world::World;

/// Blocks that touch, cross chunks, and stand alone; a hollow with a way in.
World sample_world() {
  World world(world::standard_blocks());
  const auto id = [&](const char* name) { return *world.palette->find(name); };
  world::EditBatch batch;
  batch.fill({{-9, 0, -3}, {70, 5, 20}}, id("stone"));
  batch.fill({{-4, 1, 0}, {60, 3, 10}}, world::kAir);
  batch.fill({{10, 2, 5}, {12, 9, 5}}, world::kAir);
  batch.fill({{3, 6, 3}, {9, 14, 9}}, id("grass"));
  batch.set({30, 40, -70}, id("snow"));
  EXPECT_TRUE(world.store.apply(batch));
  world.metadata["voxel_size_m"] = "0.5";
  return world;
}

TEST(Export, QuadsFaceOutwardsAndCloseTheSurface) {
  const World world = sample_world();
  const SurfaceMesh surface = surface_of(world, /*merged=*/false);
  // Each unit face once from each side's block: the signed volume is that of the voxels.
  double volume = 0;
  for (const BlockSurface& block : surface.blocks) {
    for (size_t q = 0; q < block.quads.size(); ++q) {
      const auto at = [&](int corner) {
        const VoxelPos p = surface.vertices[block.quads[q][static_cast<size_t>(corner)]];
        return world::Vec3d(p.x, p.y, p.z);
      };
      const world::Vec3d normal = glm::cross(at(1) - at(0), at(2) - at(0));
      EXPECT_EQ(normal[world::face_axis(block.faces[q])], world::face_sign(block.faces[q]));
      volume += glm::dot(at(0), normal) / 3;
    }
  }
  EXPECT_NEAR(volume, static_cast<double>(world.store.voxel_count()), 1e-6);
}

TEST(Export, ObjAndPlyReadBackAsTheSameVoxels) {
  const world::TemporaryFolder folder;
  const World world = sample_world();
  for (const char* file : {"a.obj", "a.ply"}) {
    SCOPED_TRACE(file);
    const SurfaceFormat* format = surface_format_for(file);
    ASSERT_TRUE(format);
    const world::Status written = write_surface(world, *format, folder / file);
    ASSERT_TRUE(written) << written.error().message;
    world::ImportReport report;
    const auto back = world::read_world(folder / file, {.metres_per_voxel = 0.5}, report);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->store.voxel_count(), world.store.voxel_count());
    EXPECT_EQ(back->store.bounds(), world.store.bounds());
    for (const world::LeafPos l : world.store.mixed_leaves())
      for (int i = 0; i < world::kLeafVoxels; ++i)
        ASSERT_EQ(back->store.leaf(l)[i] != world::kAir, world.store.leaf(l)[i] != world::kAir);
  }
}

TEST(Export, AGlbIsWhatItsSpecificationAsksFor) {
  const World world = sample_world();
  const SurfaceMesh surface = surface_of(world);
  const std::string bytes = surface_format_for("x.GLB")->encode(surface).value();
  const auto word = [&](size_t at) {
    uint32_t value;
    std::memcpy(&value, &bytes[at], 4);
    return value;
  };
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(4), 2u);
  EXPECT_EQ(word(8), bytes.size());
  const uint32_t json_bytes = word(12);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  EXPECT_EQ(json_bytes % 4, 0u);
  const auto gltf = nlohmann::json::parse(bytes.substr(20, json_bytes));
  const size_t binary = 20 + json_bytes;
  EXPECT_EQ(bytes.substr(binary + 4, 4), std::string("BIN\0", 4));
  EXPECT_EQ(word(binary), gltf["buffers"][0]["byteLength"]);
  EXPECT_EQ(binary + 8 + word(binary), bytes.size());
  EXPECT_EQ(gltf["materials"].size(), 3u);
  size_t triangles = 0;
  for (const auto& primitive : gltf["meshes"][0]["primitives"]) {
    const auto& positions = gltf["accessors"][primitive["attributes"]["POSITION"].get<size_t>()];
    const auto& indices = gltf["accessors"][primitive["indices"].get<size_t>()];
    triangles += indices["count"].get<size_t>() / 3;
    const auto& view = gltf["bufferViews"][indices["bufferView"].get<size_t>()];
    const size_t from = binary + 8 + view["byteOffset"].get<size_t>();
    EXPECT_EQ(view["byteOffset"].get<size_t>() % 4, 0u);
    for (size_t i = 0; i < indices["count"]; ++i) ASSERT_LT(word(from + 4 * i), positions["count"]);
  }
  size_t quads = 0;
  for (const BlockSurface& block : surface.blocks) quads += block.quads.size();
  EXPECT_EQ(triangles, 2 * quads);
}

/// A ball as a level set of two blocks, the upper half of one, at half a metre a voxel.
World smooth_world() {
  World world(world::standard_blocks());
  world::EditBatch batch;
  world::FloatLayer& distance = world.store.make_layer(world::Layer::distance);
  for (int x = -16; x < 16; ++x)
    for (int y = -16; y < 16; ++y)
      for (int z = -16; z < 16; ++z) {
        const auto d = static_cast<float>(glm::length(world::Vec3d(x + 0.4, y + 0.3, z + 0.2)) - 10);
        if (std::abs(d) < 3) distance.set({x, y, z}, d);
        if (d <= 0) batch.set({x, y, z}, *world.palette->find(y < 0 ? "stone" : "snow"));
      }
  EXPECT_TRUE(world.store.apply(batch));
  world.metadata["voxel_size_m"] = "0.5";
  return world;
}

TEST(Export, SmoothSurfacesReadBackAsTheSameMeshWithNormalsAndColours) {
  const world::TemporaryFolder folder;
  const World world = smooth_world();
  for (const char* file : {"a.obj", "a.ply"})
    for (const SurfaceMethod method :
         {SurfaceMethod::blocks, SurfaceMethod::surface_nets, SurfaceMethod::marching_cubes,
          SurfaceMethod::marching_tetrahedra, SurfaceMethod::openvdb}) {
      SCOPED_TRACE(std::string(file) + " " + std::string(surface_method_names()[static_cast<size_t>(method)]));
      const SmoothSurface surface = smooth_surface_of(world, {.method = method}).value();
      EXPECT_EQ(surface.normals.empty(), method == SurfaceMethod::blocks);
      ASSERT_TRUE(write_smooth_surface(world, {.method = method}, *surface_format_for(file), folder / file));
      world::MeshReport report;
      const auto back = world::read_mesh_file(folder / file, report);
      ASSERT_TRUE(back.ok()) << back.error().message;
      EXPECT_EQ(back->triangles.size() + report.degenerate, surface.mesh.triangles.size());
      EXPECT_EQ(back->normals.empty(), surface.normals.empty());
      for (size_t v = 0; v < back->positions.size(); ++v) {
        const world::Vec3d out = world::Vec3d(back->positions[v]) / 0.5 + world::Vec3d(-0.1, -0.2, -0.3);
        ASSERT_NEAR(glm::length(out), 10, method == SurfaceMethod::blocks ? 0.87 : 0.05);
        if (back->normals.empty()) continue;
        ASSERT_GT(glm::dot(world::Vec3d(back->normals[v]), out / glm::length(out)), 0.98);
      }
    }
}

TEST(Export, ASmoothGlbHoldsSharedVerticesAndAPrimitiveABlock) {
  const World world = smooth_world();
  const SmoothSurface surface = smooth_surface_of(world, {}).value();
  const std::string bytes = surface_format_for("x.glb")->encode_smooth(surface).value();
  uint32_t json_bytes;
  std::memcpy(&json_bytes, &bytes[12], 4);
  const auto gltf = nlohmann::json::parse(bytes.substr(20, json_bytes));
  ASSERT_EQ(gltf["meshes"][0]["primitives"].size(), 2u);
  size_t triangles = 0;
  for (const auto& primitive : gltf["meshes"][0]["primitives"]) {
    const auto& positions = gltf["accessors"][primitive["attributes"]["POSITION"].get<size_t>()];
    EXPECT_EQ(positions["count"], surface.mesh.vertices.size());
    EXPECT_EQ(gltf["accessors"][primitive["attributes"]["NORMAL"].get<size_t>()]["count"], positions["count"]);
    EXPECT_NEAR(positions["max"][0].get<double>(), 5.05, 0.05);
    const auto& indices = gltf["accessors"][primitive["indices"].get<size_t>()];
    triangles += indices["count"].get<size_t>() / 3;
    const size_t from = gltf["bufferViews"][indices["bufferView"].get<size_t>()]["byteOffset"];
    for (size_t i = 0; i < indices["count"]; ++i) {
      uint32_t vertex;
      std::memcpy(&vertex, &bytes[20 + json_bytes + 8 + from + 4 * i], 4);
      ASSERT_LT(vertex, surface.mesh.vertices.size());
    }
  }
  EXPECT_EQ(triangles, surface.mesh.triangles.size());
}

TEST(Export, AWorldWithoutAFieldOrBelowTheLevelIsOneClearError) {
  const auto none = smooth_surface_of(sample_world(), {});
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("no level set and no density"), std::string::npos);
  World thin(world::standard_blocks());
  thin.store.make_layer(world::Layer::density).set({1, 2, 3}, 0.25f);
  const auto below = smooth_surface_of(thin, {});
  ASSERT_FALSE(below.ok());
  EXPECT_NE(below.error().message.find("nowhere above 0.5; its largest value is 0.25"), std::string::npos)
      << below.error().message;
}

TEST(Export, AnEmptyWorldIsAnError) {
  const world::TemporaryFolder folder;
  EXPECT_FALSE(write_surface(World(), surface_formats()[0], folder / "a.obj"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.obj"));
}

}  // namespace
}  // namespace render
