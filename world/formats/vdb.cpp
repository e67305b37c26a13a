// OpenVDB .vdb -> world, and back.
//
// Reading takes one grid: a Loam block grid if there is one, else "density", "surface", else the first; the others are
// named in the report. Axes and indices stay as they are: index (i, j, k) is the voxel (i, j, k). The size of a voxel
// goes to the metadata; where the map rotates, shears or moves, a warning says that it was left out.
//   Loam block grid            the blocks, exactly
//   level set                  one block where the distance is <= 0: band and inside
//   everything else            one block where a voxel is active: fog volumes, points, vectors, masks, integers
// That block, "vdb:NAME", is opaque and white, so that it is seen; the numbers of a float grid become the layer
// `density`, the distances of a float level set's band, in voxels, the layer `distance`.
//
// Writing makes one Int32 grid "block_id" of block ids, 0 is air and inactive; its metadata hold each block of the
// palette as TOML (loam_block_ID) and what the world knows of itself (loam_about_KEY); surroundings (sun, sky) are not
// in it. The same world gives the same bytes: the UUID is made from the content.
//
// OpenVDB's reader believes sizes and ignores read errors (hard case IO10): everything goes through try_in_child first,
// and what was read is checked: finite numbers, leaves where the tree says they are, voxels within the world's border.
// What no reader can find is a changed but finite number, since the format has no checksums.
#include "world/formats/vdb.h"

#include <map>

#include <fmt/format.h>

#include "world/formats/vdb/grids.h"

namespace world {
namespace {

using namespace vdb;

constexpr size_t kMaxRegions = size_t{1} << 15;  // a region costs 34 kB before it holds anything

/// Regions under construction; fails where a few tiles of a small file stand for more than fits.
struct Regions {
  std::map<RegionPos, RegionBuilder> built;

  Result<RegionBuilder*> at(RegionPos r) {
    auto found = built.find(r);
    if (found == built.end()) {
      if (built.size() >= kMaxRegions)
        return input_error(
            fmt::format("its voxels spread over more than {} regions of 128^3; that does not fit", kMaxRegions));
      found = built.emplace(r, RegionBuilder(r)).first;
    }
    return &found->second;
  }
  Status fill(const openvdb::CoordBBox& box, BlockId block) {
    const LeafPos from = leaf_from_voxel(voxel(box.min())), to = leaf_from_voxel(voxel(box.max()));
    const RegionPos first = region_from_leaf(from), last = region_from_leaf(to);
    for (int x = first.x; x <= last.x; ++x) {
      for (int y = first.y; y <= last.y; ++y) {
        for (int z = first.z; z <= last.z; ++z) {
          TRY(RegionBuilder* const region, at({x, y, z}));
          for (int leaf = 0; leaf < kLeavesPerRegion; ++leaf) {
            const LeafPos l = leaf_from_region({x, y, z}) + leaf_offset_in_region(leaf);
            const bool in =
                l.x >= from.x && l.x <= to.x && l.y >= from.y && l.y <= to.y && l.z >= from.z && l.z <= to.z;
            if (in) region->set_uniform(leaf, block);
          }
        }
      }
    }
    return {};
  }
};

/// block_of(value, active) says what a voxel, or a whole tile, becomes.
template <class Tree, class BlockOf>
Status gather(const Tree& tree, Regions& regions, BlockOf block_of) {
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(tile.LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    const BlockId block = block_of(*tile, tile.isValueOn());
    if (block == kAir) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    if (!inside_world(box.min()) || !inside_world(box.max()))
      return input_error("a tile lies outside of the world's border");
    TRY_STATUS(regions.fill(box, block));
  }
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    BlockId values[kLeafVoxels];
    for (openvdb::Index n = 0; n < kLeafVoxels; ++n) values[n] = block_of(leaf->getValue(n), leaf->isValueOn(n));
    const LeafPos l = leaf_from_voxel(voxel(leaf->origin()));
    TRY(RegionBuilder* const region, regions.at(region_from_leaf(l)));
    region->set_leaf(index_in_region(l), values);
  }
  return {};
}

bool is_block_grid(const openvdb::GridBase& grid) {
  return grid.isType<openvdb::Int32Grid>() && grid.getName() == kBlockGrid && grid[kBlockKey + "0"];
}

/// The text of a metadata entry, or nothing where there is none or it is no text.
std::optional<std::string> text_of(const openvdb::GridBase& grid, const std::string& key) {
  const auto entry = grid.getMetadata<openvdb::StringMetadata>(key);
  return entry ? std::optional(entry->value()) : std::nullopt;
}

/// Restores palette, metadata and blocks of a grid that write() made.
Status read_blocks(const openvdb::Int32Grid& grid, const std::string& name, World& world, Regions& regions) {
  for (size_t id = 1;; ++id) {
    const auto block = text_of(grid, kBlockKey + std::to_string(id));
    if (!block) break;
    TRY_STATUS(add_blocks_from_toml(*world.palette, *block, fmt::format("{}: block {}", name, id)));
    if (world.palette->size() != id + 1)
      return input_error(fmt::format("{}: the metadata entry {}{} does not describe one block", name, kBlockKey, id));
  }
  for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry) {
    if (!entry->first.starts_with(kAboutKey)) continue;
    if (const auto value = text_of(grid, entry->first)) world.metadata[entry->first.substr(kAboutKey.size())] = *value;
  }
  const int64_t blocks = static_cast<int64_t>(world.palette->size());
  std::optional<int32_t> unknown;
  TRY_STATUS(gather(grid.constTree(), regions, [&](int32_t id, bool) -> BlockId {
    if (id >= 0 && id < blocks) return static_cast<BlockId>(id);
    unknown = id;
    return kAir;
  }));
  if (unknown)
    return input_error(fmt::format("{}: the block id {} is not in the palette of the file, which has {} blocks", name,
                                   *unknown, blocks));
  return {};
}

/// The active values, in voxels. What is not active lies beyond the band: its block says on which side.
void keep_distances(const openvdb::FloatTree& tree, double voxel_size, FloatLayer& layer) {
  const auto kept = std::make_shared<openvdb::FloatTree>(tree, 0.0f, openvdb::TopologyCopy());
  openvdb::FloatGrid::ConstUnsafeAccessor distances(tree);
  for (auto value = kept->beginValueOn(); value; ++value)
    value.setValue(static_cast<float>(distances.getValue(value.getCoord()) / voxel_size));
  layer.grid().grid->setTree(kept);
}

Status read_shape(const openvdb::GridBase& grid, const VdbGridFacts& facts, World& world, Regions& regions) {
  Block block;
  block.name = "vdb:" + facts.name;
  block.albedo = {0.8f, 0.8f, 0.8f};
  TRY(const BlockId id, world.palette->add(block));
  Status status;
  with_tree(grid, [&](const auto& tree) {
    using Value = typename std::decay_t<decltype(tree)>::ValueType;
    if constexpr (std::is_floating_point_v<Value>) {
      if (grid.getGridClass() == openvdb::GRID_LEVEL_SET) {
        status = gather(tree, regions, [&](Value distance, bool) { return distance <= 0 ? id : kAir; });
        return;
      }
    }
    status = gather(tree, regions, [&](const Value&, bool active) { return active ? id : kAir; });
  });
  if (grid.isType<openvdb::FloatGrid>() && grid.getGridClass() == openvdb::GRID_LEVEL_SET && status.ok())
    keep_distances(static_cast<const openvdb::FloatGrid&>(grid).constTree(), facts.voxel_size.x,
                   world.store.make_layer(Layer::distance));
  const bool fog = grid.isType<openvdb::FloatGrid>() && grid.getGridClass() != openvdb::GRID_LEVEL_SET;
  if (fog && status.ok()) {
    const auto& numbers = static_cast<const openvdb::FloatGrid&>(grid);
    if (numbers.background() == 0)
      world.store.make_layer(Layer::density).grid().grid->setTree(numbers.constTree().copy());
  }
  return status;
}

/// The grid that becomes the world.
size_t choose_grid(const Loaded& loaded) {
  const auto& grids = loaded.grids;
  for (size_t i = 0; i < grids.size(); ++i) {
    if (is_block_grid(*grids[i])) return i;
  }
  for (const char* wanted : {"density", "surface"}) {
    for (size_t i = 0; i < grids.size(); ++i) {
      if (grids[i]->getName() == wanted) return i;
    }
  }
  return 0;
}

void add_facts(const VdbFacts& facts, const VdbGridFacts& grid, ImportReport& report) {
  const auto fact = [&](const char* name, const std::string& value) { report.facts.emplace_back(name, value); };
  fact("file version", std::to_string(facts.file_version));
  fact("library", fmt::format("{}.{}", facts.library_major, facts.library_minor));
  fact("grids", std::to_string(facts.grids.size()));
  fact("grid", grid.name);
  fact("type", grid.type + (grid.half ? ", half floats" : ""));
  fact("class", grid.grid_class);
  fact("active voxels", std::to_string(grid.active_voxels));
  fact("leaf nodes", std::to_string(grid.leaf_nodes));
  fact("active tiles", std::to_string(grid.active_tiles));
  fact("voxel size", fmt::format("{:g} {:g} {:g}", grid.voxel_size.x, grid.voxel_size.y, grid.voxel_size.z));
  if (grid.points) fact("points", std::to_string(grid.points));
  if (grid.values && grid.active_voxels) {
    fact("min", fmt::format("{:g}", grid.values->min));
    fact("max", fmt::format("{:g}", grid.values->max));
    fact("mean", fmt::format("{:g}", grid.values->sum / static_cast<double>(grid.active_voxels)));
  }
}

}  // namespace

Result<World> world_from_vdb(std::span<const uint8_t> bytes, const std::string& name, ImportReport& report) {
  TRY(const Loaded loaded, load(bytes, name));
  for (const std::string& grid : loaded.unknown)
    report.warnings.push_back(fmt::format("the grid {} is of a type that is not read", grid));
  if (loaded.grids.empty())
    return input_error(fmt::format("{}: holds no grid of a type that is read, only {}", name, loaded.unknown.front()));
  const size_t chosen = choose_grid(loaded);
  const openvdb::GridBase& grid = *loaded.grids[chosen];
  const VdbGridFacts& facts = loaded.facts.grids[chosen];
  for (size_t i = 0; i < loaded.grids.size(); ++i) {
    if (i != chosen) {
      report.warnings.push_back(
          fmt::format("the grid '{}' was left out; '{}' was read", loaded.facts.grids[i].name, facts.name));
    }
  }
  add_facts(loaded.facts, facts, report);
  World world;
  Regions regions;
  const bool blocks = is_block_grid(grid);
  try {
    const Status status = blocks ? read_blocks(static_cast<const openvdb::Int32Grid&>(grid), name, world, regions)
                                 : read_shape(grid, facts, world, regions);
    if (!status) {
      const std::string& message = status.error().message;
      return message.starts_with(name) ? status.error()
                                       : input_error(fmt::format("{}: grid '{}': {}", name, facts.name, message));
    }
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: grid '{}': {}", name, facts.name, e.what()));
  }
  if (!blocks) {
    world.metadata["format"] = "vdb";
    world.metadata["voxel_size_m"] = fmt::format("{:.9g}", facts.voxel_size.x);
    world.metadata["vdb.grid"] = facts.name;
    const bool moves = facts.origin != Vec3d(0.0);
    if (moves || facts.map.find("UniformScale") != 0) {
      report.warnings.push_back(
          fmt::format("the grid's map to its world ({}) was left out but for the size of a voxel", facts.map));
    }
  }
  for (auto& [r, region] : regions.built) world.store.adopt(std::move(region));
  return world;
}

const Format& vdb_format() {
  static const Format format = {
      .name = "vdb",
      .extensions = {".vdb"},
      .what = "OpenVDB grids; writes block ids with their palette",
      .recognizes =
          [](const std::vector<uint8_t>& head) {
            return head.size() >= 8 && head[0] == ' ' && head[1] == 'B' && head[2] == 'D' && head[3] == 'V' &&
                   head[4] == 0;
          },
      .read = [](const std::filesystem::path& path, const ImportOptions&, ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, kMaxFileBytes));
        TRY(World world, world_from_vdb(bytes, path.string(), report));
        if (world.metadata.contains("vdb.grid")) world.metadata.emplace("source", path.filename().string());
        return world;
      },
      .write = write_vdb,
  };
  return format;
}

}  // namespace world
