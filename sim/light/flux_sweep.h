/// One sweep: light leaves all surfaces and the sky, crosses the box along every ordinate, and ends on surfaces.
///
/// In a voxel of edge h the radiance psi along the ordinate O is the mean of what enters through the three upwind
/// faces, each by its share of the voxel's shadow,
///   psi = T sum_a |O_a| psi_a / sum_a |O_a| + q,    T = exp(-sigma h / sum_a |O_a|)
/// and leaves through the three others: as much as enters, so that energy is kept to rounding. (The step scheme of
/// discrete ordinates; h / sum|O_a| is the mean chord of a cube.) What crosses a voxel sideways is mixed with it: beams
/// widen with the root of their length, and nothing is ever negative.
///
/// layout  four floats for a value: red, green, blue, unused
/// order   sums have one order, whatever the SIMD level and the number of threads
/// source  Carlson, Lathrop. Transport Theory: The Method of Discrete Ordinates. 1965, the step difference
#pragma once

#include <vector>

#include <tbb/cache_aligned_allocator.h>

#include "sim/light/flux_grid.h"
#include "sim/light/ordinates.h"

namespace sim {

using AlignedFloats = std::vector<float, tbb::cache_aligned_allocator<float>>;

/// W, by band.
struct FluxTotals {
  double sky[3] = {};       // entered through the box's open sides
  double escaped[3] = {};   // left through them
  double absorbed[3] = {};  // in media
};

class FluxSweep {
 public:
  FluxSweep(const FluxGrid& grid, const Ordinates& set, const world::Environment& environment);
  ~FluxSweep();

  /// radiance    [surfaces][4] W/(m^2 sr), the same in all directions, that leaves each
  /// irradiance  [surfaces][4] W/m^2 that arrives
  /// sources     the sky and media emit too
  /// totals      where not null: filled, at a fifth more time
  void run(const float* radiance, float* irradiance, bool sources, FluxTotals* totals = nullptr);
  size_t bytes() const;

  struct Octant;

 private:
  const FluxGrid& grid_;
  std::vector<Octant> octants_;
  AlignedFloats arrived_[4];  // [surfaces][4], of two octants that share no surface
};

}  // namespace sim
