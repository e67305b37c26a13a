/// Surfaces for other programs: they are closed, and what is read back is what was there.
#include "render/export/export.h"

#include <cstring>
#include <map>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support.h"
#include "world/base/file.h"
#include "world/formats/format.h"

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

TEST(Export, AnEmptyWorldIsAnError) {
  const world::TemporaryFolder folder;
  EXPECT_FALSE(write_surface(World(), surface_formats()[0], folder / "a.obj"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.obj"));
}

}  // namespace
}  // namespace render
