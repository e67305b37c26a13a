/// Light in physical units: the radiance that crosses the voxels of a box along a set of ordinates, reflected diffusely
/// by albedo until what is left over is less than a stated part.
///
///   B = M + rho (E_direct + K B)     W/m^2, by surface: radiosity, exitance, albedo, irradiance
/// with K one sweep (flux_sweep.h). K is symmetric, since a path has the same share both ways, and so conjugate
/// gradients solve (1 - sqrt(rho) K sqrt(rho)) u = sqrt(rho) E_0 with B = M + sqrt(rho) u. Where nothing changed,
/// nothing is swept.
///
/// books   emitted = absorbed + escaped + stored to rounding; stored is what the last residual has still to distribute
/// error   by directions (rays of light become lobes) and by voxel size, measured against the path tracer; by residual
/// cost    per sweep and voxel some 16 bytes of traffic and 5 flops a direction and band
/// source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, sections 14.7.2
/// and 31.10
///         (radiosity); Hestenes, Stiefel. Methods of Conjugate Gradients. 1952
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim/light/flux_grid.h"
#include "sim/light/lamps.h"
#include "world/base/errors.h"
#include "world/store/surface_irradiance.h"
#include "world/units/quantity.h"

namespace sim {

struct FluxKnobs {
  int directions = 32;  // see ordinates.h
  float residual =
      0.01f;  // > 0; mean of |M + rho E - B| / B over lit surfaces at which iteration ends, in the worst band
  int most_sweeps = 1000;
};

/// W, by band: doubles, since they are compared.
struct FluxBooks {
  double emitted[3] = {}, absorbed[3] = {}, escaped[3] = {}, stored[3] = {};
};

struct FluxReport {
  int sweeps = 0;         // 0: nothing had changed
  double residual = 0;    // reached
  bool converged = true;  // false: most_sweeps came first
  uint64_t surfaces = 0;
  size_t bytes = 0;
  FluxBooks books;
};

class Flux {
 public:
  /// The surfaces of the leaves that `box` touches. `store` is read here only.
  Flux(const world::Store& store, const world::VoxelBox& box, const world::Environment& environment);
  ~Flux();
  Flux(Flux&&) noexcept;
  Flux& operator=(Flux&&) noexcept;

  const FluxGrid& grid() const;
  /// Light that reaches surfaces straight, by rays: `apart` from what pictures draw themselves, sharply (the sun),
  /// W/m^2 by number of surface, or empty; and from lamps, whose glow then leaves by rays alone.
  void set_direct(const std::vector<world::Irradiance3>& apart, const LampLight& lamps);
  /// Starts the next solve from what `other` found on the surfaces that both have.
  void continue_from(const Flux& other);

  /// Iterates to the residual. Fails on a number of directions that no set has, and on a residual that isn't above 0.
  world::Result<FluxReport> solve(const FluxKnobs& knobs);

  /// W/m^2 by number of surface: all that arrives, and all that leaves.
  world::Irradiance3 irradiance(uint32_t surface) const;
  world::Irradiance3 radiosity(uint32_t surface) const;
  /// What arrives, but for what is apart, as render/ reads it.
  world::SurfaceIrradiance surface_irradiance() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sim
