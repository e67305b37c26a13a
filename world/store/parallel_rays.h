/// Rays that all run in one direction, such as those to the sun: whether anything is set between each start and
/// infinity.
///
/// Seen along the direction each ray is a point. Over that plane lies a height map, one cell a voxel's side: the last
/// slab across the direction's main axis in which anything is set that a ray of the cell might meet. A ray that starts
/// behind it is free, for the price of one look; of the others those slabs are tested, from the last one back to the
/// start, so that a ray in shadow usually ends at its first. What is closer to a voxel's edge than floats can tell is
/// walked anew in double, so answers are those of RayStream::any_set for every ray.
///
///   blocks of 64 x 64 cells, made where rays first ask for them -> 2 x 16 bits a cell
///
/// error  none: the map is conservative by kMargin of a voxel, slabs are tested with a bound on their rounding
/// cost   on one core with AVX2, over the valley: see tools/bench/suites/rays.cpp, rows `shadow`
/// source Lance Williams. Casting Curved Shadows on Curved Surfaces. 1978 (a map seen from the light), here of bounds
///        instead of samples
#pragma once

#include <atomic>
#include <memory>
#include <span>

#include "world/store/ray_stream.h"

namespace world {

class ParallelRays {
 public:
  /// Of the volume of `stream`, which must outlive this. Direction: any length, not zero.
  ParallelRays(const RayStream& stream, const Vec3d& direction);
  ~ParallelRays();
  ParallelRays(const ParallelRays&) = delete;
  ParallelRays& operator=(const ParallelRays&) = delete;

  /// After stream.update(dirty).
  void update(std::span<const LeafPos> dirty);

  /// blocked[i]: 1 where anything is set on rays[i], its start's voxel included, else 0. Right for rays of any
  /// direction and t_max, fast for those of this direction to infinity. May run on all threads at once.
  void any_set(std::span<const GridRay> rays, std::span<uint8_t> blocked, StreamReport* report = nullptr) const;
  void any_set(std::span<const StreamRay> rays, std::span<uint8_t> blocked, StreamReport* report = nullptr) const;

  const Vec3d& direction() const { return direction_; }
  size_t bytes() const;

  /// Of the rays of a cell: those that start in slab `end` or behind it are free, those that start before slab `shut`
  /// are blocked.
  struct Cell {
    uint16_t end, shut;
  };
  static constexpr int kBlockCells = 64;
  struct Block {
    alignas(64) Cell cell[kBlockCells * kBlockCells];  // in tiles of 8 x 8
    uint64_t version = 0;                              // another one whenever it is made anew
  };
  static constexpr int cell_in_block(int32_t u, int32_t v) {
    return (u & 56) << 6 | (v & 56) << 3 | (u & 7) << 3 | (v & 7);
  }

  /// Where the map lies. Axes: main, u, v; cells of the bounds count from their corner, k along the main axis in the
  /// direction of the rays. A ray through (k, u, v) lies at (u - slope_u k, v - slope_v k) + shift.
  struct Frame {
    int axis[3];
    bool down;           // the rays go down the main axis
    float direction[3];  // x, y, z
    double slope[2];
    VoxelPos low;     // corner of the bounds
    int32_t size[3];  // voxels of the bounds: main, u, v
    int32_t shift[2];
    int32_t blocks[2];
  };

  /// For who keeps a copy of the map: whether there is one, where it lies, and a block of it, of frame().blocks, which
  /// lives until the next update(). Another version whenever anything of it may have changed.
  bool has_map() const { return block_count_ != 0; }
  const Frame& frame() const { return frame_; }
  const Block& block(int32_t u, int32_t v) const;
  uint64_t version() const { return version_; }

 private:
  friend struct ParallelRaysKernel;
  void frame_bounds();
  void fill(Block& block, int32_t u, int32_t v) const;
  template <class Ray>
  void cast(std::span<const Ray> rays, std::span<uint8_t> blocked, StreamReport* report) const;

  const RayStream* stream_;
  Vec3d direction_;
  Frame frame_{};
  uint64_t version_ = 0;
  size_t block_count_ = 0;  // 0: the bounds are too large or the direction unusable: the stream casts all
  std::unique_ptr<std::atomic<Block*>[]> blocks_;
};

}  // namespace world
