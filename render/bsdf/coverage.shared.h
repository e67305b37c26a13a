/* A surface that covers only the share alpha of its area: lace, a screen door, what a filtered texture leaves of an
 * edge. There it is render/bsdf/blinn_phong.shared.h (matte where k_g is 0); elsewhere light goes straight on.
 *
 * Two such surfaces one behind the other pass (1 - alpha)^2, as though their holes had nothing to do with each other.
 *
 * reads   coverage, and what blinn_phong reads
 * error   that of blinn_phong
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.10.2;
 *         Thomas Porter, Tom Duff. Compositing Digital Images. 1984
 */
#ifndef LOAM_RENDER_BSDF_COVERAGE_SHARED_H
#define LOAM_RENDER_BSDF_COVERAGE_SHARED_H
#include "render/bsdf/blinn_phong.shared.h"

SHARED_NAMESPACE(render)

SHARED vec3 coverage_finite_density(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  return p.coverage * blinn_phong_finite_density(p, wi, wo, n);
}

SHARED Impulses coverage_incoming_impulses(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  return dot(n, wo) >= 0.0f ? with_impulse(no_impulses(), -wo, vec3(1.0f - p.coverage)) : no_impulses();
}
SHARED Impulses coverage_outgoing_impulses(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  return coverage_incoming_impulses(p, wi, n);
}

/* With which light goes on: 1 - alpha, and what is scattered by the mean of its bands. */
SHARED float passing_share(SHARED_IN(BsdfParameters) p) {
  float passed = 1.0f - p.coverage, all = passed + p.coverage * mean_band(p.lambertian + p.glossy);
  return all > 0.0f ? passed / all : 0.0f;
}

SHARED float coverage_pdf(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  return (1.0f - passing_share(p)) * blinn_phong_pdf(p, wi, wo, n);
}

SHARED BsdfSample coverage_scatter_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n, vec3 u) {
  if (!(dot(n, wo) >= 0.0f)) return absorbed_sample();
  float passing = passing_share(p);
  if (u.z < passing) return impulse_sample(-wo, vec3((1.0f - p.coverage) / passing));
  if (!(passing < 1.0f)) return absorbed_sample(); /* u.z is 1, by rounding */
  vec3 again = vec3(u.x, u.y, (u.z - passing) / (1.0f - passing));
  BsdfSample drawn = blinn_phong_scatter_in(p, wo, n, again);
  drawn.weight *= p.coverage / (1.0f - passing);
  drawn.pdf *= 1.0f - passing;
  return drawn;
}
SHARED BsdfSample coverage_scatter_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n, vec3 u) {
  return coverage_scatter_in(p, wi, n, u);
}

SHARED vec3 coverage_probability_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  if (!(dot(n, wo) >= 0.0f)) return vec3(0.0f);
  return vec3(1.0f - p.coverage) + p.coverage * blinn_phong_probability_in(p, wo, n);
}
SHARED vec3 coverage_probability_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  return coverage_probability_in(p, wi, n);
}

SHARED_NAMESPACE_END

#endif
