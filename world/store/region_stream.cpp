#include "world/store/region_stream.h"

#include <openvdb/io/Stream.h>

#include <istream>
#include <sstream>

#include "world/base/span_stream.h"
#include "world/store/tree.h"

namespace world {

namespace {

// An OpenVDB header: magic (8 bytes), file version, library major and minor (4 each), has-offsets (1), then a random
// UUID of 36 characters, which would make equal regions differ.
constexpr size_t kUuidOffset = 8 + 4 + 4 + 4 + 1;
constexpr char kNoUuid[] = "00000000-0000-0000-0000-000000000000";

using Int32Tree = openvdb::Int32Tree;
using Int32Leaf = Int32Tree::LeafNodeType;

Int32Tree::Ptr int32_from_region(const RegionNode& node) {
  auto tree = std::make_shared<Int32Tree>(kAir);
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const LeafBlocks leaf = leaf_of(node, i);
    const openvdb::Coord origin = node.origin() + (coord(voxel_from_leaf(leaf_offset_in_region(i))));
    if (!leaf.values) {
      if (leaf.uniform != kAir) tree->addTile(1, origin, leaf.uniform, true);
      continue;
    }
    auto* out = new Int32Leaf(origin, kAir, false);
    int32_t* values = out->buffer().data();
    for (int v = 0; v < kLeafVoxels; ++v) {
      values[v] = leaf.values[v];
      if (leaf.values[v] != kAir) out->setValueOn(static_cast<openvdb::Index>(v));
    }
    tree->addLeaf(out);
  }
  return tree;
}

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

}  // namespace

Result<std::string> encode_region(const Store& store, RegionPos pos) {
  initialize_openvdb();
  const auto found = store.nodes().regions.find(pos);
  if (found == store.nodes().regions.end()) return input_error("the region is empty");
  try {
    auto grid = openvdb::Int32Grid::create(int32_from_region(*found->second));
    grid->setName("block_id");
    std::ostringstream out(std::ios::binary);
    openvdb::io::Stream stream(out);
    stream.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    openvdb::GridCPtrVec grids{grid};
    stream.write(grids);
    std::string bytes = std::move(out).str();
    CHECK(bytes.size() > kUuidOffset + 36 && bytes[kUuidOffset + 8] == '-');
    bytes.replace(kUuidOffset, 36, kNoUuid, 36);
    return bytes;
  } catch (const std::exception& e) {
    return input_error(std::string("OpenVDB could not write a region: ") + e.what());
  }
}

Result<RegionBuilder> decode_region(std::span<const char> bytes, RegionPos pos, size_t palette_size) {
  initialize_openvdb();
  try {
    SpanBuffer buffer(bytes);
    std::istream in(&buffer);
    openvdb::io::Stream stream(in, /*delayLoad=*/false);
    const openvdb::GridPtrVecPtr grids = stream.getGrids();
    if (!grids || grids->size() != 1) return input_error("the region's stream does not hold exactly one grid");
    const auto grid = openvdb::gridPtrCast<openvdb::Int32Grid>(grids->front());
    if (!grid) return input_error("the region's grid is not of 32-bit integers");
    return builder_from_int32(grid->constTree(), pos, palette_size);
  } catch (const std::exception& e) {
    return input_error(std::string("OpenVDB could not read a region: ") + e.what());
  }
}

}  // namespace world
