/// A box of leaves in which light spreads level by level, as masks: what one worker holds. Internal to sim/light.
///
/// A voxel gets level l in the step for l where a neighbour got l + 1 (l + loss) in its own step, and it is still open:
///
///   got[l] = (six neighbours of got[l + 1]) & open        open &= ~got[l]
///
/// so only the front moves, and leaves that it doesn't touch cost nothing. Leaves lie with x fastest, each in 8 words
/// of slices x, so that the neighbours along x are the same words one further, also across leaves. A rim of one leaf
/// surrounds the box.
///
///   got     2 to 16 planes in turn, zero outside of front[l]
///   open    what may still get light; valid where `openable` has the leaf's bit
///   bits    the four bits of the levels got; valid where `touched` has the leaf's bit
///   front   by level and row (y, z): a bit for each leaf along x where got[l] isn't zero
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "world/store/light_volume.h"

namespace sim {

/// Of a box of leaves, the rim included.
struct FloodWindow {
  static constexpr int kMostLeaves = 22;  // along each axis; along x a row's bits fit 32
  static constexpr int kLeafWords = 8;

  /// Takes the shape; nothing is open, and nothing got light.
  void begin(int leaves_x, int leaves_y, int leaves_z);
  /// Before any light: the largest loss of a voxel in it, 1 to 15.
  void set_most_loss(int most_loss);
  /// Zeroes what the fronts left, so that begin() finds it so.
  void end();

  int row(int y, int z) const { return z * size[1] + y; }
  size_t leaf(int x, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(size[0]) + static_cast<size_t>(x);
  }
  uint64_t* got(int level) { return planes[static_cast<size_t>(level) % plane_count][kGuard].word; }
  uint64_t* open_of(size_t leaf) { return open[leaf].word; }
  uint64_t* bits_of(size_t leaf) { return bits[leaf * 4].word; }
  uint32_t* front_of(int level) { return front.data() + static_cast<size_t>(level) * static_cast<size_t>(rows); }

  /// Gives voxels of a leaf of the box level l: for sources, the sky and slow voxels.
  void give(int x, int row, int level, const uint64_t* voxels);
  /// The same without a front.
  void mark(int x, int row, int level, const uint64_t* voxels);
  /// Voxels of a leaf that got no light so far.
  uint64_t dark(int x, int row, int slice);
  /// Puts voxels into a front that don't belong to what is lit: the fixed light around it.
  void inject(int x, int row, int level, const uint64_t* voxels);
  /// The six neighbours of got[level] for one leaf.
  void gather(int x, int row, int level, uint64_t* into);
  bool any_front(int level) const { return moving >> level & 1; }
  bool near_front(int x, int row, int level) {
    const uint32_t* f = front_of(level) + row;
    return ((f[0] | f[0] << 1 | f[0] >> 1 | f[-1] | f[1] | f[-size[1]] | f[size[1]]) >> x & 1) != 0;
  }
  /// Makes the plane of `level` ready: what it held plane_count levels before is zeroed.
  void clear_plane_for(int level);

  int size[3] = {0, 0, 0};  // in leaves, the rim included
  int rows = 0;
  uint32_t moving = 0;  // bit l: some leaf's bit is set in front[l]
  size_t plane_count = 2;
  std::array<std::vector<world::LeafMask>, 16> planes;
  std::vector<world::LeafMask> open, bits;
  std::vector<uint32_t> openable, touched, front;  // by row; front by level and row

  static constexpr size_t kGuard = 1;  // leaves before and behind a plane
 private:
  void zero_front(int level);
};

/// One step: got[level] from got[level + 1], for voxels that lose one level; clear_plane_for(level) came before.
/// cost  7 loads, 30 operations and 4 stores a leaf that the front touches, with AVX-512
void spread_level(FloodWindow& window, int level);

/// The levels of a leaf from its bits; -1, or the level of all of it.
int pack_leaf(const uint64_t* bits, world::LightLeaf& into);

}  // namespace sim
