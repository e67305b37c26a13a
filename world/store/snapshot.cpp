#include "world/store/snapshot.h"

#include "world/store/leaf_masks.h"
#include "world/store/tree.h"

namespace world {

RegionPos StoreSnapshot::pos(size_t i) const { return regions_[i]->pos; }
const Census& StoreSnapshot::census(size_t i) const { return regions_[i]->census; }
std::shared_ptr<const PackedRegion> StoreSnapshot::packed(size_t i) const { return regions_[i]->resolve(); }

void StoreSnapshot::release(size_t i) {
  const std::shared_ptr<Region> region = regions_[i];
  const std::lock_guard lock(region->mutex);
  region->node = nullptr;
  region->packed.reset();
}

PreparedRegion::PreparedRegion(const RegionBuilder& region, const BlockPalette& palette, unsigned mask_kinds)
    : pos_(region.pos()), mask_kinds_(mask_kinds) {
  const RegionSlot slot{.node = nullptr,
                        .packed = std::make_shared<PackedRegion>([&](int i) { return region.leaf(i); })};
  RegionCensus census;
  count_region(slot, palette.size(), census);
  counts_ = std::move(census.counts);
  for (int k = 0; k < kMaskKinds; ++k)
    if (mask_kinds >> k & 1) masks_[k] = build_mask_region(slot, pos_, palette.masks(), k);
  packed_ = slot.packed;
}
PreparedRegion::PreparedRegion(PreparedRegion&&) noexcept = default;
PreparedRegion& PreparedRegion::operator=(PreparedRegion&&) noexcept = default;
PreparedRegion::~PreparedRegion() = default;

size_t PreparedRegion::bytes() const {
  size_t total = packed_->bytes();
  for (const auto& masks : masks_)
    if (masks) total += bytes_of(*masks);
  return total;
}

Census PreparedRegion::census() const {
  Census all;
  for (const auto& [block, n] : counts_) all[block] = static_cast<uint64_t>(n);
  return all;
}

}  // namespace world
