/// Regions of a store as they were at one moment, for a save that is written while editing goes on.
///
/// Taking one costs a list of positions. A region is copied, packed, by whoever comes first: the writer that asks for
/// it, on its own thread, or the edit that is about to change it.
#pragma once

#include <memory>
#include <vector>

#include "world/store/packed_region.h"

namespace world {

class StoreSnapshot {
 public:
  struct Region;  // world/store/tree.h

  size_t size() const { return regions_.size(); }
  RegionPos pos(size_t i) const;
  const Census& census(size_t i) const;
  /// On any thread, while one other thread edits the store. Null where the region held only air.
  std::shared_ptr<const PackedRegion> packed(size_t i) const;
  /// Lets go of the copy of a region; packed(i) must not be called again.
  void release(size_t i);

 private:
  friend class Store;
  std::vector<std::shared_ptr<Region>> regions_;
};

/// A region read or generated and made ready on any thread, so that joining a store takes microseconds.
class PreparedRegion {
 public:
  /// Packs and counts the region, and derives the masks whose bit (1 << kind) is set in `mask_kinds`.
  PreparedRegion(const RegionBuilder& region, const BlockPalette& palette, unsigned mask_kinds);
  PreparedRegion(PreparedRegion&&) noexcept;
  PreparedRegion& operator=(PreparedRegion&&) noexcept;
  ~PreparedRegion();

  RegionPos pos() const { return pos_; }
  size_t bytes() const;  // of blocks and masks, as the store will hold them
  const PackedRegion& packed() const { return *packed_; }
  Census census() const;

 private:
  friend class Store;
  RegionPos pos_;
  std::shared_ptr<const PackedRegion> packed_;
  std::vector<std::pair<BlockId, int64_t>> counts_;
  unsigned mask_kinds_;
  std::unique_ptr<MaskRegion> masks_[kMaskKinds];
};

}  // namespace world
