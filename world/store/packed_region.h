/// A region at rest: 128^3 blocks packed by palette, each voxel still read in O(1).
///
///   leaves   one bit a leaf: mixed or uniform. A mixed leaf's place among the packed ones is its rank in these bits.
///   uniform  the distinct ids of uniform leaves, and as many planes of 4096 bits as number them: none where all are
///   air mixed    8 bytes a leaf: where its words begin, how many distinct blocks it holds, and in how many planes
///   words    by mixed leaf: its palette, four ids a word; then ceil(log2 blocks) planes of 512 bits, in the order of a
///            LeafMask, the planes of one of its words side by side. Bit k of a voxel's place in the palette is its bit
///            in plane k. 512 plain ids where that is smaller.
///
/// Never changes once made, so any number of threads may read it. leaf() unpacks a mixed leaf into plain ids on its
/// first call, on whichever thread comes first, and keeps them until thaw_bytes() are given back by refreeze().
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "world/store/leaf_mask.h"
#include "world/store/store.h"

namespace world {

class PackedRegion {
 public:
  /// `leaf(i)` by index_in_region, asked once each in order; what it gives is valid until it is asked again.
  explicit PackedRegion(const std::function<LeafBlocks(int)>& leaf);
  ~PackedRegion();
  PackedRegion(const PackedRegion&) = delete;
  PackedRegion& operator=(const PackedRegion&) = delete;

  BlockId get(int leaf_index, int voxel_index) const;
  bool is_mixed(int leaf_index) const {
    return mixed_bits_[static_cast<size_t>(leaf_index) >> 6] >> (leaf_index & 63) & 1;
  }
  BlockId uniform_block(int leaf_index) const;  // of a leaf that is not mixed
  size_t mixed_leaves() const { return mixed_.size(); }
  /// Writes the 512 ids of a mixed leaf.
  void unpack(int leaf_index, BlockId* values) const;
  /// The leaf as plain ids, valid until refreeze().
  LeafBlocks leaf(int leaf_index) const;
  /// Bit i: predicate of voxel i's block, from the planes, without unpacking.
  LeafMask mask(int leaf_index, std::span<const uint8_t> bits, int kind) const;
  /// Adds the number of voxels of each block to counts[id]; air too.
  void count(std::span<int64_t> counts) const;
  /// True where every voxel is air.
  bool is_air() const { return mixed_.empty() && uniform_blocks_.size() == 1 && uniform_blocks_[0] == kAir; }

  size_t bytes() const;  // with what is unpacked
  size_t thaw_bytes() const { return thawed_bytes_.load(std::memory_order_relaxed); }
  /// Gives back what leaf() unpacked. Needs exclusive access.
  void refreeze() const;

 private:
  struct MixedLeaf {
    uint32_t at;      // first word in words_
    uint16_t blocks;  // in its palette, 2..512; kPlain: 512 plain ids
    uint16_t planes;
  };
  static constexpr uint16_t kPlain = 0xffff;
  size_t rank(int leaf_index) const;
  void pack_leaf(const BlockId* values);

  std::array<uint64_t, 64> mixed_bits_{};
  std::array<uint16_t, 64> mixed_before_{};  // mixed leaves in the words of mixed_bits_ before this one
  std::vector<BlockId> uniform_blocks_;
  std::vector<uint64_t> uniform_planes_;  // 64 words a plane
  std::vector<MixedLeaf> mixed_;
  std::vector<uint64_t> words_;
  mutable std::atomic<std::atomic<BlockId*>*> thawed_{nullptr};  // by rank; made on the first leaf()
  mutable std::atomic<size_t> thawed_bytes_{0};
};

}  // namespace world
