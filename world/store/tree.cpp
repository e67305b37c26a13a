#include "world/store/tree.h"

#include <cstring>
#include <mutex>

#include "world/store/occupied_mask.h"

template class openvdb::tree::Tree<LoamBlockTree::RootNodeType>;

namespace world {

void RegionCensus::add(BlockId block, int64_t n) {
  if (block == kAir || n == 0) return;
  auto at = std::lower_bound(counts.begin(), counts.end(), block, [](const auto& c, BlockId b) { return c.first < b; });
  if (at == counts.end() || at->first != block) at = counts.insert(at, {block, 0});
  at->second += n;
  DCHECK(at->second >= 0);
  if (at->second == 0) counts.erase(at);
}

StoreNodes::~StoreNodes() {
  for (auto& [pos, region] : in_snapshot)
    if (const auto alive = region.lock()) alive->resolve();
}

std::shared_ptr<const PackedRegion> StoreSnapshot::Region::resolve() {
  const std::lock_guard lock(mutex);
  if (node) {
    RegionLeaves leaves(*node);
    packed = std::make_shared<PackedRegion>([&](int i) { return leaves(i); });
    node = nullptr;
  }
  return packed;
}

void StoreNodes::copy_for_snapshot(RegionPos r) {
  const auto found = in_snapshot.find(r);
  if (found == in_snapshot.end()) return;
  if (const auto alive = found->second.lock()) alive->resolve();
  in_snapshot.erase(found);
}

void StoreNodes::put_region(RegionPos r, RegionNode* node) {
  before_change(r);
  const openvdb::Coord origin = coord(voxel_from_region(r));
  const openvdb::Coord upper_origin = origin & ~(static_cast<openvdb::Int32>(UpperNode::DIM) - 1);
  auto* upper = tree.root().probeNode<UpperNode>(origin);
  if (!upper) {
    upper = new UpperNode(upper_origin, kAir, false);
    tree.root().addChild(upper);
  }
  upper->addChild(node);
  RegionSlot& slot = regions[r];
  slot.node = node, slot.packed = nullptr, ++slot.edits;
}

void StoreNodes::put_packed(RegionPos r, std::shared_ptr<const PackedRegion> packed) {
  remove_region(r);
  RegionSlot& slot = regions[r];
  slot.node = nullptr, slot.packed = std::move(packed), ++slot.edits;
}

void StoreNodes::remove_region(RegionPos r) {
  const auto found = regions.find(r);
  if (found == regions.end()) return;
  before_change(r);
  if (found->second.node) {
    const openvdb::Coord origin = coord(voxel_from_region(r));
    tree.root().probeNode<UpperNode>(origin)->addTile(UpperNode::LEVEL, origin, kAir, false);
  }
  regions.erase(found);
}

RegionNode* StoreNodes::open_region(RegionPos r) {
  const auto found = regions.find(r);
  if (found == regions.end()) return nullptr;
  ++found->second.edits;
  if (found->second.node) return found->second.node;
  const std::shared_ptr<const PackedRegion> packed = found->second.packed;
  auto* node = new RegionNode(coord(voxel_from_region(r)), kAir, false);
  const LeafPos first = leaf_from_region(r);
  RegionLeaves leaves(*packed);
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const LeafPos l = first + leaf_offset_in_region(i);
    const LeafBlocks blocks = leaves(i);
    if (blocks.values)
      write_leaf(*node, l, blocks.values);
    else if (blocks.uniform != kAir)
      node->addTile(1, coord(voxel_from_leaf(l)), blocks.uniform, true);
  }
  put_region(r, node);
  return node;
}

RegionNode& StoreNodes::make_region(RegionPos r) {
  if (RegionNode* there = open_region(r)) return *there;
  put_region(r, new RegionNode(coord(voxel_from_region(r)), kAir, false));
  return *regions[r].node;
}

bool all_equal(const BlockId* values) {
  // Equal to itself shifted by one value: one memcmp, which the C library vectorises.
  return std::memcmp(values, values + 1, (kLeafVoxels - 1) * sizeof(BlockId)) == 0;
}

void write_leaf(RegionNode& node, LeafPos l, const BlockId* values) {
  const auto n = static_cast<openvdb::Index>(index_in_region(l));
  if (all_equal(values)) {
    node.addTile(1, coord(voxel_from_leaf(l)), values[0], values[0] != kAir);
    return;
  }
  BlockLeaf* leaf;
  if (node.isChildMaskOn(n)) {
    leaf = const_cast<BlockLeaf*>(node.getTable()[n].getChild());
  } else {
    leaf = new BlockLeaf(openvdb::PartialCreate(), coord(voxel_from_leaf(l)), kAir, false);
    leaf->allocate();  // and no value is written twice
    node.addChild(leaf);
  }
  std::memcpy(leaf->buffer().data(), values, kLeafVoxels * sizeof(BlockId));
  const LeafMask occupied = occupied_mask(values);
  BlockLeaf::NodeMaskType active;
  for (openvdb::Index w = 0; w < 8; ++w) active.getWord<uint64_t>(w) = occupied.word[w];
  leaf->setValueMask(active);
}

void initialize_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

}  // namespace world
