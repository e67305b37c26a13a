/// What comes back equal from a file of each kind that is written: a table, of which every entry must be so, also where
/// it says no.
#include <gtest/gtest.h>

#include "render/export/export.h"
#include "tests/support.h"
#include "world/formats/format.h"
#include "world/units/rgb8.h"

namespace render {
namespace {

using world::BlockId;
using world::kAir;
using world::Layer;
using world::VoxelPos;
using world::World;

/// What of a world is the same in another.
struct Same {
  bool filled;        // which voxels are air
  bool place;         // where the world lies
  bool blocks;        // names and all properties
  bool colours;       // of voxels that can be seen, as displays show them
  bool voxel_size;    // metres
  bool heights;       // of the highest block in each column
  bool layers;        // values of layers
  bool surroundings;  // sun, cameras, luminaires
  friend bool operator==(const Same&, const Same&) = default;
};
std::ostream& operator<<(std::ostream& out, const Same& s) {
  return out << "filled " << s.filled << ", place " << s.place << ", blocks " << s.blocks << ", colours " << s.colours
             << ", voxel size " << s.voxel_size << ", heights " << s.heights << ", layers " << s.layers
             << ", surroundings " << s.surroundings;
}

/// Land with things on it, all of cubes that let no light pass, so that formats of surfaces can hold it; not at the
/// origin, and different in every direction.
World sample_world() {
  World world(world::standard_blocks());
  const auto id = [&](const char* name) { return *world.palette->find(name); };
  world::Block own;
  own.name = "own:block", own.albedo = {0.1f, 0.6f, 0.05f}, own.hardness = 3.25f;
  const BlockId ours = *world.palette->add(own);
  world::EditBatch batch;
  batch.fill({{-20, -5, 7}, {40, 2, 60}}, id("stone"));
  batch.fill({{-20, 3, 7}, {40, 3, 60}}, id("grass"));
  batch.fill({{-10, 4, 20}, {-4, 12, 24}}, id("brick_red"));
  batch.fill({{30, 4, 50}, {33, 6, 55}}, ours);
  batch.set({5, 4, 9}, id("snow"));
  EXPECT_TRUE(world.store.apply(batch));
  world.metadata["voxel_size_m"] = "0.5";
  world.store.make_layer(Layer::density).set({1, 20, 30}, 0.75f);
  world::CameraPlacement camera;
  camera.name = "hill";
  world.cameras.push_back(camera);
  world::Luminaire lamp;
  lamp.kind = "omni", lamp.radius = 0.01f, lamp.power = {1, 2, 3};
  world.luminaires.push_back(lamp);
  world.environment.sky_zenith = {1, 2, 3};
  return world;
}

int highest(const World& world, int x, int z) {
  const world::VoxelBox box = world.store.bounds();
  for (int y = box.max.y; y >= box.min.y; --y)
    if (world.store.get({x, y, z}) != kAir) return y;
  return box.min.y - 1;
}

Same compare(const World& a, const World& b) {
  const world::VoxelBox of_a = a.store.bounds(), of_b = b.store.bounds();
  const VoxelPos shift = of_b.min - of_a.min;
  Same same{true, of_a.min == of_b.min && of_a.max == of_b.max, true, true, false, true, false, false};
  const auto colour = [](const World& w, BlockId id) {
    const auto c = display_colour((*w.palette)[id]);
    return uint32_t{c[0]} << 16 | uint32_t{c[1]} << 8 | c[2];
  };
  for (int x = of_a.min.x; x <= of_a.max.x; ++x)
    for (int z = of_a.min.z; z <= of_a.max.z; ++z) {
      for (int y = of_a.min.y; y <= of_a.max.y; ++y) {
        const VoxelPos v{x, y, z};
        const BlockId p = a.store.get(v), q = b.store.get(v + shift);
        same.filled &= (p == kAir) == (q == kAir);
        if (p == kAir || q == kAir) continue;
        same.blocks &= world::toml_from_block((*a.palette)[p]) == world::toml_from_block((*b.palette)[q]);
        bool seen = false;
        for (int face = 0; face < 6; ++face) {
          VoxelPos next = v;
          next[face >> 1] += face & 1 ? 1 : -1;
          seen |= a.store.get(next) == kAir;
        }
        if (seen) same.colours &= colour(a, p) == colour(b, q);
      }
      // Below the highest of all, wherever the floor is.
      same.heights &= of_a.max.y - highest(a, x, z) == of_b.max.y - highest(b, x + shift.x, z + shift.z);
    }
  same.filled &= a.store.voxel_count() == b.store.voxel_count();
  same.heights &= of_a.max.x - of_a.min.x == of_b.max.x - of_b.min.x;
  const auto size = b.metadata.find("voxel_size_m");
  same.voxel_size = size != b.metadata.end() && std::stod(size->second) == std::stod(a.metadata.at("voxel_size_m"));
  const auto* density = b.store.find_layer(Layer::density);
  same.layers = density && density->get(VoxelPos{1, 20, 30}) == 0.75f && density->active_voxels() == 1;
  same.surroundings = a.environment == b.environment && b.cameras.size() == 1 && b.cameras[0].name == "hill" &&
                      b.luminaires.size() == 1 && b.luminaires[0].power == a.luminaires[0].power;
  return same;
}

struct Row {
  const char* extension;
  Same comes_back;
};
constexpr bool yes = true, no = false;
constexpr Row kRows[] = {
    // filled, place, blocks, colours, size, heights, layers, surroundings
    {".loam", {yes, yes, yes, yes, yes, yes, yes, yes}},
    {".vdb", {yes, yes, yes, yes, yes, yes, yes, no}},
    {".nvdb", {yes, yes, yes, yes, yes, yes, yes, no}},
    {".schem", {yes, yes, yes, yes, no, yes, no, no}},
    {".vox", {yes, yes, yes, yes, no, yes, no, no}},
    {".obj", {yes, yes, no, yes, yes, yes, no, no}},
    {".ply", {yes, yes, no, yes, yes, yes, no, no}},
    // Of each column the height alone: ground of any depth stands below it, at the origin.
    {".png", {no, no, no, no, yes, yes, no, no}},
};

TEST(RoundTrips, GiveBackExactlyWhatTheTableSays) {
  const world::TemporaryFolder folder;
  const World world = sample_world();
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.extension);
    const auto path = folder / ("a" + std::string(row.extension));
    const SurfaceFormat* surface = surface_format_for(path);
    const world::Status written = surface ? write_surface(world, *surface, path) : world::write_world(world, path);
    ASSERT_TRUE(written.ok()) << written.error().message;
    world::ImportReport report;
    const auto read = world::read_world(path, {.metres_per_voxel = 0.5}, report);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(compare(world, *read), row.comes_back);
    EXPECT_TRUE(report.unmapped.empty());
  }
}

TEST(RoundTrips, EveryFormatThatIsWrittenAndReadIsInTheTable) {
  std::set<std::string> in_table, written;
  for (const Row& row : kRows) in_table.insert(row.extension);
  for (const world::Format& format : world::formats())
    if (format.write && format.read) written.insert(format.extensions.front());
  for (const SurfaceFormat& format : surface_formats())
    if (world::format_for_reading("a" + format.extension)) written.insert(format.extension);
  EXPECT_EQ(in_table, written);
}

TEST(RoundTrips, WhatIsLostIsSaid) {
  const World world = sample_world();
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.extension);
    const SurfaceFormat* surface = surface_format_for("a" + std::string(row.extension));
    std::string all;
    if (surface) {
      for (const std::string& sentence : surface_losses(world, *surface)) all += sentence + "\n";
    } else {
      const auto format = world::format_for_writing("a" + std::string(row.extension));
      ASSERT_TRUE(format.ok());
      if ((*format)->losses)
        for (const std::string& sentence : (*format)->losses(world)) all += sentence + "\n";
    }
    EXPECT_EQ(all.find("luminaire") == all.npos, row.comes_back.surroundings) << all;
    EXPECT_EQ(all.find("camera") == all.npos, row.comes_back.surroundings) << all;
    EXPECT_EQ(all.find("sun and sky") == all.npos, row.comes_back.surroundings) << all;
    EXPECT_EQ(all.find("layer") == all.npos, row.comes_back.layers) << all;
  }
}

}  // namespace
}  // namespace render
