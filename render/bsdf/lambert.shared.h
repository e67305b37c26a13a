/* A matte surface: f = k_L / pi wherever both directions are on the normal's side.
 *
 * reads   lambertian
 * error   f: 1 ulp. The weight of a sample is k_L itself.
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.9.2
 */
#ifndef LOAM_RENDER_BSDF_LAMBERT_SHARED_H
#define LOAM_RENDER_BSDF_LAMBERT_SHARED_H
#include "render/bsdf/parameters.shared.h"
#include "render/bsdf/sampling.shared.h"

SHARED_NAMESPACE(render)

SHARED vec3 lambert_finite_density(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  return reflects(wi, wo, n) ? p.lambertian * kBsdfInversePi : vec3(0.0f);
}

SHARED Impulses lambert_incoming_impulses(SHARED_IN(BsdfParameters), vec3, vec3) { return no_impulses(); }
SHARED Impulses lambert_outgoing_impulses(SHARED_IN(BsdfParameters), vec3, vec3) { return no_impulses(); }

SHARED float lambert_pdf(SHARED_IN(BsdfParameters), vec3 wi, vec3 wo, vec3 n) {
  return reflects(wi, wo, n) ? dot(n, wi) * kBsdfInversePi : 0.0f;
}

SHARED BsdfSample lambert_scatter_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n, vec3 u) {
  vec3 wi = cosine_direction(n, vec2(u.x, u.y));
  float pdf = lambert_pdf(p, wi, wo, n);
  return pdf > 0.0f ? finite_sample(wi, p.lambertian, pdf) : absorbed_sample();
}
SHARED BsdfSample lambert_scatter_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n, vec3 u) {
  return lambert_scatter_in(p, wi, n, u);
}

SHARED vec3 lambert_probability_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  return dot(n, wo) > 0.0f ? p.lambertian : vec3(0.0f);
}
SHARED vec3 lambert_probability_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  return lambert_probability_in(p, wi, n);
}

SHARED_NAMESPACE_END

#endif
