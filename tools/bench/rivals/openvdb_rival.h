/// OpenVDB's own ways to the same voxels, as the rows of the store are held against: its value accessor and its leaf
/// manager, on a copy of the store's tree.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "world/store/store.h"

namespace tools {

class OpenVdbRival {
 public:
  explicit OpenVdbRival(const world::Store& store);
  ~OpenVdbRival();
  /// The sum of the ids at the positions, through one accessor.
  uint64_t sum(std::span<const world::VoxelPos> positions) const;
  /// The sum of all ids in leaf buffers, through a leaf manager, on this thread.
  uint64_t sum_of_leaves() const;
  /// Writes one voxel after the other through one accessor.
  void set(std::span<const world::VoxelPos> positions, world::BlockId block);
  /// Fills boxes with Tree::fill.
  void fill(std::span<const world::VoxelBox> boxes, world::BlockId block);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tools
