/* All members by number, for shaders: BSDF_lambert and so on are numbers in the order of the names, as in bsdfs(). Made
 * from the folder's list; C++ calls through the table of bsdf.h. */
#ifndef LOAM_RENDER_BSDF_EVERY_BSDF_SHARED_H
#define LOAM_RENDER_BSDF_EVERY_BSDF_SHARED_H
#include "render/bsdf/parameters.shared.h"

#include "render_bsdf.members.h"

SHARED_NAMESPACE(render)

SHARED vec3 bsdf_finite_density(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  DISPATCH_BSDF(bsdf, finite_density, (p, wi, wo, n))
  return vec3(0.0f);
}

SHARED Impulses bsdf_incoming_impulses(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  DISPATCH_BSDF(bsdf, incoming_impulses, (p, wo, n))
  return no_impulses();
}

SHARED Impulses bsdf_outgoing_impulses(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  DISPATCH_BSDF(bsdf, outgoing_impulses, (p, wi, n))
  return no_impulses();
}

SHARED BsdfSample bsdf_scatter_in(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n, vec3 u) {
  DISPATCH_BSDF(bsdf, scatter_in, (p, wo, n, u))
  return absorbed_sample();
}

SHARED BsdfSample bsdf_scatter_out(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n, vec3 u) {
  DISPATCH_BSDF(bsdf, scatter_out, (p, wi, n, u))
  return absorbed_sample();
}

SHARED float bsdf_pdf(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  DISPATCH_BSDF(bsdf, pdf, (p, wi, wo, n))
  return 0.0f;
}

SHARED vec3 bsdf_probability_in(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  DISPATCH_BSDF(bsdf, probability_in, (p, wo, n))
  return vec3(0.0f);
}

SHARED vec3 bsdf_probability_out(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  DISPATCH_BSDF(bsdf, probability_out, (p, wi, n))
  return vec3(0.0f);
}

SHARED_NAMESPACE_END

#endif
