/* Mirrored and refracted directions.
 *
 * All directions point away from the surface and have length 1. wi is where the path comes from, the normal n lies on
 * its side: dot(n, wi) >= 0 (the caller turns it).
 *
 * error   C++: each result has length 1 within 3 u (u = 2^-24), however often it is refracted again, and obeys Snell's
 *         law within 4 u / eta. Where eta is 1, refracting gives -wi within 2 ulp on each axis. The cosine beyond is
 *         sqrt((eta - 1)(eta + 1) + cos^2) / eta; 1 - sin^2 would lose half of the digits at grazing angles. GLSL:
 *         3 ulp of cos more, as its sqrt may have that error.
 * source  Snell's law in vector form, as in Andrew Glassner (editor). An Introduction to Ray Tracing. 1989, chapter 4
 */
#ifndef LOAM_RENDER_BSDF_DIRECTIONS_SHARED_H
#define LOAM_RENDER_BSDF_DIRECTIONS_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(render)

/* For v of length 1 within a few u: one step of Newton's method for 1 / sqrt, without a root. */
SHARED vec3 renormalised(vec3 v) { return v * (1.5f - 0.5f * dot(v, v)); }

SHARED vec3 reflected_direction(vec3 wi, vec3 n) { return renormalised(2.0f * dot(n, wi) * n - wi); }

/* eta: refractive index beyond the surface over that on wi's side, > 0.
 * All zero where nothing gets through (total internal reflection). */
SHARED vec3 refracted_direction(vec3 wi, vec3 n, float eta) {
  if (eta == 1.0f) return renormalised(-wi); /* a device's sqrt may not give back the root of a square */
  float cos_i = dot(n, wi);
  float squared = (eta - 1.0f) * (eta + 1.0f) + cos_i * cos_i;
  if (!(squared >= 0.0f)) return vec3(0.0f);
  return renormalised(((cos_i - sqrt(squared)) * n - wi) / eta);
}

SHARED_NAMESPACE_END

#endif
