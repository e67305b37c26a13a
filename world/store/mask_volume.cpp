#include "world/store/mask_volume.h"

#include <algorithm>

namespace world {

namespace {
constexpr uint64_t kDenseLimit = 1u << 20;
}

void set_region_leaf(MaskRegion& region, LeafPos l, const LeafMask& mask) {
  const int group = leaf_group(l), index = index_in_region(l);
  const uint64_t bit = 1ull << leaf_group_bit(l);
  const bool was_mixed = (region.any[group] & ~region.full[group] & bit) != 0;
  const bool any = !mask.is_none(), full = mask.is_all();
  if (any && !full) {
    if (!was_mixed) {
      if (region.free_slots.empty()) {
        region.slot[index] = static_cast<uint16_t>(region.masks.size());
        region.masks.emplace_back();
      } else {
        region.slot[index] = region.free_slots.back();
        region.free_slots.pop_back();
      }
    }
    region.masks[region.slot[index]] = mask;
  } else if (was_mixed) {
    region.free_slots.push_back(region.slot[index]);
  }
  region.any[group] = any ? region.any[group] | bit : region.any[group] & ~bit;
  region.full[group] = full ? region.full[group] | bit : region.full[group] & ~bit;
  const uint64_t group_bit = 1ull << group;
  region.any_groups = region.any[group] ? region.any_groups | group_bit : region.any_groups & ~group_bit;
}

std::vector<const MaskRegion*> MaskVolume::regions() const {
  std::vector<const MaskRegion*> all;
  all.reserve(regions_.size());
  for (const auto& [pos, region] : regions_) all.push_back(region.get());
  std::sort(all.begin(), all.end(), [](auto* a, auto* b) { return a->pos < b->pos; });
  return all;
}

size_t bytes_of(const MaskRegion& region) {
  return sizeof(MaskRegion) + region.masks.capacity() * sizeof(LeafMask) +
         region.free_slots.capacity() * sizeof(uint16_t);
}

size_t MaskVolume::bytes() const {
  size_t total = dense_.capacity() * sizeof(dense_[0]);
  for (const auto& [pos, region] : regions_) total += bytes_of(*region);
  return total;
}

uint64_t MaskVolume::count() const {
  uint64_t n = 0;
  for (const auto& [pos, region] : regions_) {
    for (int g = 0; g < 64; ++g) n += static_cast<uint64_t>(std::popcount(region->full[g])) * kLeafVoxels;
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LeafPos l = leaf_offset_in_region(i);
      if (region->leaf_any(l) && !region->leaf_full(l)) n += static_cast<uint64_t>(region->leaf(l).count());
    }
  }
  return n;
}

void MaskVolume::set_leaf(LeafPos l, const LeafMask& mask) {
  const RegionPos pos = region_from_leaf(l);
  auto found = regions_.find(pos);
  ++version_;
  if (found == regions_.end()) {
    if (mask.is_none()) return;
    auto region = std::make_unique<MaskRegion>();
    region->pos = pos;
    set_region_leaf(*region, l, mask);
    regions_.emplace(pos, std::move(region));
    finish();
    return;
  }
  set_region_leaf(*found->second, l, mask);
  if (found->second->any_groups == 0) {
    regions_.erase(found);
    finish();
  }
}

void MaskVolume::put_region(RegionPos pos, std::unique_ptr<MaskRegion> region) {
  ++version_;
  if (!region || region->any_groups == 0) {
    regions_.erase(pos);
    return;
  }
  region->pos = pos;
  regions_[pos] = std::move(region);
}

void MaskVolume::finish() {
  dense_.clear();
  min_ = {0, 0, 0}, max_ = {-1, -1, -1};
  if (regions_.empty()) return;
  min_ = max_ = regions_.begin()->first;
  for (const auto& [pos, region] : regions_)
    for (int a = 0; a < 3; ++a) min_[a] = std::min(min_[a], pos[a]), max_[a] = std::max(max_[a], pos[a]);
  uint64_t size[3], volume = 1;
  for (int a = 0; a < 3; ++a) {
    size[a] = static_cast<uint64_t>(int64_t{max_[a]} - min_[a] + 1);
    volume = volume > kDenseLimit ? volume : volume * size[a];
  }
  if (volume > kDenseLimit) return;
  dense_min_ = min_;
  for (int a = 0; a < 3; ++a) dense_size_[a] = static_cast<uint32_t>(size[a]);
  dense_.assign(volume, nullptr);
  for (const auto& [pos, region] : regions_)
    dense_[(size_t(pos.x - min_.x) * dense_size_[1] + size_t(pos.y - min_.y)) * dense_size_[2] +
           size_t(pos.z - min_.z)] = region.get();
}

}  // namespace world
