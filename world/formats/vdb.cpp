// OpenVDB .vdb -> world, and back.
//
// Reading takes one grid: a Loam block grid if there is one, else "density", "surface", else the first; the others are
// named in the report. Axes and indices stay as they are: index (i, j, k) is the voxel (i, j, k). The size of a voxel
// goes to the metadata; where the map rotates, shears or moves, a warning says that it was left out.
//   Loam block grid            the blocks, exactly
//   level set                  one block where the distance is <= 0: band and inside
//   everything else            one block where a voxel is active: fog volumes, points, vectors, masks, integers
// That block, "vdb:NAME", is opaque and white, so that it is seen; the numbers of a float grid become the layer
// `density`.
//
// Writing makes one Int32 grid "block_id" of block ids, 0 is air and inactive; its metadata hold each block of the
// palette as TOML (loam_block_ID) and what the world knows of itself (loam_about_KEY); surroundings (sun, sky) are not
// in it. The same world gives the same bytes: the UUID is made from the content.
//
// OpenVDB's reader believes sizes and ignores read errors (hard case IO10): everything goes through try_in_child first,
// and what was read is checked: finite numbers, leaves where the tree says they are, voxels within the world's border.
// What no reader can find is a changed but finite number, since the format has no checksums.
#include "world/formats/vdb.h"

#include <openvdb/io/Stream.h>
#include <openvdb/points/PointDataGrid.h>

#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/base/span_stream.h"
#include "world/base/trial.h"
#include "world/formats/bytes.h"
#include "world/store/grid_stream.h"
#include "world/store/tree.h"

namespace world {
namespace {

using openvdb::points::PointDataGrid;

constexpr uint64_t kMagic = 0x56444220;
constexpr size_t kUuidOffset = 8 + 4 + 4 + 4 + 1, kUuidBytes = 36;
constexpr uint64_t kMaxFileBytes = uint64_t{1} << 33;
constexpr size_t kMaxRegions = size_t{1} << 15;  // a region costs 34 kB before it holds anything
constexpr const char* kBlockGrid = "block_id";
const std::string kBlockKey = "loam_block_", kAboutKey = "loam_about_";

/// Calls visit(tree of its own type) where the grid's type is one that we know.
template <class Visit>
bool with_tree(const openvdb::GridBase& grid, Visit visit) {
  const auto try_type = [&](auto* null) {
    using Grid = std::remove_pointer_t<decltype(null)>;
    if (!grid.isType<Grid>()) return false;
    visit(static_cast<const Grid&>(grid).constTree());
    return true;
  };
  return try_type(static_cast<openvdb::FloatGrid*>(nullptr)) || try_type(static_cast<openvdb::DoubleGrid*>(nullptr)) ||
         try_type(static_cast<openvdb::Int32Grid*>(nullptr)) || try_type(static_cast<openvdb::Int64Grid*>(nullptr)) ||
         try_type(static_cast<openvdb::BoolGrid*>(nullptr)) || try_type(static_cast<openvdb::MaskGrid*>(nullptr)) ||
         try_type(static_cast<openvdb::Vec3SGrid*>(nullptr)) || try_type(static_cast<openvdb::Vec3DGrid*>(nullptr)) ||
         try_type(static_cast<PointDataGrid*>(nullptr));
}

template <class Value>
constexpr bool kIsNumber = std::is_arithmetic_v<Value>;

template <class Value>
bool is_finite(const Value& value) {
  if constexpr (std::is_floating_point_v<Value>) {
    return std::isfinite(value);
  } else if constexpr (openvdb::VecTraits<Value>::IsVec) {
    return std::isfinite(value[0]) && std::isfinite(value[1]) && std::isfinite(value[2]);
  } else {
    return true;
  }
}

bool inside_world(const openvdb::Coord& c) { return world::inside_world(voxel(c)); }

/// Goes over all leaves and tiles once: checks them and adds up. The sentence says what is wrong.
template <class Tree>
Status survey(const Tree& tree, VdbGridFacts& facts) {
  using Value = typename Tree::ValueType;
  VdbGridFacts::Values values;
  bool first = true;
  const auto add = [&](const Value& value, uint64_t voxels) {
    facts.active_voxels += voxels;
    if constexpr (kIsNumber<Value>) {
      const double number = static_cast<double>(value);
      values.min = first ? number : std::min(values.min, number);
      values.max = first ? number : std::max(values.max, number);
      values.sum += number * static_cast<double>(voxels);
      first = false;
    }
  };
  if (!is_finite(tree.background())) return input_error("the background is not a finite number");
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord origin = leaf->origin();
    if (!inside_world(origin)) return input_error("a leaf lies outside of the world's border");
    if (tree.probeConstLeaf(origin) != &*leaf) return input_error("a leaf lies where it does not belong");
    ++facts.leaf_nodes;
    for (openvdb::Index n = 0; n < kLeafVoxels; ++n) {
      const Value value = leaf->getValue(n);
      if (!is_finite(value)) return input_error("a value is not a finite number (NaN or infinite)");
      if (leaf->isValueOn(n)) {
        add(value, 1);
        facts.bounds.include(voxel(origin) + offset_in_leaf(static_cast<int>(n)));
      }
    }
    if constexpr (std::is_same_v<Tree, PointDataGrid::TreeType>) {
      leaf->validateOffsets();  // throws where an index runs backwards or past the points
      facts.points += leaf->pointCount();
    }
  }
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(tile.LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (!is_finite(*tile)) return input_error("the value of a tile is not a finite number");
    if (!tile.isValueOn()) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    if (!inside_world(box.min()) || !inside_world(box.max()))
      return input_error("a tile lies outside of the world's border");
    if ((box.min() & (box.dim().x() - 1)) != openvdb::Coord(0))
      return input_error("a tile lies where it does not belong");
    ++facts.active_tiles;
    add(*tile, box.volume());
    facts.bounds.include(VoxelBox{voxel(box.min()), voxel(box.max())});
  }
  if constexpr (kIsNumber<Value>) {
    values.background = static_cast<double>(tree.background());
    facts.values = values;
  }
  return {};
}

struct Loaded {
  VdbFacts facts;
  std::vector<openvdb::GridBase::Ptr> grids;
  std::vector<std::string> unknown;  // grids of types that OpenVDB does not know here
};

Result<VdbFacts> read_header(std::span<const uint8_t> bytes, std::string_view name) {
  ByteReader in(bytes, name);
  const uint64_t magic = in.u32_le() | uint64_t{in.u32_le()} << 32;
  if (in.failed() || magic != kMagic)
    return byte_error(name, 0, "expected the magic number of OpenVDB; this is no .vdb file");
  VdbFacts facts;
  facts.file_version = in.u32_le();
  facts.library_major = in.u32_le();
  facts.library_minor = in.u32_le();
  in.u8();
  // Before version 222 the UUID is 16 bytes; such files are from 2012 and before.
  if (!in.failed() && facts.file_version < 222) {
    return byte_error(
        name, 8,
        fmt::format("the file version {} is too old; expected 222 or later: save it again", facts.file_version));
  }
  const auto uuid = in.bytes(kUuidBytes);
  if (in.failed()) return in.end_error("the header");
  for (const uint8_t c : uuid) facts.uuid += c >= 32 && c < 127 ? static_cast<char>(c) : '?';
  return facts;
}

/// Names of grids, and what OpenVDB says of damaged files, are any bytes.
std::string printable(const std::string& bytes, size_t most = 64) {
  std::string clean;
  for (const char c : bytes.substr(0, most)) clean += c >= 32 && c < 127 ? c : '?';
  return clean;
}

/// Reads all grids in this process.
Result<Loaded> load_here(std::span<const uint8_t> bytes, std::string_view name) {
  TRY(VdbFacts facts, read_header(bytes, name));
  initialize_openvdb();
  SpanBuffer buffer({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  std::istream in(&buffer);
  Loaded loaded{.facts = std::move(facts), .grids = {}, .unknown = {}};
  try {
    openvdb::io::Stream stream(in, /*delayLoad=*/false);
    const openvdb::GridPtrVecPtr grids = stream.getGrids();
    if (in.fail() || in.bad())
      return byte_error(name, bytes.size(), "the file ends inside a grid; it is damaged or cut off");
    if (!grids || grids->empty()) return byte_error(name, bytes.size(), "the file holds no grid");
    for (const openvdb::GridBase::Ptr& grid : *grids) {
      VdbGridFacts of_grid;
      of_grid.name = printable(grid->getName());
      of_grid.type = printable(grid->type());
      of_grid.grid_class = openvdb::GridBase::gridClassToString(grid->getGridClass());
      of_grid.map = grid->transform().mapType();
      of_grid.half = grid->saveFloatAsHalf();
      const openvdb::Vec3d size = grid->voxelSize(), origin = grid->indexToWorld(openvdb::Coord(0));
      of_grid.voxel_size = {size.x(), size.y(), size.z()};
      of_grid.origin = {origin.x(), origin.y(), origin.z()};
      if (!std::isfinite(glm::dot(of_grid.voxel_size, of_grid.voxel_size)) ||
          !std::isfinite(glm::dot(of_grid.origin, of_grid.origin))) {
        return input_error(fmt::format("{}: grid '{}': its map to the world is not finite", name, of_grid.name));
      }
      Status status;
      const bool known = with_tree(*grid, [&](const auto& tree) { status = survey(tree, of_grid); });
      if (!status)
        return input_error(fmt::format("{}: grid '{}', before byte {}: {}", name, of_grid.name, buffer.position(),
                                       status.error().message));
      if (!known) {
        loaded.unknown.push_back(of_grid.name + " (" + of_grid.type + ")");
        continue;
      }
      loaded.facts.grids.push_back(std::move(of_grid));
      loaded.grids.push_back(grid);
    }
  } catch (const std::bad_alloc&) {
    return byte_error(name, buffer.position(), "the file asks for more memory than there is; it may be damaged");
  } catch (const std::exception& e) {
    return byte_error(name, buffer.position(), fmt::format("OpenVDB cannot read it: {}", printable(e.what(), 200)));
  }
  return loaded;
}

/// Reads all grids, in a child process first.
Result<Loaded> load(std::span<const uint8_t> bytes, std::string_view name) {
  if (const Result<VdbFacts> header = read_header(bytes, name); !header) return header.error();
  initialize_openvdb();
  const TrialLimits limits{.memory_bytes = (uint64_t{256} << 20) + 256 * bytes.size(),
                           .cpu_seconds = 2 + static_cast<unsigned>(bytes.size() >> 20)};
  const Status tried = try_in_child(limits, [&]() -> Status {
    const ThreadLimit one(1);  // the pool's threads are not in the child
    const Result<Loaded> loaded = load_here(bytes, name);
    return loaded ? Status() : Status(loaded.error());
  });
  if (!tried) {
    const std::string& message = tried.error().message;
    if (message.starts_with(name)) return tried.error();
    return byte_error(name, bytes.size(), fmt::format("the file of this size is damaged: {}", message));
  }
  return load_here(bytes, name);
}

// ---- grids -> blocks ------------------------------------------------------------------------------------------

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

// ---- blocks -> a grid -----------------------------------------------------------------------------------------

openvdb::Int32Tree::Ptr int32_from_store(const Store& store) {
  auto tree = std::make_shared<openvdb::Int32Tree>(kAir);
  for (const RegionPos r : store.regions()) add_region_ids(*tree, *store.nodes().regions.at(r));
  tree->prune();
  return tree;
}

/// A UUID that says the same for the same content.
std::string uuid_of(const Store& store) {
  const uint64_t a = store.content_hash(), b = mix64(a);
  return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:012x}", a >> 32, a >> 16 & 0xffff, a & 0xffff, b >> 48,
                     b & 0xffffffffffff);
}

Status write_vdb(const World& world, const std::filesystem::path& path) {
  initialize_openvdb();
  try {
    auto grid = openvdb::Int32Grid::create(int32_from_store(world.store));
    grid->setName(kBlockGrid);
    grid->setCreator("Loam");
    // OpenVDB's index points are the middles of voxels; ours begin at their low corner.
    double size = 1;
    if (const auto known = world.metadata.find("voxel_size_m"); known != world.metadata.end()) {
      const double value = std::strtod(known->second.c_str(), nullptr);
      if (std::isfinite(value) && value > 1e-9 && value < 1e9) size = value;
    }
    grid->setTransform(openvdb::math::Transform::createLinearTransform(size));
    grid->transform().postTranslate(openvdb::Vec3d(0.5 * size));
    for (size_t id = 0; id < world.palette->size(); ++id) {
      grid->insertMeta(kBlockKey + std::to_string(id),
                       openvdb::StringMetadata(toml_from_block((*world.palette)[static_cast<BlockId>(id)])));
    }
    for (const auto& [key, value] : world.metadata) grid->insertMeta(kAboutKey + key, openvdb::StringMetadata(value));
    grid->addStatsMetadata();
    openvdb::MetaMap about_file;
    about_file.insertMeta("creator", openvdb::StringMetadata("Loam"));

    // Our own stream, because OpenVDB's file writer does not say when a disk is full.
    std::ofstream out(path, std::ios::binary);
    if (!out) return input_error(fmt::format("{}: cannot write: {}", path.string(), std::strerror(errno)));
    openvdb::io::Stream stream(out);
    stream.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    stream.write(openvdb::GridCPtrVec{grid}, about_file);
    out.seekp(static_cast<std::streamoff>(kUuidOffset));
    out << uuid_of(world.store);
    out.close();
    if (!out) return input_error(fmt::format("{}: cannot write all of it: {}", path.string(), std::strerror(errno)));
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: OpenVDB cannot write it: {}", path.string(), e.what()));
  }
  return {};
}

}  // namespace

Result<VdbFacts> inspect_vdb(std::span<const uint8_t> bytes, std::string_view name) {
  TRY(const Loaded loaded, load(bytes, name));
  return loaded.facts;
}

Result<VdbFacts> inspect_vdb(const std::filesystem::path& path) {
  TRY(const std::vector<uint8_t> bytes, read_file(path, kMaxFileBytes));
  return inspect_vdb(bytes, path.string());
}

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
