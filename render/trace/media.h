/// How much light one medium lets through, and where it first stops it: closed forms, and the estimators that are
/// measured against them. One extinction at a time; how three bands and several media combine is the path's business.
///
/// sigma_t is the extinction at density 1, 1/m. Lines as in world/media/medium.h: relative to the medium's position,
/// directions of length 1, t in m. `random` gives independent numbers in [0, 1). Transmittances lie in [0, 1] but for
/// ratio tracking's, which is at least 0 and right in the mean; none is ever NaN.
#pragma once

#include "world/base/function_ref.h"
#include "world/media/medium.h"

namespace render {

using RandomNumbers = world::FunctionRef<double()>;

/// Where a march looks at each of its steps. left: at its near end, error first order in the step; midpoint: second
/// order; jittered: anywhere, so that the depth (not the transmittance) is right in the mean.
enum class MarchRule { left, midpoint, jittered };

/// The depth over [t0, t1], both finite, by `steps` >= 1 equal steps, m.
double marched_depth(const world::Medium& medium, const world::Vec3d& origin, const world::Vec3d& direction, double t0,
                     double t1, MarchRule rule, int steps, RandomNumbers random);
/// Steps of at most this length, m, > 0; at least one and at most 2^24.
int march_steps(double t0, double t1, double step_length);

/// Tracking: calls event(t, share) at tentative collisions, a Poisson process of rate sigma_t times a majorant of the
/// density, in order of t until it returns false; share: the part of the majorant that is density there, in [0, 1].
/// Returns the majorant's integral up to where it ended, m.
/// source  E. Woodcock et al. Techniques Used in the GEM Code for Monte Carlo Neutronics Calculations. 1965
double track_collisions(const world::Medium& medium, const world::Vec3d& origin, const world::Vec3d& direction,
                        double t0, double t1, double sigma_t, RandomNumbers random,
                        world::FunctionRef<bool(double t, double share)> event);

/// exp(-sigma_t depth): exact where the depth is.
double closed_transmittance(const world::Medium& medium, const world::Vec3d& origin, const world::Vec3d& direction,
                            double t0, double t1, double sigma_t);

/// 0 or 1, with the right mean: whether delta tracking passes.
double delta_tracked_transmittance(const world::Medium& medium, const world::Vec3d& origin,
                                   const world::Vec3d& direction, double t0, double t1, double sigma_t,
                                   RandomNumbers random);

/// The product over tentative collisions of the part that is none; its variance is lower than delta tracking's. What
/// fell below 1/16 lives on with probability 1/2, doubled.
/// source  Jan Novak, Andrew Selle, Wojciech Jarosz. Residual Ratio Tracking for Estimating Attenuation in
///         Participating Media. 2014
double ratio_tracked_transmittance(const world::Medium& medium, const world::Vec3d& origin,
                                   const world::Vec3d& direction, double t0, double t1, double sigma_t,
                                   RandomNumbers random);

/// The first collision in [t0, t1], with density sigma_t density(t) exp(-sigma_t depth(t0, t)); infinity: none.
/// closed: by the inverse of the depth, one random number. delta: by tracking, which needs densities only.
double closed_collision(const world::Medium& medium, const world::Vec3d& origin, const world::Vec3d& direction,
                        double t0, double t1, double sigma_t, RandomNumbers random);
double delta_tracked_collision(const world::Medium& medium, const world::Vec3d& origin, const world::Vec3d& direction,
                               double t0, double t1, double sigma_t, RandomNumbers random);

}  // namespace render
