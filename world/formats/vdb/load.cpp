// Loading .vdb files with care: header, a trial in a child process, and a survey of every value.
#include "world/formats/vdb/grids.h"

#include <cmath>

#include <fmt/format.h>

#include "world/base/jobs.h"
#include "world/base/span_stream.h"
#include "world/base/trial.h"
#include "world/formats/bytes.h"

namespace world {
namespace vdb {
namespace {

using openvdb::points::PointDataGrid;

constexpr uint64_t kMagic = 0x56444220;

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
  Loaded loaded{.facts = std::move(facts), .grids = {}, .unknown = {}, .file_bytes = bytes.size()};
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
      const Result<bool> known = survey_grid(*grid, of_grid);
      if (!known)
        return input_error(fmt::format("{}: grid '{}', before byte {}: {}", name, of_grid.name, buffer.position(),
                                       known.error().message));
      if (!*known) {
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

}  // namespace

Result<bool> survey_grid(const openvdb::GridBase& grid, VdbGridFacts& facts) {
  Status status;
  const bool known = with_tree(grid, [&](const auto& tree) { status = survey(tree, facts); });
  if (!status) return status.error();
  return known;
}

Result<Loaded> load(std::span<const uint8_t> bytes, std::string_view name) {
  if (const Result<VdbFacts> header = read_header(bytes, name); !header) return header.error();
  initialize_openvdb();
  const TrialLimits limits{.memory_bytes = (uint64_t{256} << 20) + 16 * bytes.size(),
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

}  // namespace vdb

Result<VdbFacts> inspect_vdb(std::span<const uint8_t> bytes, std::string_view name) {
  TRY(const vdb::Loaded loaded, vdb::load(bytes, name));
  return loaded.facts;
}

Result<VdbFacts> inspect_vdb(const std::filesystem::path& path) {
  TRY(const std::vector<uint8_t> bytes, read_file(path, vdb::kMaxFileBytes));
  return inspect_vdb(bytes, path.string());
}

}  // namespace world
