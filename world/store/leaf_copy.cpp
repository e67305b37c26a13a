#include "world/store/leaf_copy.h"

#include "world/store/packed_region.h"
#include "world/store/tree.h"

namespace world {

struct LeafCopies::Impl {
  const StoreNodes* nodes;
  RegionPos pos{INT32_MAX, 0, 0};  // last looked at
  const RegionSlot* slot = nullptr;
};

LeafCopies::LeafCopies(const Store& store) : impl_(std::make_unique<Impl>()) { impl_->nodes = &store.nodes(); }
LeafCopies::~LeafCopies() = default;

LeafBlocks LeafCopies::leaf(LeafPos l, std::span<BlockId, kLeafVoxels> room) {
  if (const RegionPos r = region_from_leaf(l); r != impl_->pos) {
    const auto found = impl_->nodes->regions.find(r);
    impl_->slot = found == impl_->nodes->regions.end() ? nullptr : &found->second;
    impl_->pos = r;
  }
  if (!impl_->slot) return {};
  const int index = index_in_region(l);
  if (impl_->slot->node) return leaf_of(*impl_->slot->node, index);
  const PackedRegion& packed = *impl_->slot->packed;
  if (!packed.is_mixed(index)) return {nullptr, packed.uniform_block(index)};
  packed.unpack(index, room.data());
  return {room.data(), kAir};
}

}  // namespace world
