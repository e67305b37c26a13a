/// OpenVDB streams of one grid in memory. Internal to world/store.
#pragma once

#include <openvdb/io/Stream.h>

#include <sstream>

#include "world/store/tree.h"

namespace world {

// An OpenVDB header: magic (8 bytes), file version, library major and minor (4 each), has-offsets (1), then a random
// UUID of 36 characters, which would make equal grids differ.
constexpr size_t kUuidOffset = 8 + 4 + 4 + 4 + 1, kUuidBytes = 36;

/// Writes the block ids of a region into a tree of 32-bit integers, air as inactive zeros.
inline void add_region_ids(openvdb::Int32Tree& tree, RegionPos pos, RegionLeaves leaves) {
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const LeafBlocks leaf = leaves(i);
    const openvdb::Coord origin = coord(voxel_from_leaf(leaf_from_region(pos) + leaf_offset_in_region(i)));
    if (!leaf.values) {
      if (leaf.uniform != kAir) tree.addTile(1, origin, leaf.uniform, true);
      continue;
    }
    auto* out = new openvdb::Int32Tree::LeafNodeType(origin, kAir, false);
    for (openvdb::Index v = 0; v < kLeafVoxels; ++v) {
      if (leaf.values[v] != kAir) out->setValueOn(v, leaf.values[v]);
    }
    tree.addLeaf(out);
  }
}

/// One grid as bytes, which depend on its values only. May throw what OpenVDB throws.
inline std::string stream_bytes(const openvdb::GridBase::ConstPtr& grid, StreamCompression compression) {
  constexpr char kNoUuid[] = "00000000-0000-0000-0000-000000000000";
  std::ostringstream out(std::ios::binary);
  openvdb::io::Stream stream(out);
  uint32_t flags = openvdb::io::COMPRESS_ACTIVE_MASK;
  if (compression == StreamCompression::blosc) flags |= openvdb::io::COMPRESS_BLOSC;
  stream.setCompression(flags);
  openvdb::GridCPtrVec grids{grid};
  stream.write(grids);
  std::string bytes = std::move(out).str();
  CHECK(bytes.size() > kUuidOffset + kUuidBytes && bytes[kUuidOffset + 8] == '-');
  bytes.replace(kUuidOffset, kUuidBytes, kNoUuid, kUuidBytes);
  return bytes;
}

}  // namespace world
