/// The ladder "precision of the grid walk": the same ray walked in exact integers, in double as FlatWalk does, and by
/// the cheaper rules that other programs use. For measuring and for tests; nothing else walks by these.
///
/// All take a FixedRay, whose numbers every method can hold exactly where its own format can hold them at all, and
/// offer step(), cell(axis) and t(), where the last step's plane was crossed. None stops by itself.
#pragma once

#include <cmath>
#include <cstdint>

#include "world/space/grid_walk.h"

namespace world {

/// Origin in 2^-32 voxels from the world's origin, direction in any unit: whole numbers, so crossings are rationals.
struct FixedRay {
  int64_t origin[3] = {};     // |origin| < 2^55
  int32_t direction[3] = {};  // |direction| <= 2^24, not all zero; unit 2^-24

  int32_t voxel(int axis) const { return static_cast<int32_t>(origin[axis] >> 32); }
  uint32_t fraction(int axis) const { return static_cast<uint32_t>(origin[axis]); }
  GridRay ray() const {
    GridRay r;
    for (int a = 0; a < 3; ++a) {
      r.voxel[a] = voxel(a);
      r.fraction[a] = fraction(a) * 0x1p-32;
      r.direction[a] = direction[a] * 0x1p-24;
    }
    return r;
  }
};

/// Exact: crossings are compared as fractions by cross multiplication in 128 bits.
class ExactWalk {
 public:
  explicit ExactWalk(const FixedRay& ray) {
    for (int a = 0; a < 3; ++a) {
      up_[a] = ray.direction[a] >= 0;
      d_[a] = up_[a] ? ray.direction[a] : -int64_t{ray.direction[a]};
      n_[a] = up_[a] ? (int64_t{1} << 32) - ray.fraction(a) : int64_t{ray.fraction(a)};
      cell_[a] = ray.voxel(a);
    }
  }
  void step() {
    int axis = before_or_at(0, 1) ? 0 : 1;
    if (!before_or_at(axis, 2)) axis = 2;
    axis_ = axis;
    cell_[axis] += up_[axis] ? 1 : -1;
    n_[axis] += int64_t{1} << 32;
  }
  int32_t cell(int axis) const { return cell_[axis]; }
  int axis() const { return axis_; }  // of the last step
  double t() const {
    return static_cast<double>(n_[axis_] - (int64_t{1} << 32)) / static_cast<double>(d_[axis_]) * 0x1p-8;
  }
  /// The next crossing of the axis, in double from the exact fraction.
  double t_next(int axis) const {
    return d_[axis] == 0 ? kInfinity : static_cast<double>(n_[axis]) / static_cast<double>(d_[axis]) * 0x1p-8;
  }

 private:
  bool before_or_at(int a, int b) const {
    if (d_[b] == 0) return d_[a] != 0 || a < b;
    if (d_[a] == 0) return false;
    return static_cast<__int128>(n_[a]) * d_[b] <= static_cast<__int128>(n_[b]) * d_[a];
  }
  int64_t n_[3], d_[3];  // the next crossing is at n / d
  int32_t cell_[3];
  bool up_[3];
  int axis_ = -1;
};

/// The common loop, in world coordinates: next += delta. Real is float or double.
template <class Real>
class AccumulateWalk {
 public:
  explicit AccumulateWalk(const FixedRay& ray) {
    for (int a = 0; a < 3; ++a) {
      const Real origin = static_cast<Real>(ray.origin[a]) * Real(0x1p-32);
      const Real direction = static_cast<Real>(ray.direction[a]) * Real(0x1p-24);
      cell_[a] = static_cast<int32_t>(std::floor(origin));
      step_[a] = direction >= 0 ? 1 : -1;
      const Real plane = static_cast<Real>(cell_[a] + (direction >= 0 ? 1 : 0));
      const Real infinity = std::numeric_limits<Real>::infinity();
      next_[a] = direction == 0 ? infinity : (plane - origin) / direction;
      delta_[a] = direction == 0 ? infinity : std::abs(1 / direction);
    }
  }
  void step() {
    const int axis = next_[0] <= next_[1] ? (next_[0] <= next_[2] ? 0 : 2) : (next_[1] <= next_[2] ? 1 : 2);
    t_ = next_[axis];
    cell_[axis] += step_[axis];
    next_[axis] += delta_[axis];
  }
  int32_t cell(int axis) const { return cell_[axis]; }
  double t() const { return t_; }

 private:
  Real t_ = 0;
  Real next_[3], delta_[3];
  int32_t cell_[3], step_[3];
};

/// From the plane each time, in world coordinates.
template <class Real>
class RecomputeWalk {
 public:
  explicit RecomputeWalk(const FixedRay& ray) {
    for (int a = 0; a < 3; ++a) {
      origin_[a] = static_cast<Real>(ray.origin[a]) * Real(0x1p-32);
      const Real direction = static_cast<Real>(ray.direction[a]) * Real(0x1p-24);
      cell_[a] = static_cast<int32_t>(std::floor(origin_[a]));
      step_[a] = direction >= 0 ? 1 : -1;
      inverse_[a] = direction == 0 ? std::numeric_limits<Real>::infinity() : 1 / direction;
      next_[a] = direction == 0 ? inverse_[a] : t_at(a);
    }
  }
  void step() {
    const int axis = next_[0] <= next_[1] ? (next_[0] <= next_[2] ? 0 : 2) : (next_[1] <= next_[2] ? 1 : 2);
    t_ = next_[axis];
    cell_[axis] += step_[axis];
    next_[axis] = t_at(axis);
  }
  int32_t cell(int axis) const { return cell_[axis]; }
  double t() const { return t_; }

 private:
  Real t_at(int a) const { return (static_cast<Real>(cell_[a] + (step_[a] > 0 ? 1 : 0)) - origin_[a]) * inverse_[a]; }
  Real origin_[3], inverse_[3], next_[3], t_ = 0;
  int32_t cell_[3], step_[3];
};

/// FlatWalk behind the same face: double, from the plane, relative to the start's voxel.
class DoubleWalk {
 public:
  explicit DoubleWalk(const FixedRay& ray) : walk_(ray.ray()) {}
  void step() { walk_.step(); }
  int32_t cell(int axis) const { return walk_.voxel()[axis]; }
  double t() const { return walk_.t(); }

 private:
  FlatWalk walk_;
};

/// Whole numbers of 2^-32: t = (plane - fraction) * inverse, both 32.32, relative to the start's voxel; the inverse is
/// rounded once, and saturates for components below 2^-24.
class FixedWalk {
 public:
  explicit FixedWalk(const FixedRay& ray) {
    for (int a = 0; a < 3; ++a) {
      cell_[a] = ray.voxel(a);
      step_[a] = ray.direction[a] >= 0 ? 1 : -1;
      const int64_t d = int64_t{ray.direction[a]} * step_[a];
      distance_[a] = ray.direction[a] >= 0 ? (int64_t{1} << 32) - ray.fraction(a) : int64_t{ray.fraction(a)};
      inverse_[a] = d == 0 ? 0 : ((int64_t{1} << 56) + d / 2) / d;
      next_[a] = d == 0 ? INT64_MAX : t_at(a);
    }
  }
  void step() {
    const int axis = next_[0] <= next_[1] ? (next_[0] <= next_[2] ? 0 : 2) : (next_[1] <= next_[2] ? 1 : 2);
    t_ = next_[axis];
    cell_[axis] += step_[axis];
    distance_[axis] += int64_t{1} << 32;
    next_[axis] = t_at(axis);
  }
  int32_t cell(int axis) const { return cell_[axis]; }
  double t() const { return static_cast<double>(t_) * 0x1p-32; }

 private:
  int64_t t_at(int a) const {
    const __int128 t = static_cast<__int128>(distance_[a]) * inverse_[a] >> 32;
    return t > INT64_MAX ? INT64_MAX : static_cast<int64_t>(t);
  }
  int64_t distance_[3], inverse_[3], next_[3], t_ = 0;
  int32_t cell_[3], step_[3];
};

}  // namespace world
