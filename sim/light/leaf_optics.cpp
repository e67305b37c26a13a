#include "sim/light/leaf_optics.h"

#include <algorithm>
#include <cstring>
#include <unordered_map>

#include "world/base/jobs.h"

namespace sim {

using world::BlockId;
using world::kLeafVoxels;
using world::LeafBlocks;
using world::LeafMask;
using world::LeafPos;
using world::MaskKind;
using world::RegionPos;

namespace {

/// Whether 64 blocks are the eight of a row, eight times.
bool repeats(const BlockId* blocks, const BlockId* row) {
  uint64_t of_row[2], of_blocks[16], differing = 0;
  std::memcpy(of_row, row, sizeof of_row);
  std::memcpy(of_blocks, blocks, sizeof of_blocks);
  for (int i = 0; i < 16; ++i) differing |= of_blocks[i] ^ of_row[i % 2];
  return differing == 0;
}

}  // namespace

OpticsVolume::OpticsVolume(const world::Store& store, std::span<const BlockOptics> by_block)
    : store_(&store), opaque_(&store.masks(MaskKind::opaque)) {
  set_blocks(by_block);
  // Regions whose census has blocks that need entries.
  std::vector<RegionPos> some;
  std::vector<std::vector<BlockId>> others;
  for (const RegionPos& r : store.regions()) {
    std::vector<BlockId> found;
    for (const auto& [block, count] : store.region_census(r))
      if (!plain_[block]) found.push_back(block);
    if (!found.empty()) some.push_back(r), others.push_back(std::move(found));
  }
  std::vector<Region> built(some.size());
  world::parallel_for(some.size(), [&](size_t i) { read_region(some[i], others[i], built[i]); });
  for (size_t i = 0; i < some.size(); ++i)
    if (!built[i].entries.empty()) regions_.insert_later(some[i]) = std::move(built[i]);
  regions_.finish();
}

void OpticsVolume::set_blocks(std::span<const BlockOptics> by_block) {
  by_block_.assign(by_block.begin(), by_block.end());
  plain_.resize(by_block.size());
  most_loss_ = 1;
  for (size_t id = 0; id < by_block.size(); ++id) {
    const BlockOptics& optics = by_block[id];
    const bool opaque = store_->palette()[static_cast<BlockId>(id)].opaque;
    plain_[id] = optics.level == 0 && (opaque ? optics.loss == 0 : optics.loss == 1 && optics.passes_sky);
    most_loss_ = std::max<int>(most_loss_, optics.loss);
  }
}

bool OpticsVolume::surely_plain(const LeafBlocks& leaf, std::span<const BlockId> others) const {
  if (!leaf.values) return plain_[leaf.uniform];
  if (others.size() > 16) return false;
  // A few comparisons for many voxels at a time beat a look at each one.
  uint16_t found = 0;
  for (const BlockId other : others)
    for (int i = 0; i < kLeafVoxels; ++i) found |= static_cast<uint16_t>(leaf.values[i] == other);
  return !found;
}

std::unique_ptr<OpticsVolume::Entry> OpticsVolume::entry_of(LeafPos l, const LeafBlocks& leaf) const {
  std::unique_ptr<Entry> entry;
  const auto mask_of = [](std::vector<NumberedMask>& list, uint8_t number) -> LeafMask& {
    for (NumberedMask& m : list)
      if (m.number == number) return m.mask;
    list.push_back({number, {}});
    return list.back().mask;
  };
  // The opaque mask is right but where blocks aren't plain. Most slices are one row of eight once and again.
  const BlockId* plain_row = nullptr;
  for (int i = 0; i < kLeafVoxels; ++i) {
    if (const BlockId* b = leaf.values ? leaf.values + i : nullptr; b && i % 8 == 0) {
      if (plain_row && i % 64 == 0 && repeats(b, plain_row)) {
        i += 63;
        continue;
      }
      const int all = plain_[b[0]] & plain_[b[1]] & plain_[b[2]] & plain_[b[3]] & plain_[b[4]] & plain_[b[5]] &
                      plain_[b[6]] & plain_[b[7]];
      if (all) {
        plain_row = b;
        i += 7;
        continue;
      }
    }
    if (plain_[leaf[i]]) continue;
    if (!entry) {
      entry = std::make_unique<Entry>();
      entry->closed = entry->stops_sky = opaque_->leaf(l);
    }
    const BlockOptics& optics = by_block_[leaf[i]];
    optics.loss == 0 ? entry->closed.set(i) : entry->closed.clear(i);
    optics.passes_sky ? entry->stops_sky.clear(i) : entry->stops_sky.set(i);
    if (optics.loss > 1) mask_of(entry->slow, optics.loss).set(i);
    if (optics.level > 0) mask_of(entry->sources, optics.level).set(i);
  }
  return entry;
}

void OpticsVolume::set_entry(Region& region, int index, std::unique_ptr<Entry> entry) {
  uint16_t& place = region.place[static_cast<size_t>(index)];
  if (place && !region.entries[place - 1u]->sources.empty()) --region.leaves_with_sources;
  if (entry && !entry->sources.empty()) ++region.leaves_with_sources;
  if (!entry) {
    if (place == 0) return;
    region.entries[place - 1u].reset();
    region.free.push_back(place);
    place = 0;
    return;
  }
  if (place == 0) {
    if (region.free.empty()) {
      region.entries.emplace_back();
      place = static_cast<uint16_t>(region.entries.size());
    } else {
      place = region.free.back();
      region.free.pop_back();
    }
  }
  region.entries[place - 1u] = std::move(entry);
}

void OpticsVolume::read_region(RegionPos r, std::span<const BlockId> others, Region& into) const {
  world::StoreReader reader(*store_);
  const world::MaskRegion* opaque = opaque_->region(r);
  const bool opaque_too =
      std::any_of(others.begin(), others.end(), [&](BlockId b) { return store_->palette()[b].opaque; });
  const LeafPos low = world::leaf_from_region(r);
  for (int i = 0; i < world::kLeavesPerRegion; ++i) {
    const LeafPos l = low + world::leaf_offset_in_region(i);
    if (!opaque_too && opaque && opaque->leaf_full(l)) continue;
    const LeafBlocks leaf = reader.leaf(l);
    if (!surely_plain(leaf, others)) set_entry(into, i, entry_of(l, leaf));
  }
}

std::vector<RegionPos> OpticsVolume::regions_with_sources() const {
  std::vector<RegionPos> some;
  for (const RegionPos& r : regions_.positions())
    if (has_sources(r)) some.push_back(r);
  return some;
}

void OpticsVolume::update(std::span<const LeafPos> changed) {
  // Of many leaves most lie in regions whose census says that none needs an entry.
  constexpr size_t kMany = 16;
  std::unordered_map<RegionPos, bool, world::PosHash> plain_regions;
  const auto is_plain_region = [&](RegionPos r) {
    const auto [known, added] = plain_regions.try_emplace(r, false);
    if (added) {
      const world::Census census = store_->region_census(r);
      known->second =
          std::all_of(census.begin(), census.end(), [&](const auto& row) { return plain_[row.first] != 0; });
    }
    return known->second;
  };
  for (const LeafPos& l : changed) {
    const RegionPos r = world::region_from_leaf(l);
    Region* region = regions_.find(r);
    if (!region && changed.size() >= kMany && is_plain_region(r)) continue;
    const LeafBlocks leaf = store_->leaf(l);
    std::unique_ptr<Entry> entry = !leaf.values && plain_[leaf.uniform] ? nullptr : entry_of(l, leaf);
    if (!entry && !region) continue;
    if (!region) region = &regions_.insert(r);
    set_entry(*region, world::index_in_region(l), std::move(entry));
    if (region->free.size() == region->entries.size()) regions_.erase(r);
  }
}

size_t OpticsVolume::bytes() const {
  size_t total = regions_.bytes() + by_block_.capacity() * sizeof(BlockOptics) + plain_.capacity();
  for (const RegionPos& r : regions_.positions()) {
    const Region& region = *regions_.find(r);
    total += sizeof region + region.place.capacity() * 2 + region.entries.capacity() * sizeof(void*);
    for (const auto& entry : region.entries)
      if (entry) total += sizeof *entry + (entry->slow.capacity() + entry->sources.capacity()) * sizeof(NumberedMask);
  }
  return total;
}

}  // namespace sim
