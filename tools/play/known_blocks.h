/// The blocks of a store as someone last knew them, so that what changed since can be told voxel by voxel.
#pragma once

#include <array>
#include <unordered_map>

#include "world/store/snapshot.h"
#include "world/store/store.h"

namespace tools {

class KnownBlocks {
 public:
  using Blocks = std::array<world::BlockId, world::kLeafVoxels>;

  /// Knows all as it is now.
  explicit KnownBlocks(const world::Store& store);
  /// In `scratch` where the leaf hasn't been learnt since.
  const Blocks& leaf(world::LeafPos l, Blocks& scratch) const;
  void learn(world::LeafPos l, const Blocks& blocks) { learnt_[l] = blocks; }
  size_t bytes() const { return learnt_.size() * (sizeof(Blocks) + sizeof(world::LeafPos)); }

 private:
  world::StoreSnapshot base_;  // the world at first; a region costs memory once it is changed
  std::unordered_map<world::RegionPos, size_t, world::PosHash> base_index_;
  std::unordered_map<world::LeafPos, Blocks, world::PosHash> learnt_;
};

}  // namespace tools
