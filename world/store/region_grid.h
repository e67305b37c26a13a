/// Reading the OpenVDB stream of one region without OpenVDB, whose own reader believes every size and count of a
/// stream: anybody can make a save whose hashes are right. Memory is that of one node, whatever the stream claims.
///
/// The stream, as OpenVDB 10's io::Stream writes a grid (little-endian; a text is its length in 4 bytes, then the
/// bytes):
///   head       magic (8 bytes), file version (4), library (8), has offsets (1), UUID (36)
///   metadata   count (4); each: name, type, bytes (4), value
///   grids      1 (4)
///   the grid   name, type, name of its instance parent, three offsets (24), compression (4), metadata, name of its
///              map and the map's numbers
///   topology   1 (4), background, tiles (4), children (4) of the root; each child: origin (12), a node
///     a node   which entries are children, which are active (a bit each), values, then the children; of a leaf only
///              which voxels are active
///   values     leaf by leaf: which voxels are active, values
/// Values are packed as unpack() says.
/// source OpenVDB 10.0. tree/RootNode.h, InternalNode.h, LeafNode.h, io/Compression.h; 2022
#pragma once

#include <cstdint>
#include <span>

#include "world/base/errors.h"
#include "world/base/function_ref.h"
#include "world/space/coords.h"

namespace world {

/// What a region's grid holds, in the order of the stream: leaves after all tiles.
template <class T>
struct GridVisitor {
  /// A cube of equal values: `size` is 8 or 128.
  FunctionRef<Status(VoxelPos origin, int size, T value, bool active)> tile;
  /// Values by index_in_leaf, of voxels that are not active too; active: a bit each, by index.
  FunctionRef<Status(LeafPos leaf, std::span<const T, kLeafVoxels> values, std::span<const uint64_t, 8> active)> leaf;
};

/// T: int32_t or float, the grid's type. Fails, with a sentence that names no file, where the bytes are no stream of
/// exactly one such grid with a background of 0, or hold anything outside the region.
template <class T>
Status read_region_grid(std::span<const char> bytes, RegionPos region, const GridVisitor<T>& visitor);

extern template Status read_region_grid(std::span<const char>, RegionPos, const GridVisitor<int32_t>&);
extern template Status read_region_grid(std::span<const char>, RegionPos, const GridVisitor<float>&);

}  // namespace world
