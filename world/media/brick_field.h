/// A density as bricks of samples: what a world's density layer and .vol files become, so that rays sample them fast.
///
/// A sample is a voxel's value at its centre. A brick answers for 8^3 cells; where sampling is trilinear a cell is the
/// cube between eight centres, so cells are shifted by half a voxel and a brick holds 9^3 samples, its neighbours'
/// first layers among them:
///   brick   [9][9][9] float, x slowest (trilinear), [8][8][8] (nearest); and the largest of them
///   region  16^3 numbers of bricks, kNone where all densities are 0; and the largest of them
/// so one look-up finds all that a point needs. 2.9 KiB (trilinear) a brick that holds anything.
///
/// Along a ray a cell's density is a polynomial of degree 3 (trilinear) or 0, which Gauss's rule of two points
/// integrates exactly: depth() has no error but rounding.
#pragma once

#include <array>
#include <unordered_map>
#include <vector>

#include "world/media/medium.h"

namespace world {

class BrickField final : public DensityField {
 public:
  /// Each leaf at most once. Fails where a value is negative or not finite (`name` says whose it is), or where there
  /// are more than kMostBricks.
  static Result<std::shared_ptr<const BrickField>> make(std::vector<FieldLeaf> leaves, FieldSampling sampling,
                                                        const std::string& name);
  static constexpr size_t kMostBricks = size_t{1} << 21;  // 6 GiB

  float density(const Vec3d& voxels) const override;
  float max() const override { return largest_; }
  void bounds(Vec3d& low, Vec3d& high) const override { low = low_, high = high_; }
  double depth(const Vec3d& origin, const Vec3d& direction, double t0, double t1) const override;
  double reach(const Vec3d& origin, const Vec3d& direction, double t0, double t1, double depth) const override;
  void pieces(const Vec3d& origin, const Vec3d& direction, double t0, double t1,
              FunctionRef<bool(double end, double largest)> visit) const override;
  size_t bytes() const override;
  void for_each_leaf(FunctionRef<void(const FieldLeaf&)> visit) const override;
  size_t bricks() const { return largest_of_.size(); }

 private:
  static constexpr uint32_t kNone = 0xffffffffu;
  struct Region {
    std::array<uint32_t, kLeavesPerRegion> bricks;
    float largest = 0;
  };
  BrickField() = default;
  void make_table();
  const Region* region(RegionPos r) const;
  uint32_t brick(LeafPos l) const;
  class Cell;
  /// visit(brick or kNone, t_begin, t_end) for the bricks that the line passes in [t0, t1], which lies in the bounds.
  template <class Visit>
  void walk_bricks(const Vec3d& origin, const Vec3d& direction, double t0, double t1, Visit visit) const;
  /// visit(t_begin, t_end, density_at(t)) for the cells of one brick, until it returns false.
  template <class Visit>
  bool walk_cells(uint32_t brick, const Vec3d& origin, const Vec3d& direction, double t0, double t1, Visit visit) const;
  /// [t0, t1] within the bounds; empty where the line misses them.
  MediumInterval clipped(const Vec3d& origin, const Vec3d& direction, double t0, double t1) const;

  bool trilinear_ = true;
  int edge_ = 9;        // samples along a brick
  double shift_ = 0.5;  // of cells against voxels
  Vec3d low_{0}, high_{0};
  float largest_ = 0;
  std::vector<float> samples_;
  std::vector<float> largest_of_;  // by brick
  std::vector<Region> regions_;
  std::unordered_map<RegionPos, uint32_t, PosHash> region_numbers_;
  // The same as a table over the box of all regions, where that is small: a look-up without a hash.
  static constexpr uint64_t kMostTableEntries = 1 << 18;
  RegionPos table_min_, table_size_;
  std::vector<uint32_t> region_table_;
};

/// Mitsuba's grid volume, version 3: "VOL", 3, 1 (float), x, y, z, channels (1), a box of 6 floats that is passed over,
/// then x * y * z floats, x fastest. Voxel (0, 0, 0) is the field's. The outermost voxels are repeated `extend` times.
Result<std::shared_ptr<const BrickField>> read_vol_file(const std::filesystem::path& path, FieldSampling sampling,
                                                        int extend);

}  // namespace world
