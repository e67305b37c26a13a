/// Sources: how fast geometry becomes voxels, beside asking about each voxel of its box.
#include <cmath>

#include "tools/bench/benchmark.h"
#include "world/sources/source.h"

namespace tools {

namespace {

using world::VoxelPos;

std::shared_ptr<const world::SourceInstance> source_from(const std::string& keys) {
  auto document = world::TomlDocument::parse("[[source]]\nblock='stone'\n" + keys, "suite");
  auto source = std::make_shared<world::SourceInstance>();
  auto root = document->root();
  for (world::TomlTable table : root.array_of_tables("source")) *source = world::read_source(table, {}, {});
  return source;
}

uint64_t by_octree(const world::SourceInstance& source) {
  world::Store store(world::standard_blocks());
  const auto sampled = sample_shape(store, *source.shape, source.placement, source.sampling, 1);
  return sampled ? sampled->voxels : 0;
}

/// Every voxel of the box asked alone, leaf by leaf.
uint64_t by_voxels(const world::SourceInstance& source, int reach) {
  uint64_t voxels = 0;
  world::Store store(world::standard_blocks());
  for (int x = -reach; x < reach; x += world::kRegionSize)
    for (int y = -reach; y < reach; y += world::kRegionSize)
      for (int z = -reach; z < reach; z += world::kRegionSize) {
        world::RegionBuilder region(world::region_from_voxel({x, y, z}));
        for (int l = 0; l < world::kLeavesPerRegion; ++l) {
          const VoxelPos low = VoxelPos{x, y, z} + voxel_from_leaf(world::leaf_offset_in_region(l));
          world::BlockId blocks[world::kLeafVoxels];
          for (int i = 0; i < world::kLeafVoxels; ++i) {
            const VoxelPos v = low + world::offset_in_leaf(i);
            const bool inside =
                source.shape->contains(world::WorldPoint{v, world::Vec3d(0.5)} - source.placement.position);
            blocks[i] = inside ? 1 : world::kAir;
            voxels += inside;
          }
          region.set_leaf(l, blocks);
        }
        store.adopt(std::move(region));
      }
  return voxels;
}

Bench row(const std::string& name, const std::string& what, const std::string& keys) {
  return {.name = name,
          .what = what + " in a box of 256^3, beside asking about each voxel of the box",
          .unit = "M voxels/s",
          .scale = 1e6,
          .threads = 1,
          .prepare = [keys](BenchContext&) -> Result<Prepared> {
            const auto source = source_from(keys);
            if (!source->shape) return world::input_error("the source of the row is wrong");
            const auto box = static_cast<double>(256 * 256 * 256);
            return Prepared{.ours = {"octree", [=] { return by_octree(*source) ? box : std::nan(""); }},
                            .rivals = {{"each voxel", [=] { return by_voxels(*source, 128) ? box : std::nan(""); }}},
                            .check = [=]() -> Status {
                              if (by_octree(*source) == by_voxels(*source, 128)) return {};
                              return world::input_error("the octree and each voxel alone differ");
                            }};
          }};
}

}  // namespace

void add_suite_sources(Registry& registry) {
  registry.add(row("torus", "an implicit torus", "kind='implicit'\nsurface='torus'\nradius=80\ntube_radius=30.3"));
  registry.add(
      row("metaballs", "three metaballs",
          "kind='metaballs'\n[[source.ball]]\nposition=[-40,0,3]\nradius=50\n[[source.ball]]\nposition=[40,9,0]\n"
          "radius=45\n[[source.ball]]\nposition=[0,40,20]\nradius=40"));
  registry.add(row("waves", "a heightfield of two cosines",
                   "kind='heightfield'\nsize=[128,128]\nbase_m=-100\n[[source.wave]]\namplitude_m=30\nwavelength_m=90\n"
                   "[[source.wave]]\namplitude_m=12\nwavelength_m=37\ndirection_deg=70"));
}

}  // namespace tools
