/// OpenVDB's side of the store. Only world/store/*.cpp, world/formats/vdb* and tools/bench/rivals/ may include this
/// file: OpenVDB's headers cost 20 s a file.
///
/// Invariant: a region that holds anything is an InternalNode of level 1 in the tree, and `regions` points to it; there
/// are no tiles above that level. A leaf of one value is a tile. Active means "not air".
#pragma once

#include <openvdb/openvdb.h>

#include <atomic>
#include <map>
#include <unordered_map>
#include <vector>

#include "world/store/store.h"

using LoamBlockTree = openvdb::tree::Tree4<uint16_t, 5, 4, 3>::Type;
extern template class openvdb::tree::Tree<LoamBlockTree::RootNodeType>;

namespace world {

using BlockTree = LoamBlockTree;
using BlockLeaf = BlockTree::LeafNodeType;
using UpperNode = BlockTree::RootNodeType::ChildNodeType;  // 4096^3
using RegionNode = UpperNode::ChildNodeType;               // 128^3
static_assert(RegionNode::NUM_VALUES == kLeavesPerRegion && BlockLeaf::SIZE == kLeafVoxels);

inline openvdb::Coord coord(VoxelPos v) { return {v.x, v.y, v.z}; }
inline VoxelPos voxel(const openvdb::Coord& c) { return {c.x(), c.y(), c.z()}; }

inline LeafBlocks leaf_of(const RegionNode& node, int leaf_index) {
  const auto n = static_cast<openvdb::Index>(leaf_index);
  if (node.isChildMaskOn(n)) return {node.getTable()[n].getChild()->buffer().data(), kAir};
  return {nullptr, node.getTable()[n].getValue()};
}

struct FloatLayer::Grid {
  openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0.0f);
};

/// Counts of the blocks of one region; sorted by id, never air, never zero.
struct RegionCensus {
  std::vector<std::pair<BlockId, int64_t>> counts;
  void add(BlockId block, int64_t n);
};

struct StoreNodes {
  const uint64_t identity = [] {
    static std::atomic<uint64_t> stores{0};
    return ++stores;
  }();
  BlockTree tree{kAir};
  std::unordered_map<RegionPos, RegionNode*, PosHash> regions;
  std::unordered_map<RegionPos, RegionCensus, PosHash> census;
  std::unique_ptr<MaskVolume> masks[kMaskKinds];
  std::vector<std::vector<LeafPos>> dirty;  // by subscriber; may hold a leaf twice until taken
  std::map<Layer, FloatLayer> layers;       // made on demand
  mutable std::atomic<int> views{0};

  /// The node of a region, made where it is missing.
  RegionNode& make_region(RegionPos r);
  /// Puts a node, owned from now on, in the place of the region.
  void put_region(RegionPos r, RegionNode* node);
  LeafBlocks leaf(LeafPos l) const {
    const auto found = regions.find(region_from_leaf(l));
    return found == regions.end() ? LeafBlocks{} : leaf_of(*found->second, index_in_region(l));
  }
};

/// Writes 512 values into a leaf of the node, as a tile where they are all equal.
void write_leaf(RegionNode& node, LeafPos l, const BlockId* values);
bool all_equal(const BlockId* values);

/// Registers OpenVDB's types once; call before any use of its files.
void initialize_openvdb();

}  // namespace world
