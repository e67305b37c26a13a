/// What many rays walk at once: one bit a voxel in words of 4x2x4, derived from a MaskVolume, leaf by leaf.
///
///   a code for each leaf within the bounds -> 16 words of 32 bits for each mixed leaf
///
/// A code says in one load how far a ray may go from anywhere in the leaf:
///   side | column      the leaf is empty; so is the aligned cube around it of which this is the side less 1 (7, 15, ..
///                      127), and, where column isn't 0, all above the leaf's bottom in the aligned square column of
///                      that side (less 1, shifted by kColumnShift; at least as wide as the cube): most rays upwards
///                      meet only air
///   kMixed | first     index of the leaf's first word, a multiple of 16; full leaves share words of ones
///     | kCapped | h    and, where all above the leaf is empty, the first of its rows of y that nothing is set in or
///     above
/// so a column of air, an empty cube, half brick (4x2x4: terrain is flatter than it is wide) or 2^3 is passed in one
/// step, and no level is descended again.
///
/// bytes  64 a mixed leaf of 512 voxels, 4 a leaf of the bounds and 3 a column of them
/// cost   update(): under 1 us a leaf; up to 5 us where 128^3 voxels cease to be empty (measured 2026-11-25)
#pragma once

#include <vector>

#include "world/store/mask_volume.h"

namespace world {

class BrickVolume {
 public:
  static constexpr uint32_t kMixed = 0x80000000u, kFirstWord = 0x7ffffff0u;
  /// Of the code of an empty leaf.
  static constexpr uint32_t kSide = 127;
  static constexpr int kColumnShift = 7;
  static constexpr uint32_t kCapped = 8, kCap = 15;  // of the code of a mixed leaf
  static constexpr int kWordsPerLeaf = 16;
  /// Voxel in its word of 4x2x4, and word in its leaf.
  static constexpr int bit_in_word(VoxelPos v) { return (v.x & 3) << 3 | (v.y & 1) << 2 | (v.z & 3); }
  static constexpr int word_in_leaf(VoxelPos v) { return (v.x & 4) << 1 | (v.y & 6) | (v.z >> 2 & 1); }
  /// kWordsPerLeaf words of a leaf.
  static void leaf_words(const LeafMask& mask, uint32_t* words);

  BrickVolume() = default;
  /// Reads all regions, on all threads.
  explicit BrickVolume(const MaskVolume& volume);
  /// After the leaf changed in `volume`. Where it lies outside the bounds everything is built anew.
  void update(const MaskVolume& volume, LeafPos leaf);

  /// No voxel is set, or the bounds are so wide for what they hold that codes would cost more than masks: rays must
  /// walk the MaskVolume.
  bool walkable() const { return !codes_.empty(); }
  size_t bytes() const;
  size_t mixed_leaves() const { return mixed_leaves_; }

  /// Corner of the bounds, and leaves along each axis.
  VoxelPos low() const { return voxel_from_leaf(low_); }
  const int32_t* leaves_along() const { return size_; }
  /// Voxels of the leaves that hold anything: exact after building, then only growing.
  const VoxelBox& content() const { return content_; }

  /// By (x * size.z + z) * size.y + y.
  const uint32_t* codes() const { return codes_.data(); }
  const uint32_t* words() const { return words_.data(); }

  uint32_t code(LeafPos leaf) const { return codes_[index(leaf)]; }  // within the bounds
  bool test(VoxelPos v) const;

 private:
  size_t index(LeafPos l) const {
    return (size_t(l.x - low_.x) * size_t(size_[2]) + size_t(l.z - low_.z)) * size_t(size_[1]) + size_t(l.y - low_.y);
  }
  bool inside(LeafPos l) const;
  /// Place of the area of (1 << level)^2 columns of leaves in tops_[level]; by leaves from the corner of the bounds.
  size_t area(int level, int32_t x, int32_t z) const {
    return size_t(x >> level) * size_t(size_[2] >> level) + size_t(z >> level);
  }
  uint32_t with_column(uint32_t side, LeafPos from_corner) const;
  void find_tops();
  void update_tops(LeafPos from_corner, bool empty);
  void set_cap(uint32_t& code) const;

  static constexpr int kLevels = 5;  // areas of 8 to 128 voxels a side
  std::vector<uint32_t> codes_, words_, free_words_;
  std::vector<int16_t> tops_[kLevels];  // highest leaf that isn't empty, from the corner of the bounds; -1: none
  LeafPos low_{0, 0, 0};
  int32_t size_[3] = {0, 0, 0};
  VoxelBox content_;
  size_t mixed_leaves_ = 0;
};

}  // namespace world
