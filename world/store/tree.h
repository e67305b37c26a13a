/// OpenVDB's side of the store. Only world/store/*.cpp, world/formats/vdb* and tools/bench/rivals/ may include this
/// file: OpenVDB's headers cost 20 s a file.
///
/// Invariant: an open region is an InternalNode of level 1 in the tree, and its slot points to it; there are no tiles
/// above that level. A leaf of one value is a tile. Active means "not air". A region at rest is in its slot only.
#pragma once

#include <openvdb/openvdb.h>

#include <atomic>
#include <map>
#include <mutex>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "world/store/snapshot.h"
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

template <class T>
struct GridLayer<T>::Grid {
  using Type = std::conditional_t<std::is_same_v<T, float>, openvdb::FloatGrid, openvdb::Int32Grid>;
  typename Type::Ptr grid = Type::create(T{0});
};

/// Counts of the blocks of one region; sorted by id, never air, never zero.
struct RegionCensus {
  std::vector<std::pair<BlockId, int64_t>> counts;
  void add(BlockId block, int64_t n);
};

/// One region: open in the tree, or packed. Exactly one of the two is there.
struct RegionSlot {
  RegionNode* node = nullptr;  // the tree's
  std::shared_ptr<const PackedRegion> packed;
  uint64_t edits = 0;
  LeafBlocks leaf(int leaf_index) const { return node ? leaf_of(*node, leaf_index) : packed->leaf(leaf_index); }
};

/// Reads the leaves of one region one after the other, without leaving anything unpacked in it.
class RegionLeaves {
 public:
  explicit RegionLeaves(const RegionSlot& slot) : node_(slot.node), packed_(slot.packed.get()) {}
  explicit RegionLeaves(const PackedRegion& packed) : packed_(&packed) {}
  explicit RegionLeaves(const RegionNode& node) : node_(&node) {}
  /// Valid until the next call.
  LeafBlocks operator()(int leaf_index) {
    if (node_) return leaf_of(*node_, leaf_index);
    if (!packed_->is_mixed(leaf_index)) return {nullptr, packed_->uniform_block(leaf_index)};
    packed_->unpack(leaf_index, scratch_);
    return {scratch_, kAir};
  }

 private:
  const RegionNode* node_ = nullptr;
  const PackedRegion* packed_ = nullptr;
  BlockId scratch_[kLeafVoxels];
};

/// One region of a snapshot: still that of the store until an edit or the writer packs it.
struct StoreSnapshot::Region {
  RegionPos pos;
  Census census;
  std::mutex mutex;
  const RegionNode* node = nullptr;  // while the store's is still the same; null where the region is air
  std::shared_ptr<const PackedRegion> packed;

  std::shared_ptr<const PackedRegion> resolve();
};

struct StoreNodes {
  const uint64_t identity = [] {
    static std::atomic<uint64_t> stores{0};
    return ++stores;
  }();
  BlockTree tree{kAir};
  std::unordered_map<RegionPos, RegionSlot, PosHash> regions;
  std::unordered_map<RegionPos, RegionCensus, PosHash> census;
  std::unique_ptr<MaskVolume> masks[kMaskKinds];
  std::vector<std::vector<LeafPos>> dirty;  // by subscriber; may hold a leaf twice until taken
  std::map<Layer, AnyLayer> layers;         // made on demand
  std::set<Layer> dropped_layers;           // since the last save
  mutable std::atomic<int> views{0};
  std::unordered_set<RegionPos, PosHash> unsaved;
  std::optional<RegionPos> last_unsaved;  // in `unsaved`: spares a look for each leaf
  std::unordered_map<RegionPos, std::weak_ptr<StoreSnapshot::Region>, PosHash> in_snapshot;

  ~StoreNodes();
  /// Lets a snapshot that still shares the region copy it. Called before anything of a region changes.
  void before_change(RegionPos r) {
    if (!in_snapshot.empty()) copy_for_snapshot(r);
  }
  void copy_for_snapshot(RegionPos r);
  void changed(RegionPos r) {
    if (last_unsaved == r) return;
    unsaved.insert(r);
    last_unsaved = r;
  }
  /// The open node of a region, or null where it is all air and has none.
  RegionNode* open_region(RegionPos r);
  /// The node of a region, made where it is missing.
  RegionNode& make_region(RegionPos r);
  /// Puts a node, owned from now on, in the place of the region.
  void put_region(RegionPos r, RegionNode* node);
  void put_packed(RegionPos r, std::shared_ptr<const PackedRegion> packed);
  void remove_region(RegionPos r);
  LeafBlocks leaf(LeafPos l) const {
    const auto found = regions.find(region_from_leaf(l));
    return found == regions.end() ? LeafBlocks{} : found->second.leaf(index_in_region(l));
  }
};

/// Writes 512 values into a leaf of the node, as a tile where they are all equal.
void write_leaf(RegionNode& node, LeafPos l, const BlockId* values);
bool all_equal(const BlockId* values);

/// Registers OpenVDB's types once; call before any use of its files.
void initialize_openvdb();

}  // namespace world
