#include "world/store/region_stream.h"

#include <new>

#include "world/store/grid_stream.h"
#include "world/store/int32_stream.h"

namespace world {

namespace {

using Int32Tree = openvdb::Int32Tree;
using Int32Leaf = Int32Tree::LeafNodeType;

Result<RegionBuilder> builder_from_int32(const Int32Tree& tree, RegionPos pos, size_t palette_size) {
  RegionBuilder builder(pos);
  BlockId values[kLeafVoxels];
  const auto valid = [&](int32_t v) { return v >= 0 && static_cast<size_t>(v) < palette_size; };
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const openvdb::Coord origin = coord(voxel_from_leaf(leaf_from_region(pos) + leaf_offset_in_region(i)));
    const Int32Leaf* leaf = tree.probeConstLeaf(origin);
    if (!leaf) {
      const int32_t v = tree.getValue(origin);
      if (!valid(v)) return input_error("block id " + std::to_string(v) + " is not in the palette");
      if (v != kAir) builder.set_uniform(i, static_cast<BlockId>(v));
      continue;
    }
    const int32_t* ids = leaf->buffer().data();
    for (int v = 0; v < kLeafVoxels; ++v) {
      if (!valid(ids[v])) return input_error("block id " + std::to_string(ids[v]) + " is not in the palette");
      values[v] = static_cast<BlockId>(ids[v]);
    }
    builder.set_leaf(i, values);
  }
  return builder;
}

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
  initialize_openvdb();
  try {
    const auto grid = grid_from_bytes<openvdb::Int32Grid>(bytes);
    if (!grid) return input_error("the region's stream does not hold exactly one grid of 32-bit integers");
    return builder_from_int32(grid->constTree(), pos, palette_size);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    return input_error(std::string("OpenVDB could not read a region: ") + e.what());
  }
}

}  // namespace world
