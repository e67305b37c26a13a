/* All members by number, for shaders: BSDF_lambert and so on are numbers in the order of the names, as in bsdfs(). Made
 * from the folder's list; C++ calls through the table of bsdf.h. */
#ifndef LOAM_RENDER_BSDF_EVERY_BSDF_SHARED_H
#define LOAM_RENDER_BSDF_EVERY_BSDF_SHARED_H
#include "render/bsdf/parameters.shared.h"

#include "render_bsdf.members.h"

SHARED_NAMESPACE(render)

SHARED vec3 bsdf_finite_density(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  switch (bsdf) {
#define BSDF(name)  \
  case BSDF_##name: \
    return name##_finite_density(p, wi, wo, n);
#include "render_bsdf.list.h"
#undef BSDF
  }
  return vec3(0.0f);
}

SHARED Impulses bsdf_incoming_impulses(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  switch (bsdf) {
#define BSDF(name)  \
  case BSDF_##name: \
    return name##_incoming_impulses(p, wo, n);
#include "render_bsdf.list.h"
#undef BSDF
  }
  return no_impulses();
}

SHARED Impulses bsdf_outgoing_impulses(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  switch (bsdf) {
#define BSDF(name)  \
  case BSDF_##name: \
    return name##_outgoing_impulses(p, wi, n);
#include "render_bsdf.list.h"
#undef BSDF
  }
  return no_impulses();
}

SHARED BsdfSample bsdf_scatter_in(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n, vec3 u) {
  switch (bsdf) {
#define BSDF(name)  \
  case BSDF_##name: \
    return name##_scatter_in(p, wo, n, u);
#include "render_bsdf.list.h"
#undef BSDF
  }
  return absorbed_sample();
}

SHARED BsdfSample bsdf_scatter_out(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n, vec3 u) {
  switch (bsdf) {
#define BSDF(name)  \
  case BSDF_##name: \
    return name##_scatter_out(p, wi, n, u);
#include "render_bsdf.list.h"
#undef BSDF
  }
  return absorbed_sample();
}

SHARED float bsdf_pdf(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  switch (bsdf) {
#define BSDF(name)  \
  case BSDF_##name: \
    return name##_pdf(p, wi, wo, n);
#include "render_bsdf.list.h"
#undef BSDF
  }
  return 0.0f;
}

SHARED vec3 bsdf_probability_in(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  switch (bsdf) {
#define BSDF(name)  \
  case BSDF_##name: \
    return name##_probability_in(p, wo, n);
#include "render_bsdf.list.h"
#undef BSDF
  }
  return vec3(0.0f);
}

SHARED vec3 bsdf_probability_out(uint bsdf, SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  switch (bsdf) {
#define BSDF(name)  \
  case BSDF_##name: \
    return name##_probability_out(p, wi, n);
#include "render_bsdf.list.h"
#undef BSDF
  }
  return vec3(0.0f);
}

SHARED_NAMESPACE_END

#endif
