/* A surface that glows and scatters nothing: what it sends out is parameters.emission, which every member has and
 * whoever traces the path adds; here all else is 0.
 *
 * reads   nothing
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.10.4
 */
#ifndef LOAM_RENDER_BSDF_EMISSION_SHARED_H
#define LOAM_RENDER_BSDF_EMISSION_SHARED_H
#include "render/bsdf/parameters.shared.h"

SHARED_NAMESPACE(render)

SHARED vec3 emission_finite_density(SHARED_IN(BsdfParameters), vec3, vec3, vec3) { return vec3(0.0f); }
SHARED Impulses emission_incoming_impulses(SHARED_IN(BsdfParameters), vec3, vec3) { return no_impulses(); }
SHARED Impulses emission_outgoing_impulses(SHARED_IN(BsdfParameters), vec3, vec3) { return no_impulses(); }
SHARED BsdfSample emission_scatter_in(SHARED_IN(BsdfParameters), vec3, vec3, vec3) { return absorbed_sample(); }
SHARED BsdfSample emission_scatter_out(SHARED_IN(BsdfParameters), vec3, vec3, vec3) { return absorbed_sample(); }
SHARED float emission_pdf(SHARED_IN(BsdfParameters), vec3, vec3, vec3) { return 0.0f; }
SHARED vec3 emission_probability_in(SHARED_IN(BsdfParameters), vec3, vec3) { return vec3(0.0f); }
SHARED vec3 emission_probability_out(SHARED_IN(BsdfParameters), vec3, vec3) { return vec3(0.0f); }

SHARED_NAMESPACE_END

#endif
