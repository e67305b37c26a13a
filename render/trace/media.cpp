#include "render/trace/media.h"

#include <algorithm>
#include <cmath>

#include "world/media/medium.shared.h"
#include "world/space/grid_walk.h"

namespace render {

using world::kInfinity;
using world::Medium;
using world::Vec3d;

namespace {

/// Optical depth to the next event of a Poisson process. u in [0, 1).
double free_depth(double u) { return -std::log1p(-u); }

}  // namespace

double track_collisions(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                        double sigma_t, RandomNumbers random, world::FunctionRef<bool(double, double)> event) {
  if (!(t0 < t1)) return 0;
  double at = t0, left = sigma_t > 0 ? free_depth(random()) : kInfinity, majorant = 0;
  world::medium_pieces(medium, origin, direction, t0, t1, [&](double end, double largest) {
    while (largest > 0) {
      const double rate = sigma_t * largest, here = rate * (end - at);
      if (!(left < here)) {
        left -= here;
        majorant += largest * (end - at);
        break;
      }
      at = std::min(at + left / rate, end);
      majorant += left / sigma_t;
      left = free_depth(random());
      // Beyond double's range matter is solid.
      const double density = world::medium_density(medium, origin + at * direction);
      const double share = largest < kInfinity ? std::min(density / largest, 1.0) : 1.0;
      if (!event(at, share)) return false;
    }
    at = end;
    return true;
  });
  return majorant;
}

int march_steps(double t0, double t1, double step_length) {
  const double steps = std::ceil((t1 - t0) / step_length);
  return steps >= 1 ? static_cast<int>(std::min(steps, 0x1p24)) : 1;
}

double marched_depth(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                     MarchRule rule, int steps, RandomNumbers random) {
  if (!(t0 < t1)) return 0;
  const double step = (t1 - t0) / steps;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double within = rule == MarchRule::left ? 0 : rule == MarchRule::midpoint ? 0.5 : random();
    sum += world::medium_density(medium, origin + (t0 + (i + within) * step) * direction);
  }
  return sum * step;
}

double closed_transmittance(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                            double sigma_t) {
  return world::shared::beer_lambert(sigma_t, world::medium_depth(medium, origin, direction, t0, t1));
}

double delta_tracked_transmittance(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0,
                                   double t1, double sigma_t, RandomNumbers random) {
  return delta_tracked_collision(medium, origin, direction, t0, t1, sigma_t, random) < kInfinity ? 0 : 1;
}

double ratio_tracked_transmittance(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0,
                                   double t1, double sigma_t, RandomNumbers random) {
  double passed = 1;
  if (!(sigma_t > 0)) return passed;
  track_collisions(medium, origin, direction, t0, t1, sigma_t, random, [&](double, double share) {
    passed *= 1 - share;
    if (passed < 1.0 / 16) passed = random() < 0.5 ? 2 * passed : 0;
    return passed > 0;
  });
  return passed;
}

double closed_collision(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                        double sigma_t, RandomNumbers random) {
  const double depth = free_depth(random());
  return sigma_t > 0 ? world::medium_reach(medium, origin, direction, t0, t1, depth / sigma_t) : kInfinity;
}

double delta_tracked_collision(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                               double sigma_t, RandomNumbers random) {
  double found = kInfinity;
  if (!(sigma_t > 0)) return found;
  track_collisions(medium, origin, direction, t0, t1, sigma_t, random, [&](double at, double share) {
    if (random() >= share) return true;
    found = at;
    return false;
  });
  return found;
}

}  // namespace render
