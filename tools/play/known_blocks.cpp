#include "tools/play/known_blocks.h"

#include <memory>
#include <vector>

namespace tools {

KnownBlocks::KnownBlocks(const world::Store& store) {
  const std::vector<world::RegionPos> regions = store.regions();
  base_ = store.snapshot(regions);
  for (size_t i = 0; i < regions.size(); ++i) base_index_[base_.pos(i)] = i;
}

const KnownBlocks::Blocks& KnownBlocks::leaf(world::LeafPos l, Blocks& scratch) const {
  if (const auto found = learnt_.find(l); found != learnt_.end()) return found->second;
  scratch.fill(world::kAir);
  const auto region = base_index_.find(world::region_from_leaf(l));
  if (region == base_index_.end()) return scratch;
  const std::shared_ptr<const world::PackedRegion> packed = base_.packed(region->second);
  if (!packed) return scratch;
  const int at = world::index_in_region(l);
  if (packed->is_mixed(at))
    packed->unpack(at, scratch.data());
  else
    scratch.fill(packed->uniform_block(at));
  return scratch;
}

}  // namespace tools
