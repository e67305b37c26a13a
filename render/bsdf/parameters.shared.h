/* What the BSDFs are told: one record for all members; each reads the fields that its file names. */
#ifndef LOAM_RENDER_BSDF_PARAMETERS_SHARED_H
#define LOAM_RENDER_BSDF_PARAMETERS_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(render)

struct BsdfParameters {
  vec3 lambertian;    /* k_L, (0, 1) by band: probability of matte scattering */
  float smoothness;   /* s >= 0, the exponent of a glossy lobe */
  vec3 glossy;        /* k_g, by band; k_L + k_g <= 1 */
  float eta;          /* index of refraction beyond the surface over that on this side, > 0 */
  vec3 transmission;  /* t, [0, 1] by band: what passes straight through a thin surface */
  float coverage;     /* alpha, [0, 1]: the part of the surface that is there */
  vec3 emission;      /* W/(m^2 sr) that the surface sends out */
  float reserved;
};

SHARED_NAMESPACE_END

#endif
