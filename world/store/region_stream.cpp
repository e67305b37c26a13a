#include "world/store/region_stream.h"

#include <new>

#include "world/store/grid_stream.h"
#include "world/store/int32_stream.h"
#include "world/store/region_grid.h"

namespace world {

namespace {

using Int32Tree = openvdb::Int32Tree;

Result<std::string> encode_leaves(RegionPos pos, RegionLeaves leaves, StreamCompression compression) {
  initialize_openvdb();
  try {
    if (compression == StreamCompression::none) return int32_stream(pos, leaves);
    auto tree = std::make_shared<Int32Tree>(kAir);
    add_region_ids(*tree, pos, leaves);
    auto grid = openvdb::Int32Grid::create(tree);
    grid->setName(kBlockGridName);
    return stream_bytes(grid, compression);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    return input_error(std::string("OpenVDB could not write a region: ") + e.what());
  }
}

}  // namespace

Result<std::string> encode_region(const Store& store, RegionPos pos, StreamCompression compression) {
  const auto found = store.nodes().regions.find(pos);
  if (found == store.nodes().regions.end()) return input_error("the region is empty");
  return encode_leaves(pos, RegionLeaves(found->second), compression);
}

Result<std::string> encode_region(const PackedRegion& region, RegionPos pos, StreamCompression compression) {
  return encode_leaves(pos, RegionLeaves(region), compression);
}

Result<RegionBuilder> decode_region(std::span<const char> bytes, RegionPos pos, size_t palette_size) {
  RegionBuilder builder(pos);
  const auto check = [&](int32_t id) -> Status {
    if (id >= 0 && static_cast<size_t>(id) < palette_size) return {};
    return input_error("block id " + std::to_string(id) + " is not in the palette");
  };
  const auto tile = [&](VoxelPos origin, int size, int32_t id, bool) -> Status {
    TRY_STATUS(check(id));
    if (id == kAir) return {};
    const int first = index_in_region(leaf_from_voxel(origin)), last = size == kLeafSize ? first : kLeavesPerRegion - 1;
    for (int i = first; i <= last; ++i) builder.set_uniform(i, static_cast<BlockId>(id));
    return {};
  };
  const auto leaf = [&](LeafPos l, std::span<const int32_t, kLeafVoxels> ids, std::span<const uint64_t, 8>) -> Status {
    BlockId values[kLeafVoxels];
    for (size_t v = 0; v < kLeafVoxels; ++v) {
      TRY_STATUS(check(ids[v]));
      values[v] = static_cast<BlockId>(ids[v]);
    }
    builder.set_leaf(index_in_region(l), values);
    return {};
  };
  TRY_STATUS(read_region_grid<int32_t>(bytes, pos, {tile, leaf}));
  return builder;
}

}  // namespace world
