// OpenVDB .vdb -> world, and back.
//
// Reading starts from one grid: --grid's, else a Loam block grid if there is one, else "density", "surface", or the
// first. Its indices are the world's voxels: index (i, j, k) is the voxel (i, j, k), and the size of a voxel and the
// world place of index 0 go to the metadata, so that writing restores them. Where its map to its world rotates, shears
// or has voxels that are no cubes, its values are first resampled (trilinear) at cubes of its least voxel size along
// the axes of that world; only float grids can be.
//   Loam block grid            the blocks, exactly, and the grids that hold further layers
//   level set                  one block where the distance is <= 0: band and inside
//   everything else            one block where a voxel is active: fog volumes, points, vectors, masks, integers
// That block, "vdb:NAME", is opaque and white, so that it is seen; the numbers of a float grid become the layer
// `density`, the distances of a float level set's band, in voxels, the layer `distance`.
// The level sets and point grids beside it are put where their maps say, each as a block of its own where there is air
// (resampled where they lie between the voxels of the first); the rest is named in the report.
//
// Writing makes an Int32 grid "block_id" of block ids, 0 is air and inactive, and a Float or Int32 grid of each further
// layer's name; the metadata of the first hold each block of the palette as TOML (loam_block_ID) and what the world
// knows of itself (loam_about_KEY); surroundings (sun, sky) are not in it. The same world gives the same bytes: the
// UUID is made from the content.
//
// OpenVDB's reader believes sizes and ignores read errors (hard case IO10): everything goes through try_in_child first,
// and what was read is checked: finite numbers, leaves where the tree says they are, voxels within the world's border.
// What no reader can find is a changed but finite number, since the format has no checksums.
#include "world/formats/vdb.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "world/formats/vdb/grids.h"

namespace world {
namespace {

using namespace vdb;

/// What an import may take: 16 bytes for each byte of the file and 256 MiB. A region costs 34 kB before it holds
/// anything; half of the sum is left to what is in them, and to OpenVDB's trees.
constexpr size_t most_regions(uint64_t file_bytes) {
  return static_cast<size_t>(((uint64_t{256} << 20) + 16 * file_bytes) / (2 * 34000));
}

/// Regions under construction; fails where a few tiles of a small file stand for more than fits.
struct Regions {
  size_t most = 0;
  std::map<RegionPos, RegionBuilder> built;

  Result<RegionBuilder*> at(RegionPos r) {
    auto found = built.find(r);
    if (found == built.end()) {
      if (built.size() >= most) return too_many();
      found = built.emplace(r, RegionBuilder(r)).first;
    }
    return &found->second;
  }
  Error too_many() const {
    return input_error(fmt::format(
        "its voxels spread over more than {} regions of 128^3; a file of its size may not take that much memory",
        most));
  }
  /// Writes one voxel of air; others keep what they have.
  Status set_if_air(VoxelPos v, BlockId block) {
    TRY(RegionBuilder* const region, at(region_from_voxel(v)));
    const int leaf = index_in_region(leaf_from_voxel(v));
    const LeafBlocks old = region->leaf(leaf);
    if (old[index_in_leaf(v)] != kAir) return {};
    BlockId values[kLeafVoxels];
    for (int i = 0; i < kLeafVoxels; ++i) values[i] = old[i];
    values[index_in_leaf(v)] = block;
    region->set_leaf(leaf, values);
    return {};
  }
  Status fill(const openvdb::CoordBBox& box, BlockId block) {
    const LeafPos from = leaf_from_voxel(voxel(box.min())), to = leaf_from_voxel(voxel(box.max()));
    const RegionPos first = region_from_leaf(from), last = region_from_leaf(to);
    if (VoxelBox{{first.x, first.y, first.z}, {last.x, last.y, last.z}}.volume() > most) return too_many();
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
Result<size_t> choose_grid(const Loaded& loaded, const std::string& wanted, const std::string& name) {
  const auto& grids = loaded.grids;
  const auto named = [&](std::string_view grid) {
    return static_cast<size_t>(
        std::find_if(grids.begin(), grids.end(), [&](const auto& g) { return g->getName() == grid; }) - grids.begin());
  };
  if (!wanted.empty()) {
    if (const size_t i = named(wanted); i < grids.size()) return i;
    std::vector<std::string> names;
    for (const VdbGridFacts& facts : loaded.facts.grids) names.push_back(facts.name);
    return input_error(
        fmt::format("{}: holds no grid '{}' that is read; its grids are {}", name, wanted, fmt::join(names, ", ")));
  }
  for (size_t i = 0; i < grids.size(); ++i) {
    if (is_block_grid(*grids[i])) return i;
  }
  for (const char* usual : {"density", "surface"}) {
    if (const size_t i = named(usual); i < grids.size()) return i;
  }
  return size_t{0};
}

bool is_level_set(const openvdb::GridBase& grid) { return grid.getGridClass() == openvdb::GRID_LEVEL_SET; }

/// Makes the map of a grid one of cubes along the axes, by resampling its values where it must.
Status straighten(openvdb::GridBase::Ptr& grid, VdbGridFacts& facts, ImportReport& report) {
  if (maps_to_cubes(*grid)) return {};
  if (!grid->isType<openvdb::FloatGrid>()) {
    report.warnings.push_back(
        fmt::format("the grid '{}' is turned or stretched by its map to the world ({}), which was left out: only float "
                    "grids are resampled",
                    facts.name, facts.map));
    return {};
  }
  TRY(const openvdb::FloatGrid::Ptr straight, resampled_to_cubes(static_cast<const openvdb::FloatGrid&>(*grid)));
  report.warnings.push_back(fmt::format(
      "the grid '{}' is turned or stretched by its map to the world ({}); its values were resampled at cubes "
      "of {:g} m",
      facts.name, facts.map, straight->voxelSize().x()));
  grid = straight;
  const openvdb::Vec3d size = grid->voxelSize(), origin = grid->indexToWorld(openvdb::Coord(0));
  facts.voxel_size = {size.x(), size.y(), size.z()};
  facts.origin = {origin.x(), origin.y(), origin.z()};
  return {};
}

/// Adds a level set or a point grid to the world of `first`, where there is air.
Status add_part(const openvdb::GridBase& part, const VdbGridFacts& facts, const openvdb::GridBase& first, World& world,
                Regions& regions) {
  Block block;
  block.name = "vdb:" + facts.name;
  block.albedo = {0.8f, 0.8f, 0.8f};
  TRY(const BlockId id, world.palette->add(block));
  openvdb::GridBase::ConstPtr placed = part.copyGrid();
  std::optional<openvdb::Coord> shift = whole_voxels_between(part, first);
  if (!shift) {
    if (part.isType<openvdb::FloatGrid>()) {
      TRY(placed, resampled_like(static_cast<const openvdb::FloatGrid&>(part), first));
    } else {
      return input_error("it lies between the voxels of the first grid, and only float grids are resampled");
    }
    shift = openvdb::Coord(0);
  }
  Status status;
  with_tree(*placed, [&](const auto& tree) {
    using Value = typename std::decay_t<decltype(tree)>::ValueType;
    const auto solid = [&](const Value& value, bool active) {
      if constexpr (std::is_floating_point_v<Value>) {
        if (is_level_set(part)) return value <= 0;
      }
      return active;
    };
    for (auto value = tree.cbeginValueAll(); value && status.ok(); ++value) {
      if (!solid(*value, value.isValueOn())) continue;
      openvdb::CoordBBox box = value.getBoundingBox();
      box.translate(*shift);
      if (!inside_world(box.min()) || !inside_world(box.max())) {
        status = input_error("it reaches past the world's border");
        break;
      }
      if (box.volume() > uint64_t{1} << 24) {
        status = input_error("it has a tile of more than 2^24 voxels inside");
        break;
      }
      for (auto c = box.begin(); c && status.ok(); ++c) status = regions.set_if_air(voxel(*c), id);
    }
  });
  return status;
}

/// The layers that were written beside a block grid.
void read_layers(const Loaded& loaded, const openvdb::GridBase& blocks, World& world) {
  for (const openvdb::GridBase::Ptr& grid : loaded.grids) {
    const std::optional<Layer> layer = layer_from_name(grid->getName());
    if (!layer || layer == Layer::block || whole_voxels_between(*grid, blocks) != openvdb::Coord(0)) continue;
    if (layer_rows()[static_cast<size_t>(*layer)].is_integer) {
      if (const auto numbers = openvdb::GridBase::grid<openvdb::Int32Grid>(grid); numbers && numbers->background() == 0)
        world.store.make_int_layer(*layer).grid().grid->setTree(numbers->constTree().copy());
    } else if (const auto numbers = openvdb::GridBase::grid<openvdb::FloatGrid>(grid)) {
      world.store.make_layer(*layer).grid().grid->setTree(numbers->constTree().copy());
    }
  }
}

void add_facts(const VdbFacts& facts, const VdbGridFacts& grid, ImportReport& report) {
  report.fact("file version", std::to_string(facts.file_version));
  report.fact("library", fmt::format("{}.{}", facts.library_major, facts.library_minor));
  report.fact("grids", std::to_string(facts.grids.size()));
  report.fact("grid", grid.name);
  report.fact("type", grid.type + (grid.half ? ", half floats" : ""));
  report.fact("class", grid.grid_class);
  report.fact("active voxels", std::to_string(grid.active_voxels));
  report.fact("leaf nodes", std::to_string(grid.leaf_nodes));
  report.fact("active tiles", std::to_string(grid.active_tiles));
  report.fact("voxel size", fmt::format("{:g} {:g} {:g}", grid.voxel_size.x, grid.voxel_size.y, grid.voxel_size.z));
  if (grid.points) report.fact("points", std::to_string(grid.points));
  if (grid.values && grid.active_voxels) {
    report.fact("min", fmt::format("{:g}", grid.values->min));
    report.fact("max", fmt::format("{:g}", grid.values->max));
    report.fact("mean", fmt::format("{:g}", grid.values->sum / static_cast<double>(grid.active_voxels)));
  }
}

}  // namespace

namespace vdb {

Result<World> world_from_grids(Loaded loaded, std::string_view format, const std::string& name,
                               const ImportOptions& options, ImportReport& report) {
  for (const std::string& grid : loaded.unknown)
    report.warnings.push_back(fmt::format("the grid {} is of a type that is not read", grid));
  if (loaded.grids.empty())
    return input_error(fmt::format("{}: holds no grid of a type that is read, only {}", name, loaded.unknown.front()));
  TRY(const size_t chosen, choose_grid(loaded, options.grid, name));
  VdbGridFacts& facts = loaded.facts.grids[chosen];
  add_facts(loaded.facts, facts, report);
  World world;
  Regions regions{.most = most_regions(loaded.file_bytes), .built = {}};
  const bool blocks = is_block_grid(*loaded.grids[chosen]);
  const auto named = [&](const Error& error, const std::string& grid) {
    return error.message.starts_with(name) ? error
                                           : input_error(fmt::format("{}: grid '{}': {}", name, grid, error.message));
  };
  try {
    if (!blocks) {
      const Status status = straighten(loaded.grids[chosen], facts, report);
      if (!status) return named(status.error(), facts.name);
    }
    const openvdb::GridBase& grid = *loaded.grids[chosen];
    const Status status = blocks ? read_blocks(static_cast<const openvdb::Int32Grid&>(grid), name, world, regions)
                                 : read_shape(grid, facts, world, regions);
    if (!status) return named(status.error(), facts.name);
    if (blocks) read_layers(loaded, grid, world);
    for (size_t i = 0; i < loaded.grids.size(); ++i) {
      if (i == chosen) continue;
      const openvdb::GridBase& other = *loaded.grids[i];
      const VdbGridFacts& of_other = loaded.facts.grids[i];
      if (blocks && layer_from_name(of_other.name)) continue;
      const bool shape = is_level_set(other) || other.isType<openvdb::points::PointDataGrid>();
      if (!blocks && shape && options.grid.empty()) {
        const Status added = add_part(other, of_other, grid, world, regions);
        if (!added) return named(added.error(), of_other.name);
        report.fact("and grid", of_other.name);
      } else {
        report.warnings.push_back(fmt::format("the grid '{}' was left out; '{}' was read", of_other.name, facts.name));
      }
    }
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: grid '{}': {}", name, facts.name, e.what()));
  }
  if (!blocks) {
    set_origin(world, format, name, facts.voxel_size.x);
    world.metadata["vdb.grid"] = facts.name;
    world.metadata[kOriginKey] = fmt::format("{} {} {}", facts.origin.x, facts.origin.y, facts.origin.z);
    report.fact("origin", fmt::format("{:g} {:g} {:g}", facts.origin.x, facts.origin.y, facts.origin.z));
  }
  for (auto& [r, region] : regions.built) world.store.adopt(std::move(region));
  return world;
}

}  // namespace vdb

Result<World> world_from_vdb(std::span<const uint8_t> bytes, const std::string& name, ImportReport& report,
                             const ImportOptions& options) {
  TRY(Loaded loaded, load(bytes, name));
  return world_from_grids(std::move(loaded), "vdb", name, options, report);
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
      .read = [](const std::filesystem::path& path, const ImportOptions& options,
                 ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, kMaxFileBytes));
        return world_from_vdb(bytes, path.string(), report, options);
      },
      .write = write_vdb,
      .losses = lost_surroundings,
  };
  return format;
}

}  // namespace world
