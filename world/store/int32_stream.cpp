// What stands in the stream of a tree of one region, numbers little-endian:
//
//   header   of the file and the grid: name, type, transform. OpenVDB itself writes it, once.
//   topology of the root: 1 buffer, background 0, 0 tiles, 1 child (or none: then the stream ends here);
//            of the 4096^3 node: its corner, bits of children, bits of active tiles, 0 ("inactive is background");
//            of the 128^3 node: the same without corner, then an Int32 a tile that is not air;
//            of each leaf: bits of voxels that are not air
//   buffers  of each leaf: the same bits, 0, and an Int32 a voxel that is not air
#include "world/store/int32_stream.h"

#include <cstring>

#include "world/store/grid_stream.h"
#include "world/store/occupied_mask.h"

namespace world {

namespace {

using Int32Tree = openvdb::Int32Tree;
using Upper = Int32Tree::RootNodeType::ChildNodeType;
using Lower = Upper::ChildNodeType;
static_assert(Lower::NUM_VALUES == kLeavesPerRegion && Upper::ChildNodeType::DIM == kRegionSize);

constexpr char kInactiveIsBackground = 0;

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// All that comes before the number of the root's tiles.
std::string make_header() {
  auto grid = openvdb::Int32Grid::create(kAir);
  grid->setName(kBlockGridName);
  std::string bytes = stream_bytes_without_statistics(grid);
  constexpr uint32_t kEmptyRoot[] = {1, kAir, 0, 0};  // buffers, background, tiles, children
  CHECK(bytes.size() > sizeof kEmptyRoot);
  CHECK_EQ(std::memcmp(bytes.data() + bytes.size() - sizeof kEmptyRoot, kEmptyRoot, sizeof kEmptyRoot), 0);
  bytes.resize(bytes.size() - 2 * sizeof(uint32_t));
  return bytes;
}

/// Appends the ids of the voxels of the mask, as Int32.
void append_ids(std::string& bytes, const BlockId* values, const LeafMask& mask) {
  int32_t ids[kLeafVoxels];
  size_t n = 0;
  for (int w = 0; w < 8; ++w) {
    const BlockId* row = values + 64 * w;
    if (mask.word[w] == ~uint64_t{0}) {
      for (int i = 0; i < 64; ++i) ids[n + static_cast<size_t>(i)] = row[i];
      n += 64;
      continue;
    }
    for (uint64_t rest = mask.word[w]; rest; rest &= rest - 1) ids[n++] = row[std::countr_zero(rest)];
  }
  bytes.append(reinterpret_cast<const char*>(ids), n * sizeof(int32_t));
}

}  // namespace

std::string stream_bytes_without_statistics(const openvdb::GridBase::ConstPtr& grid) {
  std::ostringstream out(std::ios::binary);
  openvdb::io::Stream stream(out);
  stream.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK);
  stream.setGridStatsMetadataEnabled(false);  // bytes of the tree in memory, and what else reading it shows
  stream.write(openvdb::GridCPtrVec{grid});
  std::string bytes = std::move(out).str();
  for (size_t i = kUuidOffset; i < kUuidOffset + kUuidBytes; ++i)
    if (bytes[i] != '-') bytes[i] = '0';
  return bytes;
}

std::string int32_stream(RegionPos pos, RegionLeaves leaves) {
  static const std::string header = make_header();
  uint64_t child[kLeavesPerRegion / 64] = {}, tile[kLeavesPerRegion / 64] = {};
  std::string tile_ids, leaf_masks, buffers;
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const LeafBlocks leaf = leaves(i);
    if (leaf.values) {
      child[i >> 6] |= uint64_t{1} << (i & 63);
      const LeafMask mask = occupied_mask(leaf.values);
      append(leaf_masks, mask.word);
      append(buffers, mask.word);
      buffers += kInactiveIsBackground;
      append_ids(buffers, leaf.values, mask);
    } else if (leaf.uniform != kAir) {
      tile[i >> 6] |= uint64_t{1} << (i & 63);
      append(tile_ids, int32_t{leaf.uniform});
    }
  }
  const bool any = !leaf_masks.empty() || !tile_ids.empty();
  std::string bytes;
  bytes.reserve(header.size() + 2 * sizeof(Upper::NodeMaskType) + 2 * sizeof child + 64 + tile_ids.size() +
                leaf_masks.size() + buffers.size());
  bytes = header;
  append(bytes, uint32_t{0});
  append(bytes, uint32_t{any});
  if (!any) return bytes;

  const openvdb::Coord corner = coord(voxel_from_region(pos));
  const openvdb::Coord upper_corner = corner & ~(static_cast<openvdb::Int32>(Upper::DIM) - 1);
  for (int axis = 0; axis < 3; ++axis) append(bytes, int32_t{upper_corner[axis]});
  uint64_t region[Upper::NUM_VALUES / 64] = {};
  const openvdb::Index place = Upper::coordToOffset(corner);
  region[place >> 6] = uint64_t{1} << (place & 63);
  append(bytes, region);
  bytes.append(sizeof region, '\0');
  bytes += kInactiveIsBackground;

  append(bytes, child);
  append(bytes, tile);
  bytes += kInactiveIsBackground;
  bytes += tile_ids;
  bytes += leaf_masks;
  bytes += buffers;
  return bytes;
}

}  // namespace world
