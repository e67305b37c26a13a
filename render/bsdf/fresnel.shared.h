/* Fresnel's reflectance of a smooth boundary between two clear media, for unpolarised light.
 *
 * error   3e-7 absolute; exact where eta is 1 (0, also at grazing angles), at 90 degrees (1) and beyond the critical
 *         angle (1). What isn't reflected passes: T = 1 - R.
 * source  Augustin Fresnel's equations, as in Born and Wolf. Principles of Optics, section 1.5.2
 */
#ifndef LOAM_RENDER_BSDF_FRESNEL_SHARED_H
#define LOAM_RENDER_BSDF_FRESNEL_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(render)

/* cos_i in [0, 1]; eta: index of refraction beyond over that on this side, > 0. In [0, 1]. */
SHARED float fresnel_reflectance(float cos_i, float eta) {
  /* Where eta is 1 the cosine beyond is cos_i, which a device's sqrt of its square may miss: nothing would become a
   * reflection of some 1e-15, and a path more to follow. */
  if (eta == 1.0f) return 0.0f;
  /* eta times the cosine beyond, as in refracted_direction */
  float squared = (eta - 1.0f) * (eta + 1.0f) + cos_i * cos_i;
  if (!(squared >= 0.0f)) return 1.0f;
  float beyond = sqrt(squared);
  if (!(cos_i + beyond > 0.0f)) return 1.0f;
  float across = (cos_i - beyond) / (cos_i + beyond);
  float within = (eta * cos_i - beyond / eta) / (eta * cos_i + beyond / eta);
  return min(0.5f * (across * across + within * within), 1.0f);
}

SHARED_NAMESPACE_END

#endif
