/* Density exp(-y / scale_height), y from the position up: 1 there, thinner above, thicker below without bound.
 *
 * With y the lower end of a stretch of length L, and x = L |slope| / scale_height:
 *   depth = exp(-y / scale_height) L (1 - exp(-x)) / x
 * which goes over into exp(..) L where the line is level, without a seam, and into scale_height / |slope| where x is
 * large.
 *
 * error   8 ulp of the depth, and |y| / scale_height ulp, which is what exp makes of its argument's rounding
 */
#ifndef LOAM_WORLD_MEDIA_HEIGHT_FOG_SHARED_H
#define LOAM_WORLD_MEDIA_HEIGHT_FOG_SHARED_H
#include "world/media/medium.shared.h"

SHARED_NAMESPACE(world)

SHARED_CONST uint height_fog_keys = kMediumPosition | kMediumScaleHeight;

SHARED real height_fog_y(real3 origin, real3 direction, real t) {
  return direction.y == 0.0 ? origin.y : origin.y + t * direction.y;
}
SHARED real2 height_fog_span(SHARED_IN(MediumShape), real3, real3) { return medium_everywhere(); }
SHARED real height_fog_density(SHARED_IN(MediumShape) m, real3 point) { return exp(-point.y / m.scale_height); }

SHARED real height_fog_largest(SHARED_IN(MediumShape) m, real3 origin, real3 direction, real t0, real t1) {
  real lower = height_fog_y(origin, direction, direction.y < 0.0 ? t1 : t0);
  return exp(-lower / m.scale_height);
}

SHARED real height_fog_depth(SHARED_IN(MediumShape) m, real3 origin, real3 direction, real t0, real t1) {
  real largest = height_fog_largest(m, origin, direction, t0, t1);
  real slope = abs(direction.y), stretch = t1 - t0;
  real x = stretch * slope / m.scale_height;
  /* Far above, where the density underflows, or on a stretch of no length: nothing, though the other be infinite. */
  if (!(largest > 0.0) || !(stretch > 0.0)) return 0.0;
  if (x > 1.0) return largest * (m.scale_height / slope * opacity(x));
  return largest * (stretch * mean_transmittance(x));
}

/* With r = density at t0 and q = depth slope / r:  t0 - log(1 - q) / slope, slope = direction.y / scale_height */
SHARED real height_fog_reach(SHARED_IN(MediumShape) m, real3 origin, real3 direction, real t0, real depth) {
  if (!(depth > 0.0)) return t0;
  if (!(depth < kMediumFar)) return kMediumFar;
  real above = height_fog_y(origin, direction, t0) / m.scale_height;
  real slope = direction.y / m.scale_height;
  real level = depth * exp(above); /* how far it would be along a level line; infinite where r underflows */
  real q = level * slope;
  if (q >= 1.0) return kMediumFar;
  /* Downwards it is always reached, though r underflow: by q's logarithm. */
  if (q < -1e10) return t0 - soft_plus(log(depth) + log(-slope) + above) / slope;
  return t0 + (abs(q) > 0.0 ? -log_one_plus(-q) / slope : level);
}

SHARED_NAMESPACE_END

#endif
