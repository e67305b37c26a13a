/* What the members of world/media/ are told, and the stable exponentials that they share. Written once: in C++ a real
 * is a double, in GLSL a float.
 *
 * A member <kind>.shared.h answers, along the line origin + t * direction (length 1, everything in metres, relative to
 * the medium's position):
 *   real2 <kind>_span(m, origin, direction)                  the t where the line enters and leaves; x >= y: it misses
 *   real  <kind>_density(m, point)                           0 outside
 *   real  <kind>_depth(m, origin, direction, t0, t1)         integral of the density, in m; t0 <= t1 within the span
 *   real  <kind>_largest(m, origin, direction, t0, t1)       of the density; t0 <= t1 within the span
 *   real  <kind>_reach(m, origin, direction, t0, depth)      the t at which the depth from t0 on is `depth`; infinite
 *                                                            where it never is, and past the span where it is not there
 *   uint  <kind>_keys                                        what a [[medium]] of this kind may say
 * No answer is NaN for any finite origin and direction; t0, t1 and depth may be infinite.
 */
#ifndef LOAM_WORLD_MEDIA_MEDIUM_SHARED_H
#define LOAM_WORLD_MEDIA_MEDIUM_SHARED_H
#include "world/base/shared.h"

#ifdef __cplusplus
#include <limits>
namespace world {
namespace shared {
using real = double;
using real2 = glm::dvec2;
using real3 = glm::dvec3;
}  // namespace shared
}  // namespace world
#else
#define real float
#define real2 vec2
#define real3 vec3
#endif

SHARED_NAMESPACE(world)

struct MediumShape {
  real3 half_extent; /* m, > 0 */
  real3 normal;      /* unit */
  real scale_height; /* m, > 0 */
};

SHARED_CONST uint kMediumPosition = 1u;
SHARED_CONST uint kMediumHalfExtent = 2u;
SHARED_CONST uint kMediumNormal = 4u;
SHARED_CONST uint kMediumScaleHeight = 8u;
SHARED_CONST uint kMediumGrid = 16u;

#ifdef __cplusplus
inline constexpr real kMediumFar = std::numeric_limits<real>::infinity();
#else
#define kMediumFar uintBitsToFloat(0x7f800000u)
#endif

SHARED real2 medium_everywhere() { return real2(-kMediumFar, kMediumFar); }
SHARED real2 medium_nowhere() { return real2(kMediumFar, -kMediumFar); }

/* 1 - exp(-x). error: 4 ulp for any x, however small. */
SHARED real opacity(real x) {
#ifdef __cplusplus
  return -std::expm1(-x);
#else
  /* The series of degree 7 is right to 1 ulp of a float below 0.3. */
  if (abs(x) >= 0.3) return 1.0 - exp(-x);
  real sum = 1.0;
  for (int n = 8; n >= 2; --n) sum = 1.0 - sum * x / real(n);
  return x * sum;
#endif
}

/* log(1 + x), x > -1; -infinity at -1. error: 4 ulp. */
SHARED real log_one_plus(real x) {
#ifdef __cplusplus
  return std::log1p(x);
#else
  if (abs(x) >= 0.3) return log(1.0 + x);
  /* 2 artanh(s): right to 1 ulp of a float. */
  real s = x / (2.0 + x), s2 = s * s;
  return 2.0 * s * (1.0 + s2 * (1.0 / 3.0 + s2 * (1.0 / 5.0 + s2 * (1.0 / 7.0 + s2 / 9.0))));
#endif
}

/* log(1 + exp(x)), for any x. */
SHARED real soft_plus(real x) { return x > 40.0 ? x : log_one_plus(exp(x)); }

/* exp(-sigma * depth), in [0, 1]; 1 where either is 0, whatever the other is. */
SHARED real beer_lambert(real sigma, real depth) { return sigma > 0.0 && depth > 0.0 ? exp(-sigma * depth) : 1.0; }

/* (1 - exp(-x)) / x for x >= 0: the mean transmittance over a stretch of optical depth x. 1 at 0, 0 at infinity. */
SHARED real mean_transmittance(real x) { return x > 0.0 ? opacity(x) / x : 1.0; }

SHARED_NAMESPACE_END

#endif
