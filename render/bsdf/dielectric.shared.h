/* The smooth boundary of a clear medium: an impulse reflected by Fresnel's share R, and one refracted by Snell's law
 * that carries the rest. What the medium absorbs on the way belongs to the medium, not to its surface.
 *
 * Radiance that arrives from beyond is scaled by 1 / eta^2, as the same power spreads over another solid angle; power
 * that leaves is not. So the two directions of transport differ in their impulses' magnitudes, and
 * f(wi, wo) = f(wo, wi) holds only for radiance over the squared index.
 *
 * reads   eta
 * error   magnitudes: 3e-7 of the incident light, R + T = 1 within 1 ulp. At the critical angle all is reflected.
 * source  Eric Veach. Robust Monte Carlo Methods for Light Transport Simulation. 1997, section 5.2 (scaling);
 *         render/bsdf/fresnel.shared.h and directions.shared.h
 */
#ifndef LOAM_RENDER_BSDF_DIELECTRIC_SHARED_H
#define LOAM_RENDER_BSDF_DIELECTRIC_SHARED_H
#include "render/bsdf/directions.shared.h"
#include "render/bsdf/fresnel.shared.h"
#include "render/bsdf/parameters.shared.h"

SHARED_NAMESPACE(render)

SHARED vec3 dielectric_finite_density(SHARED_IN(BsdfParameters), vec3, vec3, vec3) { return vec3(0.0f); }
SHARED float dielectric_pdf(SHARED_IN(BsdfParameters), vec3, vec3, vec3) { return 0.0f; }

/* Nothing is absorbed. */
SHARED vec3 dielectric_probability_in(SHARED_IN(BsdfParameters), vec3 wo, vec3 n) {
  return vec3(dot(n, wo) >= 0.0f ? 1.0f : 0.0f);
}
SHARED vec3 dielectric_probability_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  return dielectric_probability_in(p, wi, n);
}

/* `scale`: of what is refracted. */
SHARED Impulses dielectric_impulses(float eta, float scale, vec3 w, vec3 n) {
  float cosine = dot(n, w);
  if (!(cosine >= 0.0f)) return no_impulses();
  float reflectance = fresnel_reflectance(min(cosine, 1.0f), eta);
  Impulses both = with_impulse(no_impulses(), reflected_direction(w, n), vec3(reflectance));
  return with_impulse(both, refracted_direction(w, n, eta), vec3((1.0f - reflectance) * scale));
}
SHARED Impulses dielectric_incoming_impulses(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  return dielectric_impulses(p.eta, 1.0f / (p.eta * p.eta), wo, n);
}
SHARED Impulses dielectric_outgoing_impulses(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  return dielectric_impulses(p.eta, 1.0f, wi, n);
}

/* Reflects with probability R, so that a sample's weight is 1 or `scale`. */
SHARED BsdfSample dielectric_scatter(float eta, float scale, vec3 w, vec3 n, float choice) {
  float cosine = dot(n, w);
  if (!(cosine >= 0.0f)) return absorbed_sample();
  if (choice < fresnel_reflectance(min(cosine, 1.0f), eta))
    return impulse_sample(reflected_direction(w, n), vec3(1.0f));
  return impulse_sample(refracted_direction(w, n, eta), vec3(scale));
}
SHARED BsdfSample dielectric_scatter_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n, vec3 u) {
  return dielectric_scatter(p.eta, 1.0f / (p.eta * p.eta), wo, n, u.z);
}
SHARED BsdfSample dielectric_scatter_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n, vec3 u) {
  return dielectric_scatter(p.eta, 1.0f, wi, n, u.z);
}

SHARED_NAMESPACE_END

#endif
