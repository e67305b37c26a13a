/* A perfect mirror: one impulse, k_g of the light goes the mirrored way. No finite density at all.
 *
 * reads   glossy
 * error   the direction: render/bsdf/directions.shared.h
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.9.1
 */
#ifndef LOAM_RENDER_BSDF_MIRROR_SHARED_H
#define LOAM_RENDER_BSDF_MIRROR_SHARED_H
#include "render/bsdf/directions.shared.h"
#include "render/bsdf/parameters.shared.h"
#include "render/bsdf/sampling.shared.h"

SHARED_NAMESPACE(render)

SHARED vec3 mirror_finite_density(SHARED_IN(BsdfParameters), vec3, vec3, vec3) { return vec3(0.0f); }
SHARED float mirror_pdf(SHARED_IN(BsdfParameters), vec3, vec3, vec3) { return 0.0f; }

SHARED vec3 mirror_probability_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  return dot(n, wo) >= 0.0f ? p.glossy : vec3(0.0f);
}
SHARED vec3 mirror_probability_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  return mirror_probability_in(p, wi, n);
}

SHARED Impulses mirror_incoming_impulses(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  return with_impulse(no_impulses(), reflected_direction(wo, n), mirror_probability_in(p, wo, n));
}
SHARED Impulses mirror_outgoing_impulses(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  return mirror_incoming_impulses(p, wi, n);
}

SHARED BsdfSample mirror_scatter_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n, vec3) {
  vec3 weight = mirror_probability_in(p, wo, n);
  return largest_band(weight) > 0.0f ? impulse_sample(reflected_direction(wo, n), weight) : absorbed_sample();
}
SHARED BsdfSample mirror_scatter_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n, vec3 u) {
  return mirror_scatter_in(p, wi, n, u);
}

SHARED_NAMESPACE_END

#endif
