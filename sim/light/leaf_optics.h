/// What each leaf of a store does to light in one band, as masks: what the flood walks.
///
/// A leaf of air, opaque voxels that give no light, and whatever passes light as air does needs no more than its opaque
/// mask, which the store keeps. Only leaves with anything else (water, glass, lamps) hold an entry here.
///
/// bytes  150 to 400 a leaf that has an entry; 8 KiB a region that has any
/// cost   update(): under 1 us a leaf
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim/light/optics.h"
#include "world/store/region_table.h"
#include "world/store/store.h"

namespace sim {

/// Voxels of a leaf that share a number: a loss, or a level.
struct NumberedMask {
  uint8_t number = 0;
  world::LeafMask mask;
};

struct LeafOptics {
  const world::LeafMask* closed = &world::kNoneMask;     // no light enters
  const world::LeafMask* stops_sky = &world::kNoneMask;  // the sky's light doesn't go straight down through; has closed
  std::span<const NumberedMask> slow;                    // by loss, where it is above 1
  std::span<const NumberedMask> sources;                 // by level given, above 0
  bool like_air() const { return closed == &world::kNoneMask && stops_sky == &world::kNoneMask && sources.empty(); }
};

class OpticsVolume {
  struct Entry {
    world::LeafMask closed, stops_sky;
    std::vector<NumberedMask> slow, sources;
  };
  struct Region {
    std::vector<uint16_t> place = std::vector<uint16_t>(world::kLeavesPerRegion, 0);  // 0: none, else 1 + entry
    std::vector<std::unique_ptr<Entry>> entries;
    std::vector<uint16_t> free;
    int leaves_with_sources = 0;
  };

 public:
  /// Reads the whole store, on all threads. `by_block` must have an entry for each block that the store holds.
  OpticsVolume(const world::Store& store, std::span<const BlockOptics> by_block);

  /// Of a region, for many leaves. All valid until the next edit of the store.
  class RegionOptics {
   public:
    RegionOptics() = default;
    LeafOptics leaf(world::LeafPos l) const {
      if (entries_)
        if (const uint16_t place = entries_->place[static_cast<size_t>(world::index_in_region(l))]) {
          const Entry& entry = *entries_->entries[place - 1u];
          return {&entry.closed, &entry.stops_sky, entry.slow, entry.sources};
        }
      const world::LeafMask* opaque = opaque_ ? &opaque_->leaf(l) : &world::kNoneMask;
      return {opaque, opaque, {}, {}};
    }
    bool like_air() const { return !entries_ && !opaque_; }
    /// What most leaves are, at the price of two bits.
    enum class Kind { clear, closed, mixed };
    Kind kind(world::LeafPos l) const {
      if (entries_ && entries_->place[static_cast<size_t>(world::index_in_region(l))]) return Kind::mixed;
      if (!opaque_ || !opaque_->leaf_any(l)) return Kind::clear;
      return opaque_->leaf_full(l) ? Kind::closed : Kind::mixed;
    }

   private:
    friend class OpticsVolume;
    const Region* entries_ = nullptr;
    const world::MaskRegion* opaque_ = nullptr;
  };
  RegionOptics region(world::RegionPos r) const {
    RegionOptics optics;
    optics.entries_ = regions_.find(r);
    optics.opaque_ = opaque_->region(r);
    return optics;
  }
  LeafOptics leaf(world::LeafPos l) const { return region(world::region_from_leaf(l)).leaf(l); }
  /// Regions with sources, sorted.
  std::vector<world::RegionPos> regions_with_sources() const;
  /// Calls visit(LeafPos, LeafOptics) for each leaf of the region in which something gives light.
  template <class Visit>
  void for_each_source_leaf(world::RegionPos r, Visit visit) const {
    const RegionOptics optics = region(r);
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      if (!optics.entries_->place[static_cast<size_t>(i)]) continue;
      const world::LeafPos l = world::leaf_from_region(r) + world::leaf_offset_in_region(i);
      if (const LeafOptics leaf = optics.leaf(l); !leaf.sources.empty()) visit(l, leaf);
    }
  }
  /// Whether any voxel of the region gives light.
  bool has_sources(world::RegionPos r) const {
    const Region* region = regions_.find(r);
    return region && region->leaves_with_sources > 0;
  }

  /// After leaves changed in the store.
  void update(std::span<const world::LeafPos> changed);
  /// Where the palette has grown: the same for blocks that were there.
  void set_blocks(std::span<const BlockOptics> by_block);
  /// The largest loss of any block.
  int most_loss() const { return most_loss_; }
  size_t bytes() const;

 private:
  /// Whether all blocks of the leaf are plain, where those that aren't are among `others`; false may be wrong.
  bool surely_plain(const world::LeafBlocks& leaf, std::span<const world::BlockId> others) const;
  /// Null where all blocks are plain.
  std::unique_ptr<Entry> entry_of(world::LeafPos l, const world::LeafBlocks& leaf) const;
  /// `others`: blocks of the region that aren't plain.
  void read_region(world::RegionPos r, std::span<const world::BlockId> others, Region& into) const;
  static void set_entry(Region& region, int index, std::unique_ptr<Entry> entry);

  const world::Store* store_;
  const world::MaskVolume* opaque_;
  std::vector<BlockOptics> by_block_;
  std::vector<uint8_t> plain_;  // by id: the opaque mask says all of it
  int most_loss_ = 1;
  world::RegionTable<Region> regions_;
};

}  // namespace sim
