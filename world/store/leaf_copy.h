/// Reads leaves one by one and leaves nothing unpacked in packed regions: for who reads much of a world once.
#pragma once

#include <memory>
#include <span>

#include "world/store/store.h"

namespace world {

/// For one thread, while nobody edits.
class LeafCopies {
 public:
  explicit LeafCopies(const Store& store);
  ~LeafCopies();
  /// What `room` holds the ids of, where the region is packed; else the store's own, valid until the next edit.
  LeafBlocks leaf(LeafPos l, std::span<BlockId, kLeafVoxels> room);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace world
